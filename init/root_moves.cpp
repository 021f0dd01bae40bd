#include <blockid/init/root_moves.hpp>

#include <cmath>
#include <utility>

namespace blockid {
namespace {

/// Distance of a pole and a zero from which they are of use.
constexpr double kCancelled = 0.1;
/// Where a cancelled couple goes; the pole a little further out than the zero, so that it is not cancelled there.
constexpr double kFreshRadius = 0.6;
constexpr double kFreshDistance = 0.1;
/// Imaginary part of a pair that goes there.
constexpr double kFreshHeight = 0.3;
/// Roots this near to the circle, or to zero, are as good as their reflections, or have none.
constexpr double kReflectable = 1e-3;

using Groups = std::vector<RootGroup>;

/// Positions of one group, or of two real ones.
using Places = std::vector<std::size_t>;

/// All choices of `degree` degrees as one group, or as two real ones.
std::vector<Places> choices(const Groups& groups, Index degree) {
  std::vector<Places> found;
  for (std::size_t k = 0; k < groups.size(); ++k) {
    if (groups[k].degree() == degree) found.push_back({k});
    for (std::size_t j = 0; degree == 2 && j < k; ++j) {
      if (groups[k].degree() == 1 && groups[j].degree() == 1) found.push_back({j, k});
    }
  }
  return found;
}

Groups picked(const Groups& groups, const Places& places) {
  Groups result;
  for (const std::size_t k : places) result.push_back(groups[k]);
  return result;
}

/// `groups` with those at `places` replaced.
Groups replaced(Groups groups, const Places& places, const Groups& by) {
  // From the last on: the places before it stay what they are.
  for (std::size_t i = places.size(); i-- > 0;) groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(places[i]));
  groups.insert(groups.end(), by.begin(), by.end());
  return groups;
}

void append_exchanges(const PlacedRoots& placed, Groups FilterRoots::*kind, const std::string& name,
                      std::vector<PlacedRoots>& found) {
  const Groups& first = placed.first.*kind;
  const Groups& second = placed.second.*kind;
  for (const Index degree : {1, 2}) {
    for (const Places& of_first : choices(first, degree)) {
      for (const Places& of_second : choices(second, degree)) {
        // Two real roots against two are two exchanges.
        if (of_first.size() == 2 && of_second.size() == 2) continue;
        PlacedRoots moved = placed;
        moved.first.*kind = replaced(first, of_first, picked(second, of_second));
        moved.second.*kind = replaced(second, of_second, picked(first, of_first));
        moved.how =
            "exchanged " + name + " " + to_text(picked(first, of_first)) + " and " + to_text(picked(second, of_second));
        found.push_back(std::move(moved));
      }
    }
  }
}

void append_reflections(const PlacedRoots& placed, FilterRoots PlacedRoots::*filter, std::vector<PlacedRoots>& found) {
  const Groups& zeros = (placed.*filter).zeros;
  for (std::size_t k = 0; k < zeros.size(); ++k) {
    const double radius = std::abs(zeros[k].value);
    if (zeros[k].kind == RootGroup::Kind::infinite || radius < kReflectable) continue;
    if (std::abs(radius - 1.0) < kReflectable) continue;
    PlacedRoots moved = placed;
    (moved.*filter).zeros[k].value /= radius * radius;
    moved.how = "reflected zero " + to_text(zeros[k]);
    found.push_back(std::move(moved));
  }
}

void append_relocations(const PlacedRoots& placed, FilterRoots PlacedRoots::*filter, std::vector<PlacedRoots>& found) {
  const FilterRoots& roots = placed.*filter;
  for (std::size_t k = 0; k < roots.poles.size(); ++k) {
    for (std::size_t j = 0; j < roots.zeros.size(); ++j) {
      const RootGroup& pole = roots.poles[k];
      const RootGroup& zero = roots.zeros[j];
      if (pole.kind != zero.kind || pole.kind == RootGroup::Kind::infinite) continue;
      if (std::abs(pole.value - zero.value) > kCancelled) continue;
      for (const double side : {1.0, -1.0}) {
        const double height = pole.kind == RootGroup::Kind::pair ? kFreshHeight : 0.0;
        PlacedRoots moved = placed;
        (moved.*filter).poles[k].value = {side * kFreshRadius, height};
        (moved.*filter).zeros[j].value = {side * (kFreshRadius - kFreshDistance), height};
        moved.how = "relocated pole " + to_text(pole) + " and zero " + to_text(zero);
        found.push_back(std::move(moved));
      }
    }
  }
}

}  // namespace

FilterRoots roots_of(const Eigen::VectorXd& theta, Index nb) {
  Eigen::VectorXd a = Eigen::VectorXd::Ones(theta.size() - nb);
  a.tail(a.size() - 1) = theta.tail(a.size() - 1);
  return {root_groups(theta.head(nb + 1)), root_groups(a, 0.0)};
}

std::vector<PlacedRoots> neighbours(const PlacedRoots& placed) {
  std::vector<PlacedRoots> found;
  append_exchanges(placed, &FilterRoots::zeros, "zeros", found);
  append_exchanges(placed, &FilterRoots::poles, "poles", found);
  for (const auto filter : {&PlacedRoots::first, &PlacedRoots::second}) {
    append_reflections(placed, filter, found);
    append_relocations(placed, filter, found);
  }
  return found;
}

}  // namespace blockid
