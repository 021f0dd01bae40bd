#include "blockid/data/transforms.hpp"

#include <cmath>

#include "blockid/data/error.hpp"

namespace blockid {
namespace {

Eigen::VectorXd squared_weights(const Record& record) {
  if (record.weights.size() == 0) return Eigen::VectorXd::Ones(record.u.size());
  return record.weights.array().square();
}

/// A NaN at weight 0 must not reach the sums, where 0 * NaN is NaN.
Eigen::VectorXd present_or_zero(const Eigen::VectorXd& x, const Eigen::VectorXd& w2) {
  return (w2.array() > 0).select(x, 0.0);
}

double weighted_mean(const Eigen::VectorXd& x, const Eigen::VectorXd& w2) { return w2.dot(x) / w2.sum(); }

SignalTransform fit_trend(const Eigen::VectorXd& signal, const Eigen::VectorXd& w2, int order) {
  const Eigen::VectorXd x = present_or_zero(signal, w2);
  const double mean = weighted_mean(x, w2);
  if (order == 0) return {{mean, 1.0}, 0.0};
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(x.size(), 0.0, static_cast<double>(x.size() - 1));
  const double mid = weighted_mean(t, w2);
  const Eigen::ArrayXd centred = t.array() - mid;
  const double slope = (w2.array() * centred * (x.array() - mean)).sum() / (w2.array() * centred.square()).sum();
  return {{mean - slope * mid, 1.0}, slope};
}

SignalTransform fit_scale(const Eigen::VectorXd& signal, const Eigen::VectorXd& w2, const Record& record,
                          const std::string& signal_name) {
  const Eigen::VectorXd x = present_or_zero(signal, w2);
  const double mean = weighted_mean(x, w2);
  const double variance = (w2.array() * (x.array() - mean).square()).sum() / w2.sum();
  const double rounding = 1e-15 * std::abs(mean);
  if (!(std::sqrt(variance) > rounding)) {
    fail(describe(record), ": constant signal '", signal_name, "' (", mean, ") cannot be scaled to unit variance");
  }
  return {{mean, std::sqrt(variance)}, 0.0};
}

Standardised apply(const Record& record, const SignalTransform& u, const SignalTransform& y) {
  Standardised result{record, u, y};
  result.record.u = u.forward(record.u);
  result.record.y = y.forward(record.y);
  return result;
}

void require_present(const Record& record, Eigen::Index needed) {
  if (present_count(record) < needed) {
    fail(describe(record), ": ", present_count(record), " present samples, expected at least ", needed);
  }
}

}  // namespace

Eigen::VectorXd SignalTransform::forward(const Eigen::VectorXd& x) const {
  Eigen::VectorXd z(x.size());
  for (Eigen::Index t = 0; t < x.size(); ++t) z[t] = affine.forward(x[t] - slope_per_sample * static_cast<double>(t));
  return z;
}

Eigen::VectorXd SignalTransform::inverse(const Eigen::VectorXd& z) const {
  Eigen::VectorXd x(z.size());
  for (Eigen::Index t = 0; t < z.size(); ++t) x[t] = affine.inverse(z[t]) + slope_per_sample * static_cast<double>(t);
  return x;
}

Standardised detrend(const Record& record, int order) {
  check(record);
  if (order != 0 && order != 1) fail(describe(record), ": detrend order is ", order, ", expected 0 (mean) or 1 (line)");
  require_present(record, order + 1);
  const Eigen::VectorXd w2 = squared_weights(record);
  return apply(record, fit_trend(record.u, w2, order), fit_trend(record.y, w2, order));
}

Standardised standardise(const Record& record) {
  check(record);
  require_present(record, 1);
  const Eigen::VectorXd w2 = squared_weights(record);
  return apply(record, fit_scale(record.u, w2, record, record.input_name),
               fit_scale(record.y, w2, record, record.output_name));
}

Record undo(const Standardised& standardised) {
  Record record = standardised.record;
  record.u = standardised.u.inverse(record.u);
  record.y = standardised.y.inverse(record.y);
  return record;
}

}  // namespace blockid
