// The loop of Crowder and de Callafon, section V: an integrator under PI control, sampled.
#pragma once

#include <blockid/problems/crowder_callafon.hpp>
#include <blockid/validation/coprime_factors.hpp>

#include <algorithm>
#include <cstdint>
#include <initializer_list>

namespace blockid::testing {

inline Eigen::VectorXd polynomial(std::initializer_list<double> coefficients) {
  Eigen::VectorXd c(static_cast<Eigen::Index>(coefficients.size()));
  std::copy(coefficients.begin(), coefficients.end(), c.begin());
  return c;
}

inline DiscreteTransferFunction system_of(const problems::Polynomials& g) { return {g.numerator, g.denominator}; }

/// The loop with the names of its formulas.
struct CrowderLoop {
  problems::CrowderCallafon source;
  double eps = source.eps;
  double ts = source.sample_time_s;
  double p = source.pole();
  double b = (1.0 - p) / eps;
  DiscreteTransferFunction plant = system_of(source.plant());
  DiscreteTransferFunction model = system_of(source.model());
  DiscreteTransferFunction controller = system_of(source.controller());

  static DiscreteTransferFunction weight(double k) { return system_of(problems::CrowderCallafon().weight(k)); }
  UncertainLoop loop(double k) const { return {coprime_factors(model, p), coprime_factors(controller, p), weight(k)}; }
  UncertainLoop ok() const { return loop(source.kCovers); }
  UncertainLoop tight() const { return loop(source.kTight); }
  UncertainLoop trivial() const {
    return {trivial_factors(model), trivial_factors(controller), weight(source.kCoversPrinted)};
  }
};

using problems::uniform;

inline Eigen::VectorXd normal_reference(Eigen::Index count, std::uint32_t seed = 1) {
  return problems::crowder_reference(count, seed);
}

/// v and w of 501 samples without noise.
inline UncertaintySignals crowder_signals(const UncertainLoop& loop, Eigen::Index count = 501) {
  const CrowderLoop crowder;
  const Eigen::VectorXd r = normal_reference(count);
  const ClosedLoopRecord record =
      simulate_closed_loop(crowder.plant, crowder.controller, r, Eigen::VectorXd::Zero(count));
  return uncertainty_signals(loop, record.u, record.y);
}

}  // namespace blockid::testing
