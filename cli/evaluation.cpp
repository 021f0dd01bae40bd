#include <blockid/cli/evaluation.hpp>

#include <blockid/estimators/refit.hpp>

#include <algorithm>
#include <utility>

namespace blockid::cli {
namespace {

Metrics total_metrics(const std::vector<ScoredRecord>& records, Index warmup) {
  if (records.size() == 1) return records.front().metrics;
  Index samples = 0;
  for (const ScoredRecord& scored : records) samples += scored.yhat.size();
  Eigen::VectorXd y(samples);
  Eigen::VectorXd yhat(samples);
  Eigen::VectorXd weights(samples);
  Index begin = 0;
  for (const ScoredRecord& scored : records) {
    const Index length = scored.yhat.size();
    y.segment(begin, length) = scored.record.y;
    yhat.segment(begin, length) = scored.yhat;
    weights.segment(begin, length) = scored_mask(scored);
    begin += length;
  }
  Metrics total = evaluate_metrics(y, yhat, 0, weights);
  total.warmup = warmup;
  return total;
}

}  // namespace

Eigen::VectorXd scored_mask(const ScoredRecord& scored) {
  Eigen::VectorXd mask(scored.yhat.size());
  for (Index t = 0; t < mask.size(); ++t) {
    mask[t] = t >= scored.metrics.warmup && !is_missing(scored.record, t) ? 1.0 : 0.0;
  }
  return mask;
}

Eigen::VectorXd scored_residual(const ScoredRecord& scored) {
  const Eigen::VectorXd mask = scored_mask(scored);
  return (mask.array() > 0.0).select(scored.record.y - scored.yhat, 0.0);
}

Evaluation evaluate(const Model& model, const DataSet& data, const PredictionOptions& options,
                    const std::vector<Eigen::VectorXd>& states) {
  Evaluation result;
  for (std::size_t k = 0; k < data.records.size(); ++k) {
    ScoredRecord scored{.record = data.records[k], .yhat = {}, .model = model, .metrics = {}};
    if (k < states.size()) {
      scored.model.initial_state = states[k];
    } else {
      scored.model = placed_on(model, scored.record, options);
    }
    scored.yhat = predict(scored.model, scored.record, options);
    scored.metrics = evaluate_metrics(scored.record.y, scored.yhat, options.warmup, scored.record.weights);
    result.records.push_back(std::move(scored));
  }
  result.total = total_metrics(result.records, options.warmup);
  return result;
}

}  // namespace blockid::cli
