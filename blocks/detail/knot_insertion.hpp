// Knots put between others.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

namespace blockid::detail {

/// Puts a knot into the increasing list unless a neighbour is nearer than `spacing` or it lies outside.
inline void insert_apart(std::vector<double>& knots, double knot, double spacing) {
  const auto right = std::lower_bound(knots.begin(), knots.end(), knot);
  if (right == knots.begin() || right == knots.end()) return;
  if (*right - knot < spacing || knot - *(right - 1) < spacing) return;
  knots.insert(right, knot);
}

/// Puts a knot into the middle of the widest interval of at least two knots.
inline void halve_widest(std::vector<double>& knots) {
  std::size_t widest = 1;
  for (std::size_t k = 2; k < knots.size(); ++k) {
    if (knots[k] - knots[k - 1] > knots[widest] - knots[widest - 1]) widest = k;
  }
  const double middle = 0.5 * knots[widest - 1] + 0.5 * knots[widest];
  knots.insert(knots.begin() + static_cast<Eigen::Index>(widest), middle);
}

}  // namespace blockid::detail
