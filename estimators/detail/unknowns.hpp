// Between a model and the unknowns of a predictor.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/estimators/predictor.hpp>

#include <Eigen/Core>

namespace blockid::detail {

/// p = [theta, x0, x0, ...]: each record starts from the model's initial state when states are estimated.
inline Eigen::VectorXd unknowns_of(const Model& model, const Predictor& predictor) {
  Eigen::VectorXd p = Eigen::VectorXd::Zero(predictor.unknown_count());
  p.head(model.parameters.size()) = model.parameters;
  const Index states = model.chain.state_count();
  if (model.initial_state.size() == states) {
    for (Index first = model.parameters.size(); first < p.size(); first += states) {
      p.segment(first, states) = model.initial_state;
    }
  }
  return p;
}

}  // namespace blockid::detail
