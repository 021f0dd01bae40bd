#include <blockid/blocks/detail/signal_range.hpp>

#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>

namespace blockid::detail {

void check_range(SignalRange range, const char* block) {
  if (!std::isfinite(range.lower) || !std::isfinite(range.upper) || !(range.lower < range.upper)) {
    fail(block, ": range must be two finite numbers with lower < upper, got [", range.lower, ", ", range.upper, "]");
  }
}

SignalRange range_of(std::span<const double> v, const char* block) {
  if (v.empty()) fail(block, ": cannot be placed for an empty signal");
  for (std::size_t t = 0; t < v.size(); ++t) {
    if (!std::isfinite(v[t])) fail(block, ": its input is not finite at sample ", t);
  }
  const auto [low, high] = std::minmax_element(v.begin(), v.end());
  if (!(*low < *high)) fail(block, ": its input is constant (", *low, "), a range needs two different values");
  return {*low, *high};
}

}  // namespace blockid::detail
