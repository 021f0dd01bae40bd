// Between a model and the unknowns of a predictor.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/predictor.hpp>

#include <Eigen/Core>
#include <vector>

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

/// Likewise with a state for each record. Throws Error for states that do not fit the data.
inline Eigen::VectorXd unknowns_of(const Model& model, const Predictor& predictor,
                                   const std::vector<Eigen::VectorXd>& initial_states) {
  Eigen::VectorXd p = unknowns_of(model, predictor);
  if (initial_states.empty()) return p;
  const Index states = model.chain.state_count();
  Index first = model.parameters.size();
  for (const Eigen::VectorXd& state : initial_states) {
    if (state.size() != states || first + states > p.size()) break;
    p.segment(first, states) = state;
    first += states;
  }
  if (first != p.size() || std::ssize(initial_states) != std::ssize(predictor.data().records)) {
    fail("initial states: expected ", p.size() - model.parameters.size(), " numbers, ", states, " for each of ",
         predictor.data().records.size(), " records, got ", initial_states.size(), " states");
  }
  return p;
}

}  // namespace blockid::detail
