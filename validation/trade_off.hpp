// How much uncertainty a record needs over how much noise it is granted.
#pragma once

#include <blockid/validation/uncertainty_programme.hpp>

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace blockid {

/// alpha*(gamma) with its slope.
struct TradeOffPoint {
  double gamma = 0.0;
  double alpha = 0.0;         ///< attained; infinite when no alpha up to the cap explains the record
  double alpha_proven = 0.0;  ///< from the certificate
  double slope = 0.0;         ///< d alpha / d gamma
  ProgrammeStatus status = ProgrammeStatus::max_iterations;

  /// -d ln alpha / d ln gamma.
  double elasticity() const { return -slope * gamma / alpha; }
};

struct TradeOffCurve {
  std::vector<TradeOffPoint> points;  ///< gamma falling
  double least_noise = 0.0;           ///< gamma*(1): the smallest noise bound that does not invalidate
  double noise_floor = 0.0;           ///< gamma*(alpha_cap): below it no uncertainty helps
  /// The point where the elasticity passes 1: for less gamma, alpha grows faster than gamma falls. Empty when no two
  /// neighbouring points have it between them.
  std::optional<TradeOffPoint> elbow;
};

/// alpha*(gamma) at the given gammas, one smallest_alpha() each; the elbow by bisection of ln gamma to 1 %.
///
/// A curve that is steep at the noise bound in use says that this bound, the controller or the state at the start is
/// wrong, rather than the model. Throws Error for no gamma and as smallest_alpha() does.
TradeOffCurve trade_off_curve(const UncertaintyProgramme& programme, const Eigen::VectorXd& gammas,
                              const ProgrammeOptions& options = {});

/// The same at `count` gammas in geometric progression, from just above the noise floor (at least 1e-4 max|w|) to
/// just below max|w|, where alpha is 0. Throws Error for fewer than two, and when w is zero.
TradeOffCurve trade_off_curve(const UncertaintyProgramme& programme, int count = 12,
                              const ProgrammeOptions& options = {});

}  // namespace blockid
