// Uncertainties with several inputs and outputs: the closed form from rest, and the convex programme in their outputs.
#pragma once

#include <blockid/validation/interior_point.hpp>

#include <Eigen/Core>

namespace blockid {

/// (m N, N) with (T_v x)_t = sum_k v_k x_{t-k}, from the columns v_t (m,) of v (m, N).
/// Source: Crowder and de Callafon, equation (14).
Eigen::MatrixXd block_toeplitz(const Eigen::MatrixXd& v);

/// Largest singular value of T_v; 0 without samples.
double block_toeplitz_norm(const Eigen::MatrixXd& v);

/// alpha_tau = sigma_max(T_w R^-1), R'R = T_v'T_v + tau^2 I, tau = relative_tau |T_v|: a lower bound of |Delta| over
/// all causal, time-invariant Delta with w = Delta v from rest, as noise_free_bound() for one input and output.
///
/// v (m, N), w (p, N). Throws Error unless both are finite and not empty, N agrees and relative_tau >= 1e-10.
double mimo_noise_free_bound(const Eigen::MatrixXd& v, const Eigen::MatrixXd& w, double relative_tau = 1e-8);

/// X ((1 + p) n, (1 + p) n) positive definite: the multiplier of [beta (T_v'T_v + tau^2 I), T_z'; T_z, I] with v in
/// units of |T_v|, w in units of max|w| and the rows of T_z output by output. Empty when nothing is proven.
using MimoCertificate = Eigen::MatrixXd;

/// beta tr(X_11 G) + 2 sum_k z_k's_k + tr X_22 >= 0 for every z that alpha = sqrt(beta) allows, s_ka the sum of X over
/// the places of z_ka below the diagonal: with |z - w| <= gamma in the window and |z| <= alpha |v| before it, a lower
/// bound of alpha.
///
/// Holds for every positive definite X, whatever way it came about, up to the rounding of these sums. Throws Error as
/// smallest_mimo_alpha() does, and unless X has its size and is positive definite (by Cholesky). 0 for an empty X.
double certified_mimo_alpha(const Eigen::MatrixXd& v, const Eigen::MatrixXd& w, double gamma, const MimoCertificate& x,
                            double relative_tau = 1e-8);

struct MimoSolution {
  ProgrammeStatus status = ProgrammeStatus::max_iterations;
  double value = 0.0;        ///< alpha, attained by `output`
  double lower_bound = 0.0;  ///< proven by the dual point
  Eigen::MatrixXd output;    ///< (p, n) an output Delta v with |Delta| <= value within the noise bound
  int iterations = 0;
  MimoCertificate certificate;
};

/// alpha* = min |Delta| such that |w_t - (Delta v)_t| <= gamma, component by component, on the last N samples of v:
/// min beta such that [beta (T_v'T_v + tau^2 I), T_z'; T_z, I] is positive semidefinite, |w - z| <= gamma, alpha^2 =
/// beta.
///
/// z (p, n) is the output; before the window it is free. The response to the past is thereby tied to the same Delta.
/// With two inputs or more T_v'T_v is regular for generic records; relative_tau, in units of |T_v|, keeps it so
/// otherwise and makes alpha* a lower bound. It stops early when the value falls to `target` or below, or the lower
/// bound rises above it. For one input and one output smallest_alpha() is the better programme.
/// Time: O((p n)^3) an iteration.
/// v (m, n) with n - N samples of the past, w (p, N) without gaps. Throws Error unless gamma > 0, sizes agree and all
/// is finite, and when v is zero.
MimoSolution smallest_mimo_alpha(const Eigen::MatrixXd& v, const Eigen::MatrixXd& w, double gamma,
                                 const ProgrammeOptions& options = {}, double relative_tau = 1e-8,
                                 double target = -1.0);

}  // namespace blockid
