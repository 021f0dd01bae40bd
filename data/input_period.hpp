// Whether an input repeats itself.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// The period of u (N,) in samples, 0 when none is seen: the least P <= N / 2 with
///
///     sum_t (u_t - u_{t+P})^2 <= 2e-3 sum_t (u_t - mean)^2,   t over the N - P pairs,
///
/// i.e. what does not repeat has less than 0.1 % of the power, behind a first lag at which the signal has changed by
/// as much as it varies (so that a slow signal is not taken for one that repeats). N log N operations.
/// Values must be finite.
Eigen::Index input_period(const Eigen::VectorXd& u);

}  // namespace blockid
