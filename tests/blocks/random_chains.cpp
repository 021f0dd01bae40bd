#include "blocks/random_chains.hpp"

#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/dead_zone.hpp>
#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/offset.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/piecewise_linear.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/saturation.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/tanh_network.hpp>

#include <cmath>
#include <complex>
#include <numbers>
#include <sstream>
#include <utility>
#include <vector>

namespace blockid::testing {
namespace {

Index below(std::mt19937_64& engine, Index n) { return static_cast<Index>(engine() % static_cast<std::uint64_t>(n)); }

Eigen::VectorXd near(const Eigen::VectorXd& start, double radius, UniformNumbers& numbers) {
  return start + radius * numbers.vector(start.size());
}

}  // namespace

Eigen::VectorXd random_denominator(Index na, double radius, UniformNumbers& numbers) {
  // Angles on a grid with some scatter keep the poles apart: close ones would make every comparison ill conditioned.
  std::vector<std::complex<double>> poles;
  const Index pairs = na / 2;
  for (Index k = 0; k < pairs; ++k) {
    const double angle =
        std::numbers::pi * (static_cast<double>(k) + 0.5 + 0.3 * numbers.next()) / static_cast<double>(pairs + 1);
    const std::complex<double> pole = std::polar(radius * (0.85 + 0.15 * numbers.next()), angle);
    poles.push_back(pole);
    poles.push_back(std::conj(pole));
  }
  if (na % 2 == 1) poles.emplace_back(radius * numbers.next());
  Eigen::VectorXcd a = Eigen::VectorXcd::Zero(na + 1);
  a[0] = 1.0;
  for (const std::complex<double>& pole : poles) {
    for (Index k = na; k >= 1; --k) a[k] -= pole * a[k - 1];
  }
  return a.tail(na).real();
}

Eigen::VectorXd random_parameters(const AnyBlock& block, UniformNumbers& numbers) {
  if (const auto* rational = block.target<Rational>()) {
    Eigen::VectorXd theta(block.parameter_count());
    theta.head(rational->nb() + 1) = numbers.vector(rational->nb() + 1);
    theta.tail(rational->na()) = random_denominator(rational->na(), 0.9, numbers);
    return theta;
  }
  if (const auto* oversampled = block.target<Oversampled>()) return random_parameters(oversampled->inner(), numbers);
  if (block.target<CustomLag>() != nullptr) return near(Eigen::Vector3d(0.5, 1.0, 0.3), 0.3, numbers);
  if (block.target<CustomTanh>() != nullptr) return near(Eigen::Vector2d(1.0, 1.0), 0.5, numbers);
  if (!block.children().empty()) {
    std::vector<double> all;
    for (const LabelledBlock& child : block.children()) {
      const Eigen::VectorXd theta = random_parameters(child.block, numbers);
      all.insert(all.end(), theta.begin(), theta.end());
    }
    return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Index>(all.size()));
  }
  const ParameterBounds bounds = block.bounds();
  return near(block.initial_parameters(), 0.2, numbers).cwiseMax(bounds.lower).cwiseMin(bounds.upper);
}

AnyBlock random_leaf(std::mt19937_64& engine) {
  switch (below(engine, 7)) {
    case 0:
      return Polynomial(below(engine, 6), {-4.0, 3.0});
    case 1:
      return CustomTanh{};
    case 2:
      return CustomLag{};
    case 3:
      return CustomSquare{};
    default: {
      const Index nb = below(engine, 5);
      const Index na = below(engine, 5);
      return Rational(nb, na, below(engine, 3));
    }
  }
}

AnyBlock random_chain(std::mt19937_64& engine, int depth) {
  if (depth == 0 || below(engine, 4) == 0) return random_leaf(engine);
  std::vector<LabelledBlock> children;
  const Index count = 1 + below(engine, 3);
  for (Index k = 0; k < count; ++k) {
    static const std::vector<std::string> kLabels = {"B0", "", "B2"};
    AnyBlock child = random_chain(engine, depth - 1);
    children.push_back({kLabels[static_cast<std::size_t>(k)], std::move(child)});
  }
  if (below(engine, 2) == 0) return Series(std::move(children));
  return Parallel(std::move(children));
}

std::string outline(const AnyBlock& block) {
  const std::vector<LabelledBlock> children = block.children();
  if (children.empty()) return block.kind();
  const bool sum = block.kind() == "parallel";
  std::ostringstream text;
  for (std::size_t k = 0; k < children.size(); ++k) {
    text << (k > 0 ? (sum ? " + " : " | ") : (sum ? "[" : "(")) << outline(children[k].block);
  }
  text << (sum ? "]" : ")");
  return text.str();
}

}  // namespace blockid::testing
