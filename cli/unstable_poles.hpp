// A figure of reproduced continuous-time models.
#pragma once

#include <blockid/estimators/continuous_fit.hpp>

namespace blockid::cli {

/// How many poles have no negative real part.
inline double unstable_poles(const ContinuousFit& fit) {
  return static_cast<double>((poles(fit.model).real().array() >= 0.0).count());
}

}  // namespace blockid::cli
