#include <blockid/validation/noise_free_bound.hpp>

#include <blockid/data/error.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void check_pair(const VectorXd& v, const VectorXd& w) {
  if (v.size() < 1 || v.size() != w.size()) {
    fail("uncertainty bound: expected v and w of one size, at least 1, got ", v.size(), " and ", w.size());
  }
  if (!v.allFinite() || !w.allFinite()) fail("uncertainty bound: expected finite samples");
}

void check_tau(double relative_tau) {
  if (!(relative_tau >= 1e-10)) {
    fail("uncertainty bound: expected a relative tau of at least 1e-10, got ", relative_tau);
  }
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
  const Eigen::HouseholderQR<MatrixXd> qr(std::move(stacked));
  const MatrixXd r = qr.matrixQR().topRows(n);
  const MatrixXd ratio = r.triangularView<Eigen::Upper>().transpose().solve(tw.transpose());
  return largest_singular_value(ratio);
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

double toeplitz_norm(const VectorXd& v) { return v.size() == 0 ? 0.0 : largest_singular_value(lower_toeplitz(v)); }

double noise_free_bound(const VectorXd& v, const VectorXd& w, double relative_tau) {
  check_pair(v, w);
  check_tau(relative_tau);
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
  check_tau(relative_tau);
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
  const MatrixXd tv = lower_toeplitz(v);
  const MatrixXd tw = lower_toeplitz(w);
  double best = 0.0;
  for (double exponent = -8.0; exponent <= 1.0; exponent += 0.5) {
    const double tau = norm * std::pow(10.0, exponent);
    const double alpha = bound_at(tv, tw, tau);
    best = std::max(best, alpha * alpha - (eta / tau) * (eta / tau));
  }
  return std::sqrt(best);
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
