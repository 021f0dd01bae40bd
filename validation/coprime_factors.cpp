#include <blockid/validation/coprime_factors.hpp>

#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/filtered.hpp>
#include <blockid/validation/detail/stable_radius.hpp>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>

namespace blockid {
namespace {

using detail::convolved;
using detail::kStableRadius;
using Eigen::VectorXd;

VectorXd sum(const VectorXd& a, const VectorXd& b) {
  VectorXd c = VectorXd::Zero(std::max(a.size(), b.size()));
  c.head(a.size()) += a;
  c.head(b.size()) += b;
  return c;
}

void check_polynomial(const VectorXd& polynomial, const char* what) {
  if (polynomial.size() < 1 || !polynomial.allFinite()) fail(what, ": expected finite coefficients, at least one");
}

void check_sizes(Index expected, Index got, const char* what) {
  if (expected != got) fail(what, ": expected ", expected, " samples, got ", got);
}

}  // namespace

void check(const DiscreteTransferFunction& g) {
  check_polynomial(g.numerator, "numerator");
  check_polynomial(g.denominator, "denominator");
  if (g.denominator[0] == 0.0) fail("denominator: expected a first coefficient that is not zero");
}

VectorXd filter(const DiscreteTransferFunction& g, const VectorXd& u) {
  check(g);
  const Rational block(g.numerator.size() - 1, g.denominator.size() - 1);
  VectorXd theta(block.parameter_count());
  theta << g.numerator / g.denominator[0], g.denominator.tail(g.denominator.size() - 1) / g.denominator[0];
  VectorXd state = VectorXd::Zero(block.state_count());
  VectorXd y(u.size());
  block.apply<double>(detail::view(theta), detail::view(state), detail::view(u), detail::view(y));
  return y;
}

Eigen::VectorXcd polynomial_roots(const VectorXd& polynomial) {
  check_polynomial(polynomial, "polynomial");
  if (polynomial[0] == 0.0) fail("polynomial: expected a first coefficient that is not zero");
  const Index n = polynomial.size() - 1;
  if (n == 0) return {};
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  companion.row(0) = -polynomial.tail(n).transpose() / polynomial[0];
  companion.bottomLeftCorner(n - 1, n - 1).setIdentity();
  return companion.eigenvalues();
}

double spectral_radius(const VectorXd& polynomial) {
  const Eigen::VectorXcd z = polynomial_roots(polynomial);
  return z.size() == 0 ? 0.0 : z.cwiseAbs().maxCoeff();
}

CoprimeFactors coprime_factors(const DiscreteTransferFunction& g, double pole) {
  check(g);
  if (!(std::abs(pole) < 1.0)) fail("coprime factors: expected a pole inside the unit circle, got ", pole);
  if (spectral_radius(g.denominator) < kStableRadius) return trivial_factors(g);
  Eigen::VectorXcd stable = Eigen::VectorXcd::Constant(1, g.denominator[0]);
  for (const std::complex<double> z : polynomial_roots(g.denominator)) {
    const std::complex<double> kept = std::abs(z) < kStableRadius ? z : pole;
    Eigen::VectorXcd longer = Eigen::VectorXcd::Zero(stable.size() + 1);
    longer.head(stable.size()) += stable;
    longer.tail(stable.size()) -= kept * stable;
    stable = longer;
  }
  return {g.numerator, g.denominator, stable.real()};
}

CoprimeFactors trivial_factors(const DiscreteTransferFunction& g) {
  check(g);
  return {g.numerator, g.denominator, g.denominator};
}

VectorXd characteristic_polynomial(const UncertainLoop& loop) {
  return sum(convolved(loop.plant.denominator, loop.controller.denominator),
             convolved(loop.plant.numerator, loop.controller.numerator));
}

void check(const UncertainLoop& loop) {
  check(loop.weight);
  if (loop.weight.numerator[0] == 0.0)
    fail("weight: expected a direct term (biproper), got a numerator that begins with 0");
  const double zero = spectral_radius(loop.weight.numerator);
  const double pole = spectral_radius(loop.weight.denominator);
  if (zero >= kStableRadius) fail("weight: expected zeros inside the unit circle, got one of modulus ", zero);
  if (pole >= kStableRadius) fail("weight: expected poles inside the unit circle, got one of modulus ", pole);
  const VectorXd chi = characteristic_polynomial(loop);
  if (chi[0] == 0.0) fail("loop: model and controller have an algebraic loop without solution");
  const double radius = spectral_radius(chi);
  if (radius >= kStableRadius) {
    fail("loop: expected a controller that stabilises the model, got a closed-loop pole of modulus ", radius);
  }
}

Index uncertainty_memory(const UncertainLoop& loop, double remainder) {
  check(loop);
  if (!(remainder > 0.0 && remainder < 1.0)) {
    fail("uncertainty memory: expected a remainder between 0 and 1, got ", remainder);
  }
  const double radius =
      std::max(spectral_radius(characteristic_polynomial(loop)), spectral_radius(loop.weight.numerator));
  return radius == 0.0 ? 0 : static_cast<Index>(std::ceil(std::log(remainder) / std::log(radius)));
}

VectorXd uncertainty_output(const UncertainLoop& loop, const VectorXd& u, const VectorXd& y) {
  check(loop);
  check_sizes(u.size(), y.size(), "output");
  const VectorXd chi = characteristic_polynomial(loop);
  // The stable denominator of the plant cancels.
  return filter({convolved(loop.controller.stable, loop.plant.denominator), chi}, y) -
         filter({convolved(loop.controller.stable, loop.plant.numerator), chi}, u);
}

UncertaintySignals uncertainty_signals(const UncertainLoop& loop, const VectorXd& u, const VectorXd& y) {
  UncertaintySignals signals;
  signals.w = uncertainty_output(loop, u, y);
  const VectorXd chi = characteristic_polynomial(loop);
  // The stable denominator of the controller cancels.
  const VectorXd before = filter({convolved(loop.plant.stable, loop.controller.denominator), chi}, u) +
                          filter({convolved(loop.plant.stable, loop.controller.numerator), chi}, y);
  signals.v = filter(loop.weight, before);
  if (signals.v.size() == 0 || signals.v.isZero(0.0))
    fail("uncertainty: the signal v is zero, nothing excites the loop");
  return signals;
}

VectorXd uncertainty_input(const UncertainLoop& loop, const VectorXd& r) {
  check(loop);
  return filter(
      loop.weight,
      filter({convolved(loop.plant.stable, loop.controller.denominator), characteristic_polynomial(loop)}, r));
}

double reference_error(const DiscreteTransferFunction& controller, const VectorXd& u, const VectorXd& y,
                       const VectorXd& r, Index first) {
  check_sizes(r.size(), u.size(), "input");
  check_sizes(r.size(), y.size(), "output");
  if (first < 0) fail("reference: expected a first sample of at least 0, got ", first);
  if (first >= r.size()) return 0.0;
  return (filter(controller, y) + u - r).tail(r.size() - first).cwiseAbs().maxCoeff();
}

ClosedLoopRecord simulate_closed_loop(const DiscreteTransferFunction& plant, const DiscreteTransferFunction& controller,
                                      const VectorXd& r, const VectorXd& d) {
  check_sizes(r.size(), d.size(), "disturbance");
  const VectorXd open = convolved(plant.denominator, controller.denominator);
  const VectorXd chi = sum(open, convolved(plant.numerator, controller.numerator));
  return {filter({open, chi}, r) - filter({convolved(plant.denominator, controller.numerator), chi}, d),
          filter({convolved(plant.numerator, controller.denominator), chi}, r) + filter({open, chi}, d)};
}

UncertainRecord simulate_uncertain_loop(const UncertainLoop& loop, const DiscreteTransferFunction& uncertainty,
                                        const VectorXd& r, const VectorXd& d) {
  check(loop);
  check_sizes(r.size(), d.size(), "disturbance");
  check(uncertainty);
  if (const double pole = spectral_radius(uncertainty.denominator); pole >= kStableRadius) {
    fail("uncertainty: expected poles inside the unit circle, got one of modulus ", pole);
  }
  const VectorXd chi = characteristic_polynomial(loop);
  const CoprimeFactors& p = loop.plant;
  const CoprimeFactors& c = loop.controller;
  const VectorXd spread = filter({convolved(p.stable, c.stable), chi}, d);
  const VectorXd returned = filter({c.numerator, c.stable}, filter(loop.weight, filter(uncertainty, spread)));
  UncertainRecord result;
  result.delta = filter({convolved(p.denominator, c.stable), chi}, d) - returned;
  result.signals.v = uncertainty_input(loop, r);
  result.signals.w = filter(uncertainty, result.signals.v) + result.delta;
  result.record.y =
      filter({convolved(p.numerator, c.denominator), chi}, r) + filter({c.denominator, c.stable}, result.signals.w);
  result.record.u =
      filter({convolved(p.denominator, c.denominator), chi}, r) - filter({c.numerator, c.stable}, result.signals.w);
  return result;
}

}  // namespace blockid
