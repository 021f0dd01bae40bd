#include "blockid/data/metrics.hpp"

#include <cmath>
#include <limits>

#include "blockid/data/error.hpp"

namespace blockid {
namespace {

using Signal = Eigen::Ref<const Eigen::VectorXd>;

void check_arguments(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  if (yhat.size() != y.size()) {
    fail("metrics: unequal lengths: ", y.size(), " measured samples, ", yhat.size(), " simulated");
  }
  if (weights.size() != 0 && weights.size() != y.size()) {
    fail("metrics: unequal lengths: ", y.size(), " measured samples, ", weights.size(), " weights");
  }
  if (warmup < 0 || warmup >= y.size()) {
    fail("metrics: no sample to score: warm-up is ", warmup, ", expected 0 to ", y.size() - 1, " for ", y.size(),
         " samples");
  }
}

bool is_scored(const Eigen::VectorXd& weights, Eigen::Index t) {
  if (weights.size() == 0) return true;
  if (!(weights[t] >= 0)) fail("metrics: weight at sample index ", t, " is ", weights[t], ", expected >= 0");
  return weights[t] > 0;
}

struct Scored {
  Eigen::ArrayXd y;
  Eigen::ArrayXd error;
};

Scored select_scored(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  Scored scored{Eigen::ArrayXd(y.size() - warmup), Eigen::ArrayXd(y.size() - warmup)};
  Eigen::Index count = 0;
  for (Eigen::Index t = warmup; t < y.size(); ++t) {
    if (!is_scored(weights, t)) continue;
    if (!std::isfinite(y[t])) fail("metrics: non-finite measured output at sample index ", t, ": ", y[t]);
    scored.y[count] = y[t];
    scored.error[count++] = y[t] - yhat[t];
  }
  if (count == 0) fail("metrics: no sample to score: all ", y.size() - warmup, " after the warm-up are missing");
  scored.y.conservativeResize(count);
  scored.error.conservativeResize(count);
  return scored;
}

double variance(const Eigen::ArrayXd& x) { return (x - x.mean()).square().mean(); }

double ratio(double numerator, double denominator) {
  return denominator > 0 ? numerator / denominator : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Metrics evaluate_metrics(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  check_arguments(y, yhat, warmup, weights);
  const Scored scored = select_scored(y, yhat, warmup, weights);
  // The mean of equal samples may differ from them by rounding, so constancy is tested on the
  // samples themselves.
  const double y_variance = (scored.y == scored.y[0]).all() ? 0.0 : variance(scored.y);
  const double mean_square = scored.error.square().mean();

  Metrics metrics;
  metrics.rmse = std::sqrt(mean_square);
  metrics.nrmse = ratio(metrics.rmse, std::sqrt(y_variance));
  metrics.fit_percent = 100.0 * (1.0 - metrics.nrmse);
  metrics.r2 = 1.0 - ratio(mean_square, y_variance);
  metrics.vaf = 100.0 * (1.0 - ratio(variance(scored.error), y_variance));
  metrics.mae = scored.error.abs().mean();
  metrics.samples = scored.y.size();
  metrics.warmup = warmup;
  return metrics;
}

double rmse(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  return evaluate_metrics(y, yhat, warmup, weights).rmse;
}

double nrmse(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  return evaluate_metrics(y, yhat, warmup, weights).nrmse;
}

double fit_percent(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  return evaluate_metrics(y, yhat, warmup, weights).fit_percent;
}

double r2(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  return evaluate_metrics(y, yhat, warmup, weights).r2;
}

double vaf(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  return evaluate_metrics(y, yhat, warmup, weights).vaf;
}

double mae(const Signal& y, const Signal& yhat, Eigen::Index warmup, const Eigen::VectorXd& weights) {
  return evaluate_metrics(y, yhat, warmup, weights).mae;
}

}  // namespace blockid
