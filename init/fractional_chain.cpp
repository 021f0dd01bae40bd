#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/init/fractional_chain.hpp>

#include <algorithm>
#include <cmath>

namespace blockid {
namespace {

FractionalRoots finite_roots(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros) {
  FractionalRoots roots;
  for (const RootGroup& group : poles) roots.poles.push_back(group.value);
  for (const RootGroup& group : zeros) {
    if (group.kind != RootGroup::Kind::infinite) roots.zeros.push_back(group.value);
  }
  return roots;
}

/// Radius of the root that stands for a zero in the expansion.
double expanded_radius(double radius) {
  return std::min(radius > 1.0 / kLargestZeroRadius ? 1.0 / radius : radius, kLargestZeroRadius);
}

/// The inner parameters are [exponents, free W, theta_f, exponents, free H].
std::vector<Tie> ties_of(Index exponents, Index free, Index static_count) {
  std::vector<Tie> ties;
  for (Index k = 0; k < exponents + free; ++k) ties.push_back({k});
  for (Index k = 0; k < static_count; ++k) ties.push_back({exponents + 2 * free + k});
  for (Index k = 0; k < exponents; ++k) ties.push_back({k, -1.0, 1.0});
  for (Index k = 0; k < free; ++k) ties.push_back({exponents + free + k});
  return ties;
}

}  // namespace

Tied fractional_chain(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros, const AnyBlock& f,
                      const FractionalChainOptions& options) {
  const FractionalRoots roots = finite_roots(poles, zeros);
  const Index infinite = std::ssize(zeros) - std::ssize(roots.zeros);
  const Index n = options.n > 0 ? options.n : expansion_length(poles, zeros);
  const Index n1 = options.n1 >= 0 ? options.n1 : n;
  const FractionalFilter first(roots, n, n1, options.nk + infinite);
  const FractionalFilter second(roots, n, n1);
  return {Series({{"W", first}, {"f", f}, {"H", second}}),
          ties_of(first.exponent_count(), n - n1, f.parameter_count())};
}

Index expansion_length(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros, double tolerance,
                       Index longest) {
  double radius = 0.0;
  for (const RootGroup& group : poles) radius = std::max(radius, std::abs(group.value));
  for (const RootGroup& group : zeros) {
    if (group.kind != RootGroup::Kind::infinite) radius = std::max(radius, expanded_radius(std::abs(group.value)));
  }
  if (radius >= 1.0) return longest;
  const double length = radius > 0.0 ? std::ceil(std::log(tolerance) / std::log(radius)) : 1.0;
  return static_cast<Index>(std::clamp(length, 1.0, static_cast<double>(longest)));
}

}  // namespace blockid
