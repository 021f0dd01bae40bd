#include <blockid/blocks/detail/children.hpp>

#include <blockid/data/error.hpp>

#include <set>

namespace blockid::detail {

ChildOffsets child_offsets(const std::vector<LabelledBlock>& children, const char* what) {
  if (children.empty()) fail(what, ": expected at least one block, got none");
  ChildOffsets offsets{{0}, {0}};
  // A block without a label bears its kind and place, which another's label may happen to be.
  std::set<std::string> labels;
  for (std::size_t k = 0; k < children.size(); ++k) {
    const LabelledBlock& child = children[k];
    if (const std::string name = child_name(children, k); !labels.insert(name).second) {
      fail(what, ": the label '", name, "' comes twice; labels within one row or sum must differ");
    }
    offsets.parameters.push_back(offsets.parameters.back() + child.block.parameter_count());
    offsets.states.push_back(offsets.states.back() + child.block.state_count());
  }
  return offsets;
}

std::string child_name(const std::vector<LabelledBlock>& children, std::size_t k) {
  const LabelledBlock& child = children[k];
  return child.label.empty() ? child.block.kind() + std::to_string(k + 1) : child.label;
}

std::vector<std::string> joined_parameter_names(const std::vector<LabelledBlock>& children) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < children.size(); ++k) {
    const std::string prefix = child_name(children, k) + ".";
    for (const std::string& name : children[k].block.parameter_names()) names.push_back(prefix + name);
  }
  return names;
}

Eigen::VectorXd joined_initial_parameters(const std::vector<LabelledBlock>& children) {
  std::vector<double> all;
  for (const LabelledBlock& child : children) {
    const Eigen::VectorXd theta = child.block.initial_parameters();
    all.insert(all.end(), theta.begin(), theta.end());
  }
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Index>(all.size()));
}

ParameterBounds joined_bounds(const std::vector<LabelledBlock>& children) {
  std::vector<double> lower;
  std::vector<double> upper;
  for (const LabelledBlock& child : children) {
    const ParameterBounds bounds = child.block.bounds();
    lower.insert(lower.end(), bounds.lower.begin(), bounds.lower.end());
    upper.insert(upper.end(), bounds.upper.begin(), bounds.upper.end());
  }
  return {Eigen::Map<const Eigen::VectorXd>(lower.data(), static_cast<Index>(lower.size())),
          Eigen::Map<const Eigen::VectorXd>(upper.data(), static_cast<Index>(upper.size()))};
}

std::vector<Index> joined_column_order(const std::vector<LabelledBlock>& children, OwnColumns own) {
  const ChildOffsets offsets = child_offsets(children, "chain");
  const Index all_parameters = offsets.parameters.back();
  std::vector<Index> order;
  for (std::size_t k = 0; k < children.size(); ++k) {
    const Index count = children[k].block.parameter_count();
    for (const Index column : children[k].block.column_order(own)) {
      order.push_back(column < count ? offsets.parameters[k] + column
                                     : all_parameters + offsets.states[k] + (column - count));
    }
  }
  return order;
}

}  // namespace blockid::detail
