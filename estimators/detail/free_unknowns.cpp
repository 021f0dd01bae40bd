#include <blockid/estimators/detail/free_unknowns.hpp>

#include <blockid/estimators/gauges.hpp>

#include <algorithm>
#include <iterator>

namespace blockid::detail {

FixedParameters fixed_parameters(const Model& model, const std::vector<std::string>& frozen_names, bool hold_gauges) {
  FixedParameters fixed;
  for (const std::string& name : frozen_names) fixed.frozen.push_back(parameter_index(model, name));
  std::sort(fixed.frozen.begin(), fixed.frozen.end());
  fixed.frozen.erase(std::unique(fixed.frozen.begin(), fixed.frozen.end()), fixed.frozen.end());
  if (hold_gauges) fixed.gauges = gain_gauges(model.chain, model.parameters, fixed.frozen);
  std::set_union(fixed.frozen.begin(), fixed.frozen.end(), fixed.gauges.begin(), fixed.gauges.end(),
                 std::back_inserter(fixed.all));
  return fixed;
}

std::vector<std::string> names_of(const Model& model, const std::vector<Index>& parameters) {
  const std::vector<std::string> all = model.chain.parameter_names();
  std::vector<std::string> names;
  for (const Index k : parameters) names.push_back(all[static_cast<std::size_t>(k)]);
  return names;
}

}  // namespace blockid::detail
