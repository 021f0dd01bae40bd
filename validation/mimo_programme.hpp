// Uncertainties with several inputs and outputs: the closed form from rest, and the convex programme in their outputs.
#pragma once

#include <blockid/validation/interior_point.hpp>

#include <Eigen/Core>

namespace blockid {

/// (m N, N) with (T_v x)_t = sum_k v_k x_{t-k}, from the columns v_t (m,) of v (m, N).
/// Source: Crowder and de Callafon, equation (14).
Eigen::MatrixXd block_toeplitz(const Eigen::MatrixXd& v);

/// alpha_tau = sigma_max(T_w R^-1), R'R = T_v'T_v + tau^2 I, tau = relative_tau |T_v|: a lower bound of |Delta| over
/// all causal, time-invariant Delta with w = Delta v from rest, as noise_free_bound() for one input and output.
///
/// v (m, N), w (p, N). Throws Error unless both are finite and not empty, N agrees and relative_tau >= 1e-10.
double mimo_noise_free_bound(const Eigen::MatrixXd& v, const Eigen::MatrixXd& w, double relative_tau = 1e-8);

struct MimoSolution {
  ProgrammeStatus status = ProgrammeStatus::max_iterations;
  double value = 0.0;        ///< alpha, attained by `output`
  double lower_bound = 0.0;  ///< proven by the dual point
  Eigen::MatrixXd output;    ///< (p, n) an output Delta v with |Delta| <= value within the noise bound
  int iterations = 0;
};

/// alpha* = min |Delta| such that |w_t - (Delta v)_t| <= gamma, component by component, on the last N samples of v:
/// min beta such that [beta (T_v'T_v + tau^2 I), T_z'; T_z, I] is positive semidefinite, |w - z| <= gamma, alpha^2 =
/// beta.
///
/// z (p, n) is the output; before the window it is free. The response to the past is thereby tied to the same Delta.
/// With two inputs or more T_v'T_v is regular for generic records; relative_tau, in units of |T_v|, keeps it so
/// otherwise and makes alpha* a lower bound. For one input and one output smallest_alpha() is the better programme.
/// Time: O((p n)^3) an iteration.
/// v (m, n) with n - N samples of the past, w (p, N) without gaps. Throws Error unless gamma > 0, sizes agree and all
/// is finite, and when v is zero.
MimoSolution smallest_mimo_alpha(const Eigen::MatrixXd& v, const Eigen::MatrixXd& w, double gamma,
                                 const ProgrammeOptions& options = {}, double relative_tau = 1e-8);

}  // namespace blockid
