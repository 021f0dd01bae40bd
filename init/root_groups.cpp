#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/companion_roots.hpp>
#include <blockid/init/root_groups.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace blockid {
namespace {

/// Relative imaginary part below which a root counts as real.
constexpr double kRealTolerance = 1e-10;
/// Distance from the circle that a reflected root keeps.
constexpr double kCircleMargin = 1e-3;

Eigen::VectorXd convolve(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(a.size() + b.size() - 1);
  for (Index i = 0; i < a.size(); ++i) c.segment(i, b.size()) += a[i] * b;
  return c;
}

std::string short_number(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", value);
  return buffer;
}

}  // namespace

Eigen::VectorXd RootGroup::polynomial() const {
  Eigen::VectorXd p;
  switch (kind) {
    case Kind::infinite:
      p = Eigen::Vector2d(0.0, 1.0);
      break;
    case Kind::real:
      p = Eigen::Vector2d(1.0, -value.real());
      break;
    case Kind::pair:
      p = Eigen::Vector3d(1.0, -2.0 * value.real(), std::norm(value));
      break;
  }
  return p / p.cwiseAbs().maxCoeff();
}

std::vector<RootGroup> root_groups(const Eigen::VectorXd& polynomial, double tolerance) {
  const double largest = polynomial.size() > 0 ? polynomial.cwiseAbs().maxCoeff() : 0.0;
  if (!(largest > 0.0)) fail("roots: the polynomial is zero");
  std::vector<RootGroup> groups;
  Index first = 0;
  while (std::abs(polynomial[first]) <= tolerance * largest) {
    groups.push_back({RootGroup::Kind::infinite, 0.0});
    ++first;
  }
  const Index degree = polynomial.size() - 1 - first;
  if (degree == 0) return groups;
  const Eigen::VectorXcd z = detail::companion_roots(polynomial.tail(degree) / polynomial[first]);
  for (const std::complex<double>& root : z) {
    if (std::abs(root.imag()) <= kRealTolerance * std::abs(root)) {
      groups.push_back({RootGroup::Kind::real, root.real()});
    } else if (root.imag() > 0.0) {
      groups.push_back({RootGroup::Kind::pair, root});
    }
  }
  std::stable_sort(groups.begin(), groups.end(), [](const RootGroup& a, const RootGroup& b) {
    return std::make_pair(a.degree(), -std::abs(a.value)) < std::make_pair(b.degree(), -std::abs(b.value));
  });
  return groups;
}

Eigen::VectorXd product(const std::vector<RootGroup>& groups) {
  Eigen::VectorXd p = Eigen::VectorXd::Ones(1);
  for (const RootGroup& group : groups) p = convolve(p, group.polynomial());
  return p;
}

std::vector<RootGroup> broken_pair(const RootGroup& pair) {
  // Two real roots with the pair's sum: a small spread keeps the two filters from being alike.
  const double centre = pair.value.real();
  const double spread = std::min(std::abs(pair.value.imag()), 0.5 * std::max(0.0, 1.0 - std::abs(centre)));
  return {{RootGroup::Kind::real, centre + spread}, {RootGroup::Kind::real, centre - spread}};
}

std::string to_text(const RootGroup& group) {
  switch (group.kind) {
    case RootGroup::Kind::infinite:
      return "inf";
    case RootGroup::Kind::real:
      return short_number(group.value.real());
    case RootGroup::Kind::pair:
      return short_number(group.value.real()) + "+-" + short_number(group.value.imag()) + "i";
  }
  return {};
}

std::string to_text(const std::vector<RootGroup>& groups) {
  std::string text = "{";
  for (std::size_t k = 0; k < groups.size(); ++k) text += (k > 0 ? ", " : "") + to_text(groups[k]);
  return text + "}";
}

std::vector<std::complex<double>> roots(const std::vector<RootGroup>& groups) {
  std::vector<std::complex<double>> result;
  for (const RootGroup& group : groups) {
    if (group.kind == RootGroup::Kind::infinite) continue;
    result.push_back(group.value);
    if (group.kind == RootGroup::Kind::pair) result.push_back(std::conj(group.value));
  }
  return result;
}

Eigen::VectorXd stabilised(const Eigen::VectorXd& denominator) {
  std::vector<RootGroup> groups = root_groups(denominator, 0.0);
  for (RootGroup& group : groups) {
    const double radius = std::abs(group.value);
    if (radius >= 1.0) group.value /= radius * std::max(radius, 1.0 + kCircleMargin);
  }
  const Eigen::VectorXd p = product(groups);
  return p / p[0];
}

}  // namespace blockid
