#include <blockid/cli/report/correlation.hpp>

#include <algorithm>
#include <cmath>

namespace blockid::cli {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// mask (x - mean of the samples that count)
VectorXd deviations(const VectorXd& x, const VectorXd& mask) {
  const VectorXd kept = (mask.array() > 0.0).select(x, 0.0);
  const double mean = kept.sum() / std::max(mask.sum(), 1.0);
  return (mask.array() > 0.0).select(x.array() - mean, 0.0);
}

}  // namespace

VectorXd autocorrelation(const VectorXd& x, const VectorXd& mask, Index max_lag) {
  const VectorXd d = deviations(x, mask);
  const Index n = d.size();
  VectorXd result = VectorXd::Zero(max_lag + 1);
  for (Index k = 0; k <= std::min(max_lag, n - 1); ++k) result[k] = d.head(n - k).dot(d.tail(n - k));
  return result / d.squaredNorm();
}

VectorXd cross_correlation(const VectorXd& a, const VectorXd& b, const VectorXd& mask, Index max_lag) {
  const VectorXd da = deviations(a, VectorXd::Ones(a.size()));
  const VectorXd db = deviations(b, mask);
  const Index n = da.size();
  VectorXd result = VectorXd::Zero(2 * max_lag + 1);
  for (Index k = 0; k <= std::min(max_lag, n - 1); ++k) {
    result[max_lag + k] = da.head(n - k).dot(db.tail(n - k));
    result[max_lag - k] = da.tail(n - k).dot(db.head(n - k));
  }
  return result / std::sqrt(da.squaredNorm() * db.squaredNorm());
}

double whiteness_band(Index samples) { return kTwoSided99 / std::sqrt(static_cast<double>(samples)); }

double independence_band(const VectorXd& autocorrelation_a, const VectorXd& autocorrelation_b, Index samples) {
  const Index lags = std::min(autocorrelation_a.size(), autocorrelation_b.size()) - 1;
  double p = 1.0;
  if (lags > 0) p += 2.0 * autocorrelation_a.segment(1, lags).dot(autocorrelation_b.segment(1, lags));
  // A truncated sum may come out too small, even negative.
  constexpr double kLeast = 0.05;
  return kTwoSided99 * std::sqrt(std::max(p, kLeast) / static_cast<double>(samples));
}

}  // namespace blockid::cli
