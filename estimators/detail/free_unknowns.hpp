// Which of the unknowns a refit may change.
#pragma once

#include <blockid/blocks/model.hpp>

#include <string>
#include <vector>

namespace blockid::detail {

/// Indices into theta, ascending.
struct FixedParameters {
  std::vector<Index> frozen;
  std::vector<Index> gauges;
  /// Both together.
  std::vector<Index> all;
};

/// Throws Error for a name that the model does not have.
FixedParameters fixed_parameters(const Model& model, const std::vector<std::string>& frozen_names, bool hold_gauges);

/// Names of the listed parameters.
std::vector<std::string> names_of(const Model& model, const std::vector<Index>& parameters);

}  // namespace blockid::detail
