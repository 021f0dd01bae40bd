#include <blockid/validation/band_bound.hpp>

#include <blockid/data/error.hpp>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixX2d;
using Eigen::Vector2d;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Keeps the triangle regular where cosine and sine are one, at 0 and pi; the bound stays one.
constexpr double kRelativeTau = 1e-8;

void check_arguments(const VectorXd& v, const VectorXd& w, const VectorXd& omegas, Index length, double gamma) {
  if (v.size() < 1 || v.size() != w.size()) {
    fail("band bound: expected v and w of one size, at least 1, got ", v.size(), " and ", w.size());
  }
  if (!v.allFinite() || !w.allFinite()) fail("band bound: expected finite samples");
  if (v.isZero(0.0)) fail("band bound: the signal v is zero, nothing excites the loop");
  if (length < 1 || length > v.size()) {
    fail("band bound: expected a length between 1 and ", v.size(), ", got ", length);
  }
  if (!(gamma >= 0.0) || !std::isfinite(gamma)) {
    fail("band bound: expected a finite noise bound of at least 0, got ", gamma);
  }
  for (const double omega : omegas) {
    if (!(omega >= 0.0 && omega <= std::numbers::pi)) {
      fail("band bound: expected frequencies between 0 and pi, got ", omega);
    }
  }
}

MatrixX2d test_signals(double omega, Index length) {
  MatrixX2d x(length, 2);
  for (Index k = 0; k < length; ++k) {
    const double at = static_cast<double>(k);
    const double window =
        0.5 * (1.0 - std::cos(2.0 * std::numbers::pi * (at + 1.0) / (static_cast<double>(length) + 1.0)));
    x.row(k) << window * std::cos(omega * at), window * std::sin(omega * at);
  }
  return x;
}

/// T_v x, column by column.
MatrixX2d convolved(const VectorXd& v, const MatrixX2d& x) {
  MatrixX2d y = MatrixX2d::Zero(v.size(), 2);
  for (Index k = 0; k < x.rows(); ++k) y.bottomRows(v.size() - k) += v.head(v.size() - k) * x.row(k);
  return y;
}

/// R of the QR factorisation of two columns.
Eigen::Matrix2d triangle(const MatrixX2d& columns) {
  Eigen::Matrix2d r = Eigen::Matrix2d::Zero();
  r(0, 0) = columns.col(0).norm();
  const VectorXd first = columns.col(0) / r(0, 0);
  VectorXd second = columns.col(1);
  // Twice is enough for orthogonality to rounding.
  for (int pass = 0; pass < 2; ++pass) {
    const double projection = first.dot(second);
    r(0, 1) += projection;
    second -= projection * first;
  }
  r(1, 1) = second.norm();
  return r;
}

/// The eigenvector of the larger eigenvalue of a symmetric matrix.
Vector2d principal_direction(const Eigen::Matrix2d& symmetric) {
  const double angle = 0.5 * std::atan2(2.0 * symmetric(0, 1), symmetric(0, 0) - symmetric(1, 1));
  return {std::cos(angle), std::sin(angle)};
}

/// The combination c of unit length in the metric of `in` that makes |out c| / |in c| largest.
Vector2d best_combination(const MatrixX2d& in, const MatrixX2d& out) {
  MatrixX2d stacked(in.rows() + 2, 2);
  stacked << in, kRelativeTau * in.norm() * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d whitening = triangle(stacked).inverse();
  const Eigen::Matrix2d gram = whitening.transpose() * (out.transpose() * out) * whitening;
  return whitening * principal_direction(gram);
}

/// sqrt(sum_t (sum_{k<=t} |x_k|)^2), t = 0..count-1.
double noise_gain(const VectorXd& x, Index count) {
  double partial = 0.0;
  double squares = 0.0;
  for (Index t = 0; t < count; ++t) {
    if (t < x.size()) partial += std::abs(x[t]);
    squares += partial * partial;
  }
  return std::sqrt(squares);
}

/// Mean and deviation of |omega| under the spectrum of `signal`.
void set_band(const VectorXd& signal, BandBound& bound) {
  const Index size = 2 * signal.size();
  VectorXcd padded = VectorXcd::Zero(size);
  padded.head(signal.size()) = signal;
  VectorXcd spectrum(size);
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, padded);
  const VectorXd weight = spectrum.head(signal.size() + 1).cwiseAbs2();
  const VectorXd omega = VectorXd::LinSpaced(signal.size() + 1, 0.0, std::numbers::pi);
  bound.mean_omega = weight.dot(omega) / weight.sum();
  bound.spread_omega = std::sqrt(weight.dot((omega.array() - bound.mean_omega).square().matrix()) / weight.sum());
}

BandBound bound_at(const VectorXd& v, const VectorXd& w, double omega, Index length, double gamma) {
  const MatrixX2d x = test_signals(omega, length);
  const MatrixX2d in = convolved(v, x);
  const MatrixX2d out = convolved(w, x);
  BandBound bound;
  bound.omega = omega;
  if (in.isZero(0.0)) return bound;
  const Vector2d c = best_combination(in, out);
  const VectorXd driven = in * c;
  bound.gain = std::max(0.0, (out * c).norm() - gamma * noise_gain(x * c, v.size())) / driven.norm();
  set_band(driven, bound);
  return bound;
}

}  // namespace

std::vector<BandBound> band_bounds(const VectorXd& v, const VectorXd& w, const VectorXd& omegas, Index length,
                                   double gamma) {
  check_arguments(v, w, omegas, length, gamma);
  std::vector<BandBound> bounds;
  for (const double omega : omegas) bounds.push_back(bound_at(v, w, omega, length, gamma));
  return bounds;
}

}  // namespace blockid
