#include <blockid/init/exponent_starts.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

namespace blockid {
namespace {

/// Largest radius of a pole that is expanded.
constexpr double kLargestPoleRadius = 0.9999;
/// Near-corner exponents.
constexpr double kLow = 0.1;
constexpr double kHigh = 0.9;

std::complex<double> inside(std::complex<double> pole) {
  if (std::abs(pole) > 1.0) pole = 1.0 / std::conj(pole);
  const double radius = std::abs(pole);
  return radius > kLargestPoleRadius ? pole * (kLargestPoleRadius / radius) : pole;
}

bool is_outside(std::complex<double> zero) { return std::abs(zero) > 1.0 / kLargestZeroRadius; }

std::string text_of(const ExpandableRoots& roots, const Eigen::VectorXd& exponents) {
  std::string text;
  for (Index k = 0; k < exponents.size(); ++k) {
    if (k == std::ssize(roots.finite.poles)) text += " |";
    char number[16];
    std::snprintf(number, sizeof number, "%s%g", k > 0 ? " " : "", exponents[k]);
    text += number;
  }
  return text;
}

}  // namespace

ExpandableRoots expandable_roots(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros) {
  ExpandableRoots roots;
  for (const RootGroup& group : poles) roots.finite.poles.push_back(inside(group.value));
  for (const RootGroup& group : zeros) {
    if (group.kind == RootGroup::Kind::infinite) {
      ++roots.infinite;
    } else {
      roots.finite.zeros.push_back(group.value);
    }
  }
  for (auto* list : {&roots.finite.poles, &roots.finite.zeros}) {
    for (std::complex<double>& root : *list) root = {root.real(), std::abs(root.imag())};
  }
  return roots;
}

std::vector<ExponentStart> exponent_starts(const ExpandableRoots& roots, int count, std::uint64_t seed) {
  const auto poles = static_cast<Index>(roots.finite.poles.size());
  const auto zeros = static_cast<Index>(roots.finite.zeros.size());
  std::mt19937_64 engine(seed);
  const auto coin = [&engine] { return (engine() >> 63U) != 0; };
  // Without roots that belong to one filter as a whole the second start would be the first again.
  const bool two_sides =
      roots.infinite > 0 || std::any_of(roots.finite.zeros.begin(), roots.finite.zeros.end(), is_outside);
  const int uniform = two_sides ? 2 : 1;
  std::vector<ExponentStart> starts;
  for (int k = 0; k < count; ++k) {
    ExponentStart start{Eigen::VectorXd::Constant(poles + zeros, 0.5), k != 1 || !two_sides, ""};
    for (Index i = 0; k >= uniform && i < poles + zeros; ++i) start.exponents[i] = coin() ? kHigh : kLow;
    if (k >= uniform) start.delay_first = coin();
    for (Index j = 0; j < zeros; ++j) {
      if (!is_outside(roots.finite.zeros[static_cast<std::size_t>(j)])) continue;
      double& beta = start.exponents[poles + j];
      beta = k >= uniform ? std::round(beta) : (k == 0 ? 1.0 : 0.0);
    }
    start.text = text_of(roots, start.exponents);
    starts.push_back(std::move(start));
  }
  return starts;
}

}  // namespace blockid
