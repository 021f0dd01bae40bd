// What counts as a pole inside the unit circle.
#pragma once

namespace blockid::detail {

/// A double root at one comes out of the eigenvalues with an error of the root of the rounding unit.
inline constexpr double kStableRadius = 1.0 - 1e-7;

}  // namespace blockid::detail
