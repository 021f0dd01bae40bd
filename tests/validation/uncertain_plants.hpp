// Uncertainties of known norm, and the plants that they make of the loop of Crowder and de Callafon.
#pragma once

#include "closed_loop_noise.hpp"

#include <blockid/validation/noise_free_bound.hpp>

#include <complex>

#include <string>
#include <vector>

namespace blockid::testing {

struct KnownUncertainty {
  std::string name;
  DiscreteTransferFunction delta;
  double norm = 0.0;
};

/// norm (q - a) / (1 - a q), the same gain at all frequencies.
inline KnownUncertainty all_pass(double norm) {
  return {"all-pass", {norm * polynomial({-0.5, 1.0}), polynomial({1.0, -0.5})}, norm};
}

/// A pair of poles r e^{+-i 0.2}, r = 0.97. |(1 - r e^{i(0.2 - w)} )(1 - r e^{-i(0.2 + w)})|^2 is, with c = cos w, the
/// quadratic 4 r^2 c^2 - 4 r (1 + r^2) cos(0.2) c + const, least at c = (1 + r^2) cos(0.2) / (2 r).
inline KnownUncertainty resonant(double norm) {
  const double r = 0.97;
  const double angle = 0.2;
  const Eigen::VectorXd poles = polynomial({1.0, -2.0 * r * std::cos(angle), r * r});
  const double c = std::min(1.0, (1.0 + r * r) * std::cos(angle) / (2.0 * r));
  const std::complex<double> q(c, -std::sqrt(1.0 - c * c));
  return {"resonant", {polynomial({norm * std::abs(poles[0] + q * (poles[1] + q * poles[2]))}), poles}, norm};
}

/// A pole at 0.9: largest at 0, where the gain is 1 / (1 - 0.9).
inline KnownUncertainty low_pass(double norm) {
  return {"low-pass", {polynomial({norm * 0.1}), polynomial({1.0, -0.9})}, norm};
}

/// A pole at -0.8 and a zero at 1: largest at pi, where the gain is 2 / (1 - 0.8).
inline KnownUncertainty high_pass(double norm) {
  return {"high-pass", {norm * polynomial({0.1, -0.1}), polynomial({1.0, 0.8})}, norm};
}

inline std::vector<KnownUncertainty> uncertainties(double norm) {
  return {all_pass(norm), resonant(norm), low_pass(norm), high_pass(norm)};
}

/// |T_Delta| of the first `count` samples: the most that any test of so many samples can see.
inline double visible_norm(const DiscreteTransferFunction& delta, Eigen::Index count) {
  return toeplitz_norm(filter(delta, Eigen::VectorXd::Unit(count, 0)));
}

/// The loop of that uncertainty under a reference, with max|delta| = relative max|w without noise|; d uniform.
/// v and w come from u and y.
inline NoisySignals uncertain_signals(const UncertainLoop& loop, const DiscreteTransferFunction& delta,
                                      const Eigen::VectorXd& r, double relative, std::uint32_t seed) {
  std::mt19937 generator(seed);
  const Eigen::VectorXd d = Eigen::VectorXd::NullaryExpr(r.size(), [&] { return 2.0 * uniform(generator) - 1.0; });
  const Eigen::VectorXd unit = simulate_uncertain_loop(loop, delta, 0.0 * r, d).delta;
  const Eigen::VectorXd clean = simulate_uncertain_loop(loop, delta, r, 0.0 * d).signals.w;
  const double scale = relative * clean.cwiseAbs().maxCoeff() / unit.cwiseAbs().maxCoeff();
  const UncertainRecord result = simulate_uncertain_loop(loop, delta, r, scale * d);
  const UncertaintySignals signals = uncertainty_signals(loop, result.record.u, result.record.y);
  return {signals.v, signals.w, result.delta};
}

}  // namespace blockid::testing
