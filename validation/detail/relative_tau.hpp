// The regularisation tau of lower bounds of an uncertainty, relative to |T_v|.
#pragma once

#include <blockid/data/error.hpp>

namespace blockid::detail {

/// tau / |T_v| below which the rounding of w counts.
inline constexpr double kSmallestTau = 1e-10;

/// Throws Error for less.
inline void check_relative_tau(double relative_tau) {
  if (!(relative_tau >= kSmallestTau)) {
    fail("uncertainty bound: expected a relative tau of at least ", kSmallestTau, ", got ", relative_tau);
  }
}

}  // namespace blockid::detail
