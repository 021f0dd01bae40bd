// Uncertainties of known norm, and the plants that they make of the loop of Crowder and de Callafon.
#pragma once

#include "closed_loop_noise.hpp"

#include <blockid/validation/noise_free_bound.hpp>

#include <cmath>
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

/// Poles r e^{+-i 0.2}, r = 0.97, and a zero at 1. With c = cos w, |1 - q|^2 = 2 (1 - c) and |D|^2 = alpha c^2 - beta c
/// + k for alpha = 4 r^2, beta = 4 r (1 + r^2) cos(0.2), k = (1 - r^2)^2 + 4 r^2 cos^2(0.2): the quotient is largest
/// where alpha c^2 - 2 alpha c + beta - k = 0.
inline KnownUncertainty resonant(double norm) {
  const double r = 0.97;
  const double angle = 0.2;
  const double alpha = 4.0 * r * r;
  const double beta = 4.0 * r * (1.0 + r * r) * std::cos(angle);
  const double k = std::pow(1.0 - r * r, 2) + alpha * std::pow(std::cos(angle), 2);
  const double c = 1.0 - std::sqrt(1.0 - (beta - k) / alpha);
  const double peak = std::sqrt(2.0 * (1.0 - c) / (alpha * c * c - beta * c + k));
  return {
      "resonant", {norm / peak * polynomial({1.0, -1.0}), polynomial({1.0, -2.0 * r * std::cos(angle), r * r})}, norm};
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
