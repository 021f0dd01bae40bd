// How far the expansions go whose coefficients are set free or shared out.
#pragma once

#include <blockid/init/fractional_chain.hpp>

#include <vector>

namespace blockid::detail {

/// What the slowest pole has died to 1 % after, at most 60. Half a zero dies faster than a pole of its radius.
inline Index short_expansion_length(const std::vector<RootGroup>& poles) {
  constexpr double kTolerance = 0.01;
  constexpr Index kMostCoefficients = 60;
  return expansion_length(poles, {}, kTolerance, kMostCoefficients);
}

}  // namespace blockid::detail
