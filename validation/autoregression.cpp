#include <blockid/validation/autoregression.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/row_major.hpp>

#include <algorithm>
#include <cmath>

namespace blockid {
namespace {

using detail::RowMajor;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// So that all columns pass a recursion together, row by row.

/// The order of 1, a_1..a_p and its innovation variance, one step of Levinson's recursion after the other.
class Levinson {
 public:
  explicit Levinson(const VectorXd& autocovariance) : r_(autocovariance), variance_(autocovariance[0]) {}

  Index order() const { return a_.size(); }
  const VectorXd& coefficients() const { return a_; }
  double variance() const { return variance_; }

  /// One order more; false when the autocovariances are exhausted or do not belong to a stable process, as those of
  /// records with gaps may not.
  bool step() {
    const Index p = order();
    if (p + 1 >= r_.size()) return false;
    const double prediction = r_[p + 1] + a_.dot(r_.segment(1, p).reverse());
    const double reflection = -prediction / variance_;
    if (!(std::abs(reflection) < 1.0)) return false;
    VectorXd next(p + 1);
    next.head(p) = a_ + reflection * a_.reverse();
    next[p] = reflection;
    a_ = next;
    variance_ *= (1.0 - reflection) * (1.0 + reflection);
    return variance_ > 0.0;
  }

 private:
  VectorXd r_;
  VectorXd a_;
  double variance_;
};

void check(std::span<const MaskedSignal> records) {
  double counted = 0.0;
  for (const MaskedSignal& record : records) {
    if (record.values.size() != record.mask.size()) {
      fail("autoregression: expected a mask of ", record.values.size(), " samples, got ", record.mask.size());
    }
    if (!(record.mask.array() > 0.0).select(record.values, 0.0).allFinite()) {
      fail("autoregression: expected finite values, got one that is not");
    }
    counted += record.mask.sum();
  }
  if (!(counted > 0.0)) fail("autoregression: expected at least one sample that counts, got none");
}

}  // namespace

Autoregression fit_autoregression(std::span<const MaskedSignal> records, Index max_order) {
  check(records);
  return fit_autoregression(pair_sums(records, max_order));
}

Autoregression fit_autoregression(const PairSums& sums) {
  const double samples = sums.counts[0];
  Autoregression best;
  best.variance = sums.products[0] / samples;
  best.innovation_variance = best.variance;
  best.autocorrelation = VectorXd::Ones(1);
  if (!(best.variance > 0.0)) return best;
  Levinson levinson(sums.products / samples);
  double least = samples * std::log(best.variance);
  while (levinson.step()) {
    const double criterion = samples * std::log(levinson.variance()) + 2.0 * static_cast<double>(levinson.order());
    if (criterion >= least) continue;
    least = criterion;
    best.coefficients = levinson.coefficients();
    best.autocorrelation = sums.products.head(levinson.order() + 1) / sums.products[0];
    best.innovation_variance = levinson.variance();
  }
  return best;
}

MatrixXd backward_filtered(const Autoregression& noise, const MatrixXd& z) {
  // What is left out has less than 1e-8 of the largest entry's size, 1e-16 of its square.
  constexpr double kNegligible = 1e-8;
  const Index n = z.rows();
  const Index p = noise.order();
  const double negligible = kNegligible * (z.size() > 0 ? z.cwiseAbs().maxCoeff() : 0.0);
  RowMajor f(2 * n, z.cols());
  f.bottomRows(n) = z;
  f.topRows(n).setZero();
  Index first = n;
  Index quiet = 0;
  for (Index t = 2 * n - 2; t >= 0 && (t >= n || quiet < p); --t) {
    const Index taps = std::min(p, 2 * n - 1 - t);
    for (Index k = 1; k <= taps; ++k) f.row(t) -= noise.coefficients[k - 1] * f.row(t + k);
    if (t >= n) continue;
    first = t;
    quiet = f.row(t).cwiseAbs().maxCoeff() > negligible ? 0 : quiet + 1;
  }
  return f.bottomRows(2 * n - first);
}

MatrixXd covariance_times(const Autoregression& noise, const MatrixXd& z) {
  RowMajor f = backward_filtered(noise, z);
  for (Index t = 1; t < f.rows(); ++t) {
    const Index taps = std::min(noise.order(), t);
    for (Index k = 1; k <= taps; ++k) f.row(t) -= noise.coefficients[k - 1] * f.row(t - k);
  }
  return noise.innovation_variance * f.bottomRows(z.rows());
}

double effective_samples(const Autoregression& noise, Index n) {
  // rho_k = -a_1 rho_{k-1} - ... - a_p rho_{k-p}; the end is reached when p of them in a row no longer count.
  constexpr double kNegligible = 1e-8;
  const Index p = noise.order();
  VectorXd rho = VectorXd::Zero(std::max(n, p + 1));
  rho.head(p + 1) = noise.autocorrelation;
  double squares = 1.0;
  Index quiet = 0;
  for (Index k = 1; k < n && quiet <= p; ++k) {
    if (k > p) rho[k] = -noise.coefficients.dot(rho.segment(k - p, p).reverse());
    squares += 2.0 * rho[k] * rho[k];
    quiet = std::abs(rho[k]) < kNegligible ? quiet + 1 : 0;
  }
  return static_cast<double>(n) / squares;
}

}  // namespace blockid
