// Neighbours of a Wiener-Hammerstein model: its roots, a few of them elsewhere.
#pragma once

#include <blockid/init/root_groups.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid {

/// Zeros and poles of one filter.
struct FilterRoots {
  std::vector<RootGroup> zeros;
  std::vector<RootGroup> poles;
};

/// Where all roots of G_W and G_H are, and how they came there.
struct PlacedRoots {
  FilterRoots first;
  FilterRoots second;
  std::string how = {};
};

/// Roots of theta = [b, a] of a rational filter with numerator degree nb.
FilterRoots roots_of(const Eigen::VectorXd& theta, Index nb);

/// Models whose roots differ from `placed` by one move that keeps the degrees of all four polynomials:
///
///   exchange    a zero (pole) of G_W against one of G_H, pairs against pairs or two real roots
///   reflection  a zero through the unit circle, z -> 1 / conj(z), which leaves |G| as it is
///   relocation  a pole and a zero of one filter that nearly cancel, both to 0.6 or both to -0.6
///
/// Exchanges mend roots on the wrong side of f, reflections zeros on the wrong side of the circle: LM crosses neither.
/// A cancelled couple has nothing left to pull it to where it is needed.
std::vector<PlacedRoots> neighbours(const PlacedRoots& placed);

}  // namespace blockid
