// Where searches over fractional exponents begin.
#pragma once

#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/init/root_groups.hpp>

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace blockid {

/// Roots of a best linear approximation as a fractional filter can take them.
struct ExpandableRoots {
  /// Poles outside the circle are reflected into it.
  FractionalRoots finite;
  /// Zeros that left through infinity: samples of delay.
  Index infinite = 0;
};

ExpandableRoots expandable_roots(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros);

struct ExponentStart {
  /// (poles + zeros,) alpha, then beta; G_W has these, G_H one minus these.
  Eigen::VectorXd exponents;
  /// Whether the delay by infinite zeros belongs to G_W.
  bool delay_first = true;
  /// "1/2" or "0.9 0.1 | 0.1", poles before the bar.
  std::string text;
};

/// The first start has 1/2 everywhere, but zeros outside the circle, whose halves cannot be expanded, with G_W; the
/// second has those (and delays) with G_H, where there are any. All further starts are drawn near the corners: 0.1 or
/// 0.9, outside zeros 0 or 1.
std::vector<ExponentStart> exponent_starts(const ExpandableRoots& roots, int count, std::uint64_t seed);

}  // namespace blockid
