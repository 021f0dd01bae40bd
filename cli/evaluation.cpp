#include <blockid/cli/evaluation.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/refit.hpp>

#include <algorithm>
#include <utility>

namespace blockid::cli {
namespace {

Metrics total_metrics(const std::vector<ScoredRecord>& records, Index warmup) {
  if (records.size() == 1) return records.front().metrics;
  DataSet data;
  std::vector<Eigen::VectorXd> yhat;
  for (const ScoredRecord& scored : records) {
    data.records.push_back(scored.record);
    yhat.push_back(scored.yhat);
  }
  return metrics_together(data, yhat, warmup);
}

}  // namespace

Metrics metrics_together(const DataSet& data, const std::vector<Eigen::VectorXd>& yhat, Index warmup) {
  const Index samples = total_samples(data);
  Eigen::VectorXd y(samples);
  Eigen::VectorXd of_model(samples);
  Eigen::VectorXd weights(samples);
  Index begin = 0;
  for (std::size_t i = 0; i < data.records.size(); ++i) {
    const Record& record = data.records[i];
    const Index length = record.u.size();
    if (warmup >= length) fail(describe(record), ": has ", length, " samples, no more than the warm-up of ", warmup);
    y.segment(begin, length) = record.y;
    of_model.segment(begin, length) = yhat[i];
    for (Index t = 0; t < length; ++t) weights[begin + t] = t < warmup ? 0.0 : weight(record, t);
    begin += length;
  }
  Metrics total = evaluate_metrics(y, of_model, 0, weights);
  total.warmup = warmup;
  return total;
}

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

Evaluation evaluate(const Model& model, const DataSet& data, Index warmup,
                    const std::function<Eigen::VectorXd(const Record&)>& simulation) {
  Evaluation result;
  for (const Record& record : data.records) {
    ScoredRecord scored{.record = record, .yhat = simulation(record), .model = model, .metrics = {}};
    scored.metrics = evaluate_metrics(record.y, scored.yhat, warmup, record.weights);
    result.records.push_back(std::move(scored));
  }
  result.total = total_metrics(result.records, warmup);
  return result;
}

}  // namespace blockid::cli
