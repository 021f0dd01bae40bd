// The noise bound of a closed loop: from a run without reference, or from a bound of the disturbance.
#pragma once

#include <blockid/validation/coprime_factors.hpp>

#include <Eigen/Core>

namespace blockid {

struct NoiseEstimate {
  double gamma = 0.0;      ///< safety times the largest sample
  double largest = 0.0;    ///< max |w| of the run, which is max |delta|
  double reference = 0.0;  ///< max |C y + u|: what there was of a reference
};

/// Without a reference v = 0 and w = delta, so that max|w| is the largest noise of this run.
///
/// The largest sample of a run is no bound of the next one: with independent noise of one distribution, M new samples
/// exceed the largest of N with probability M / (N + M). `safety` is the factor that is to cover it; take a run several
/// times as long as the one to be judged, too. A gamma that is too small invalidates good models.
/// u, y (N,) from rest. Throws Error as uncertainty_output() does, for sizes below 1, a safety below 1, and when C y +
/// u exceeds reference_tolerance max|u|: then the run had a reference, or another controller. Source: Crowder and de
/// Callafon, section IV.
NoiseEstimate noise_from_quiet_run(const UncertainLoop& loop, const Eigen::VectorXd& u, const Eigen::VectorXd& y,
                                   double safety = 1.2, double reference_tolerance = 1e-3);

/// sum_k |g_k| of delta = G d, G = Dc^-1 (1 + P C)^-1: max|delta| <= gain max|d|, and some d attains it.
///
/// A rigorous gamma when `plant` is the true one; with the model in its place an estimate. The sum ends where the
/// slowest pole has decayed to 1e-18. Throws Error unless the controller stabilises the plant.
/// Source: Crowder and de Callafon, equation (27).
double disturbance_gain(const UncertainLoop& loop, const DiscreteTransferFunction& plant);

/// (count,) b_t = largest gain pole^{past + t} / (1 - pole), t = 1..count: what the unrecorded past may leave in w at
/// the t-th sample of a window with `past` samples of v before it, when |v| <= largest there and |h_k| <= gain pole^k.
///
/// A window that is not from rest becomes sound with |delta_t| <= gamma + b_t: shape_t = 1 + b_t / gamma, from_rest =
/// true. Throws Error unless largest and gain are finite and not negative, 0 <= pole < 1, past >= 0 and count >= 1.
Eigen::VectorXd unrecorded_past_bound(double largest, double gain, double pole, Eigen::Index past, Eigen::Index count);

}  // namespace blockid
