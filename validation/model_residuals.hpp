// What a model leaves of records, with what errors of its parameters add.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/predictor.hpp>
#include <blockid/validation/residual_tests.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// What is known of a model's parameters.
struct ParameterKnowledge {
  std::vector<Eigen::Index> held = {};               ///< places that were not estimated, ascending
  std::vector<Eigen::VectorXd> initial_states = {};  ///< (n_x,) of each record, when they were estimated
};

/// Records that the model was fitted to: theta and estimated initial states are unknowns fitted here.
/// Throws Error as Predictor does, and when the prediction is not finite.
std::vector<ResidualRecord> training_residuals(const Model& model, const DataSet& data,
                                               const PredictionOptions& prediction = {},
                                               const ParameterKnowledge& knowledge = {});

/// Other records: theta comes from elsewhere; initial states, when they are estimated, are fitted here.
std::vector<ResidualRecord> test_residuals(const Model& model, const DataSet& data,
                                           const PredictionOptions& prediction = {},
                                           const ParameterKnowledge& knowledge = {});

}  // namespace blockid
