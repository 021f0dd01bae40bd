#include <blockid/estimators/stability.hpp>

#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/estimators/detail/companion_roots.hpp>
#include <blockid/estimators/polynomial_model.hpp>

#include <algorithm>
#include <complex>
#include <span>

namespace blockid {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Radius that a reflected pole does not exceed: a pole on the circle reflects onto itself.
constexpr double kLargestRadius = 0.999;

/// visit(filter, offset): the rational filters below `block`; offset of their theta.
template <class Visit>
void visit_rational(const AnyBlock& block, Index offset, const Visit& visit) {
  if (const auto* rational = block.target<Rational>()) return visit(*rational, offset);
  for (const LabelledBlock& child : block.children()) {
    visit_rational(child.block, offset, visit);
    offset += child.block.parameter_count();
  }
}

std::span<const double> part(const VectorXd& theta, const Rational& filter, Index offset) {
  return {theta.data() + offset, static_cast<std::size_t>(filter.parameter_count())};
}

/// (1, a_1, ..., a_n) of the monic polynomial with these roots, which are closed under conjugation.
VectorXd monic_polynomial(const VectorXcd& roots) {
  VectorXcd a = VectorXcd::Zero(roots.size() + 1);
  a[0] = 1.0;
  for (Index k = 0; k < roots.size(); ++k) {
    for (Index j = k + 1; j >= 1; --j) a[j] -= roots[k] * a[j - 1];
  }
  return a.real();
}

/// theta with poles reflected, in place.
void reflect(const Rational& filter, Index offset, VectorXd& theta) {
  VectorXcd poles = detail::companion_roots(filter.denominator(part(theta, filter, offset)).tail(filter.na()));
  double gain = 1.0;
  for (std::complex<double>& pole : poles) {
    const double radius = std::abs(pole);
    if (radius < 1.0) continue;
    gain /= radius;
    pole *= std::min(1.0 / radius, kLargestRadius) / radius;
  }
  theta.segment(offset, filter.nb() + 1) *= gain;
  theta.segment(offset + filter.nb() + 1, filter.na()) = monic_polynomial(poles).tail(filter.na());
}

}  // namespace

std::vector<std::string> unstable_denominators(const Model& model) {
  const std::vector<std::string> all = model.chain.parameter_names();
  std::vector<std::string> found;
  visit_rational(model.chain, 0, [&](const Rational& filter, Index offset) {
    if (has_roots_inside_circle(filter.denominator(part(model.parameters, filter, offset)))) return;
    const auto first = all.begin() + offset + filter.nb() + 1;
    found.insert(found.end(), first, first + filter.na());
  });
  return found;
}

bool is_stable(const Model& model) { return unstable_denominators(model).empty(); }

Model with_reflected_poles(const Model& model) {
  Model result = model;
  result.standard_deviations.resize(0);
  visit_rational(model.chain, 0, [&](const Rational& filter, Index offset) {
    if (has_roots_inside_circle(filter.denominator(part(model.parameters, filter, offset)))) return;
    reflect(filter, offset, result.parameters);
  });
  return result;
}

}  // namespace blockid
