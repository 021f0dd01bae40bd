#include <blockid/validation/noise_free_bound.hpp>

#include <blockid/blocks/detail/infinity.hpp>
#include <blockid/data/error.hpp>
#include <blockid/validation/detail/relative_tau.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace blockid {
namespace {

using detail::check_relative_tau;
using detail::kInfinity;
using detail::kSmallestTau;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNormTolerance = 1e-12;
constexpr double kRaise = 1e-4;

void check_pair(const VectorXd& v, const VectorXd& w) {
  if (v.size() < 1 || v.size() != w.size()) {
    fail("uncertainty bound: expected v and w of one size, at least 1, got ", v.size(), " and ", w.size());
  }
  if (!v.allFinite() || !w.allFinite()) fail("uncertainty bound: expected finite samples");
}

double largest_singular_value(const MatrixXd& m) {
  const MatrixXd gram = m.transpose() * m;
  const double square = Eigen::SelfAdjointEigenSolver<MatrixXd>(gram, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  return std::sqrt(std::max(square, 0.0));
}

double bound_at(const MatrixXd& tv, const MatrixXd& tw, double tau) {
  const Index n = tv.rows();
  MatrixXd stacked(2 * n, n);
  stacked << tv, tau * MatrixXd::Identity(n, n);
  const Eigen::HouseholderQR<MatrixXd> qr(stacked);
  const MatrixXd r = qr.matrixQR().topRows(n);
  const MatrixXd ratio = r.triangularView<Eigen::Upper>().transpose().solve(tw.transpose());
  return largest_singular_value(ratio);
}

/// (J T_v) x: a symmetric matrix with the singular values of T_v.
VectorXd hankel_times(const VectorXd& v, const VectorXd& x) {
  const Index n = v.size();
  VectorXd y = VectorXd::Zero(n);
  for (Index k = 0; k < n; ++k) y.head(n - k) += x[k] * v.head(n - k).reverse();
  return y;
}

/// Largest |eigenvalue| of J T_v, from below.
double lanczos_norm(const VectorXd& v) {
  const Index n = v.size();
  MatrixXd basis(n, 0);
  VectorXd diagonal(n);
  VectorXd beside(n);
  // A start that no eigenvector of a Hankel matrix is likely to be orthogonal to.
  VectorXd q = VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1)).unaryExpr([](double t) {
    return 1.0 + 0.5 * std::sin(t * t);
  });
  q.normalize();
  double largest = 0.0;
  for (Index k = 0; k < n; ++k) {
    basis.conservativeResize(Eigen::NoChange, k + 1);
    basis.col(k) = q;
    q = hankel_times(v, q);
    diagonal[k] = basis.col(k).dot(q);
    for (int pass = 0; pass < 2; ++pass) q -= basis * (basis.transpose() * q).eval();
    beside[k] = q.norm();
    Eigen::SelfAdjointEigenSolver<MatrixXd> ritz;
    ritz.computeFromTridiagonal(diagonal.head(k + 1), beside.head(k));
    const VectorXd values = ritz.eigenvalues().cwiseAbs();
    Index at = 0;
    largest = values.maxCoeff(&at);
    if (beside[k] * std::abs(ritz.eigenvectors()(k, at)) <= kNormTolerance * largest) break;
    q /= beside[k];
  }
  return largest;
}

/// The largest alpha >= low with excluded(alpha), to a relative kRaise; `low` when there is none above it.
template <class Excluded>
double raised_bound(double low, double scale, const Excluded& excluded) {
  double high = low > 0.0 ? (1.0 + kRaise) * low : 1e-6 * scale;
  if (!excluded(high)) return low;
  while (excluded(high)) {
    low = high;
    high *= 2.0;
    if (high > 1e200) return low;
  }
  while (high - low > kRaise * high) {
    const double middle = 0.5 * (low + high);
    (excluded(middle) ? low : high) = middle;
  }
  return low;
}

/// The bounds when v is zero: nothing but w = 0 comes out of a finite Delta.
double bound_of_silence(const VectorXd& w) { return w.isZero(0.0) ? 0.0 : kInfinity; }

}  // namespace

MatrixXd lower_toeplitz(const VectorXd& v) {
  const Index n = v.size();
  MatrixXd t = MatrixXd::Zero(n, n);
  for (Index k = 0; k < n; ++k) t.col(k).tail(n - k) = v.head(n - k);
  return t;
}

double toeplitz_norm(const VectorXd& v) { return v.isZero(0.0) ? 0.0 : lanczos_norm(v); }

double noise_free_bound(const VectorXd& v, const VectorXd& w, double relative_tau) {
  check_pair(v, w);
  check_relative_tau(relative_tau);
  const double norm = toeplitz_norm(v);
  if (norm == 0.0) return bound_of_silence(w);
  return bound_at(lower_toeplitz(v), lower_toeplitz(w), relative_tau * norm);
}

bool schur_test(const VectorXd& v, const VectorXd& w, double alpha, double tau) {
  check_pair(v, w);
  const Index n = v.size();
  VectorXd a = alpha * v;
  VectorXd b = VectorXd::Zero(n);
  b[0] = tau;
  VectorXd c = w;
  for (Index k = 0; k < n; ++k) {
    const Index left = n - k;
    const double r = std::hypot(a[k], b[k]);
    if (!(r > std::abs(c[k]))) return false;
    const double cosine = a[k] / r;
    const double sine = b[k] / r;
    const double q = c[k] / r;
    const double root = std::sqrt((1.0 - q) * (1.0 + q));
    for (Index i = n - left; i < n; ++i) {
      const double first = cosine * a[i] + sine * b[i];
      b[i] = cosine * b[i] - sine * a[i];
      a[i] = (first - q * c[i]) / root;
      c[i] = root * c[i] - q * a[i];
    }
    // The displacement is the shift by one sample.
    for (Index i = n - 1; i > k; --i) a[i] = a[i - 1];
  }
  return true;
}

double schur_bound(const VectorXd& v, const VectorXd& w, double relative_tau) {
  check_pair(v, w);
  check_relative_tau(relative_tau);
  const double norm = toeplitz_norm(v);
  if (norm == 0.0) return bound_of_silence(w);
  if (w.isZero(0.0)) return 0.0;
  const double tau = relative_tau * norm;
  double low = 0.0;
  double high = 1.0;
  while (!schur_test(v, w, high, tau)) {
    low = high;
    high *= 2.0;
    if (high > 1e200) return low;
  }
  while (high - low > 1e-9 * high) {
    const double middle = 0.5 * (low + high);
    (schur_test(v, w, middle, tau) ? high : low) = middle;
  }
  return low;
}

double noise_corrected_bound(const VectorXd& v, const VectorXd& w, double gamma) {
  check_pair(v, w);
  if (!(gamma >= 0.0)) fail("uncertainty bound: expected a noise bound of at least 0, got ", gamma);
  const double norm = toeplitz_norm(v);
  if (norm == 0.0) return w.cwiseAbs().maxCoeff() <= gamma ? 0.0 : kInfinity;
  const double n = static_cast<double>(v.size());
  const double eta = gamma / (2.0 * std::sin(std::numbers::pi / (4.0 * n + 2.0)));
  const auto excluded = [&](double alpha, double s) {
    const double tau = std::max(eta * std::sqrt(1.0 + 1.0 / s), kSmallestTau * alpha * norm);
    return !schur_test(v, w, alpha * std::sqrt(1.0 + s), tau);
  };
  double best = 0.0;
  double best_s = 1.0;
  const auto improve = [&](double s) {
    const double raised = raised_bound(best, w.norm() / norm, [&](double alpha) { return excluded(alpha, s); });
    if (raised > best) best_s = s;
    best = raised;
  };
  // s off by a factor f loses at most (f + 1/f - 2) / 4 of alpha^2: with f = 2^(1/8), 0.2 %.
  for (int k = -4; k <= 30; ++k) improve(std::ldexp(1.0, -k));
  for (const double exponent : {0.5, 0.25}) {
    const double step = std::exp2(exponent);
    const double center = best_s;
    improve(center * step);
    improve(center / step);
  }
  return best;
}

VectorXd running_bound(const VectorXd& v, const VectorXd& w) {
  check_pair(v, w);
  VectorXd bound(v.size());
  double v_square = 0.0;
  double w_square = 0.0;
  double best = 0.0;
  for (Index t = 0; t < v.size(); ++t) {
    v_square += v[t] * v[t];
    w_square += w[t] * w[t];
    if (w_square > 0.0) best = std::max(best, std::sqrt(w_square / v_square));
    bound[t] = best;
  }
  return bound;
}

}  // namespace blockid
