// The loop of Crowder and de Callafon 2003, section V: an integrator under PI control, sampled.
#pragma once

#include <blockid/validation/coprime_factors.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <random>

namespace blockid::testing {

inline Eigen::VectorXd polynomial(std::initializer_list<double> coefficients) {
  Eigen::VectorXd c(static_cast<Eigen::Index>(coefficients.size()));
  std::copy(coefficients.begin(), coefficients.end(), c.begin());
  return c;
}

/// P = Ts q^-1 / (1 - q^-1), its model with the pole p = e^(-eps Ts), PI by Tustin's rule; Kp = Ki = 1.
struct CrowderLoop {
  double eps = 0.5;
  double ts = 0.1;
  double p = std::exp(-eps * ts);
  double b = (1.0 - p) / eps;
  DiscreteTransferFunction plant{polynomial({0.0, ts}), polynomial({1.0, -1.0})};
  DiscreteTransferFunction model{polynomial({0.0, b}), polynomial({1.0, -p})};
  DiscreteTransferFunction controller{polynomial({1.0 + ts / 2.0, -1.0 + ts / 2.0}), polynomial({1.0, -1.0})};

  static DiscreteTransferFunction weight(double k) {
    constexpr double pv = 0.82;
    const double gain = k * (1.0 - pv) * (1.0 - pv);
    return {polynomial({gain}), polynomial({1.0, -2.0 * pv, pv * pv})};
  }
  UncertainLoop loop(double k) const { return {coprime_factors(model, p), coprime_factors(controller, p), weight(k)}; }
  UncertainLoop ok() const { return loop(0.70); }
  UncertainLoop tight() const { return loop(0.60); }
  UncertainLoop trivial() const { return {trivial_factors(model), trivial_factors(controller), weight(0.532)}; }
};

/// (count,) uniform in [0, 1): 53 bits of two draws.
inline double uniform(std::mt19937& generator) {
  const double high = static_cast<double>(generator() >> 5U);
  const double low = static_cast<double>(generator() >> 6U);
  return (high * 67108864.0 + low) / 9007199254740992.0;
}

/// Box and Muller's pairs from mt19937(seed).
inline Eigen::VectorXd normal_reference(Eigen::Index count, std::uint32_t seed = 1) {
  std::mt19937 generator(seed);
  Eigen::VectorXd r(count);
  for (Eigen::Index t = 0; t < count; t += 2) {
    const double u1 = uniform(generator);
    const double u2 = uniform(generator);
    const double radius = std::sqrt(-2.0 * std::log(1.0 - u1));
    r[t] = radius * std::cos(2.0 * std::numbers::pi * u2);
    if (t + 1 < count) r[t + 1] = radius * std::sin(2.0 * std::numbers::pi * u2);
  }
  return r;
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
