// What Series and Parallel share: numbers of children one after the other.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <span>
#include <string>
#include <vector>

namespace blockid::detail {

/// Offsets of each child's parameters and states, with the totals at the end: (children + 1,) each.
struct ChildOffsets {
  std::vector<Index> parameters;
  std::vector<Index> states;
};

/// Throws Error when there is no child or a label comes twice; `what` names the container in the message.
ChildOffsets child_offsets(const std::vector<LabelledBlock>& children, const char* what);

/// The child's label, or its kind and place ("rational2") when it has none.
std::string child_name(const std::vector<LabelledBlock>& children, std::size_t k);

std::vector<std::string> joined_parameter_names(const std::vector<LabelledBlock>& children);
Eigen::VectorXd joined_initial_parameters(const std::vector<LabelledBlock>& children);
ParameterBounds joined_bounds(const std::vector<LabelledBlock>& children);
std::vector<Index> joined_column_order(const std::vector<LabelledBlock>& children, OwnColumns own);

template <class T>
std::span<T> part(std::span<T> all, Index offset, Index count) {
  return all.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(count));
}

}  // namespace blockid::detail
