// The number that bounds nothing.
#pragma once

#include <limits>

namespace blockid::detail {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace blockid::detail
