// The loop of Crowder and de Callafon with a disturbance at its output, which stands in w as delta.
#pragma once

#include "crowder_loop.hpp"

namespace blockid::testing {

struct NoisySignals {
  Eigen::VectorXd v;
  Eigen::VectorXd w;
  Eigen::VectorXd delta;  ///< what the disturbance leaves in w

  double noise() const { return delta.cwiseAbs().maxCoeff(); }
};

/// `plant` in the loop under the reference r, with d uniform in [-1, 1] from mt19937(seed), scaled to
/// max|delta| = relative max|w without noise|.
inline NoisySignals noisy_signals(const UncertainLoop& loop, const DiscreteTransferFunction& plant,
                                  const Eigen::VectorXd& r, double relative, std::uint32_t seed) {
  const CrowderLoop crowder;
  std::mt19937 generator(seed);
  const Eigen::VectorXd d = Eigen::VectorXd::NullaryExpr(r.size(), [&] { return 2.0 * uniform(generator) - 1.0; });
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(r.size());
  const auto signals = [&](const Eigen::VectorXd& reference, const Eigen::VectorXd& disturbance) {
    const ClosedLoopRecord record = simulate_closed_loop(plant, crowder.controller, reference, disturbance);
    return uncertainty_signals(loop, record.u, record.y);
  };
  const UncertaintySignals clean = signals(r, zero);
  // Linear in the disturbance: the difference is what a unit one leaves.
  const Eigen::VectorXd unit = signals(r, d).w - clean.w;
  const double scale = relative * clean.w.cwiseAbs().maxCoeff() / unit.cwiseAbs().maxCoeff();
  const UncertaintySignals noisy = signals(r, scale * d);
  return {noisy.v, noisy.w, noisy.w - clean.w};
}

/// The record of the noise trade-off: 200 samples, 5 % noise.
inline NoisySignals trade_off_signals() {
  const CrowderLoop crowder;
  return noisy_signals(crowder.ok(), crowder.plant, normal_reference(200), 0.05, 77);
}

}  // namespace blockid::testing
