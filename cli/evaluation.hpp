// A model against records: predictions and figures of merit.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/data/metrics.hpp>
#include <blockid/estimators/predictor.hpp>

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace blockid::cli {

/// One record with the model's simulation of it.
struct ScoredRecord {
  Record record;
  /// (N,)
  Eigen::VectorXd yhat;
  /// The model with the state from which this record was simulated.
  Model model;
  Metrics metrics;
};

struct Evaluation {
  std::vector<ScoredRecord> records;
  /// Over all records together.
  Metrics total;
};

/// Simulates and scores each record. `states`: initial state of each record when states are estimated; empty: fitted
/// here.
Evaluation evaluate(const Model& model, const DataSet& data, const PredictionOptions& options,
                    const std::vector<Eigen::VectorXd>& states = {});

/// Figures of merit over all records together, yhat (N_i,) of each, the first `warmup` samples of each left out.
/// Throws Error for records no longer than the warm-up.
Metrics metrics_together(const DataSet& data, const std::vector<Eigen::VectorXd>& yhat, Index warmup);

/// Scores simulations of another kind, (N,) each; the records carry `model` as it is.
Evaluation evaluate(const Model& model, const DataSet& data, Index warmup,
                    const std::function<Eigen::VectorXd(const Record&)>& simulation);

/// y - yhat where the record is scored, 0 in the warm-up and where samples are missing; (N,).
Eigen::VectorXd scored_residual(const ScoredRecord& scored);

/// 1 where the record is scored, 0 elsewhere; (N,).
Eigen::VectorXd scored_mask(const ScoredRecord& scored);

}  // namespace blockid::cli
