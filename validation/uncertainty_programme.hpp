// The smallest uncertainty, or the smallest noise, that explains records of v and w: a convex programme in the Markov
// parameters of Delta, solved by an interior-point method with certified bounds.
#pragma once

#include <blockid/validation/interior_point.hpp>

#include <Eigen/Core>
#include <span>

namespace blockid {

/// One experiment: w = Delta v + delta on the last N samples of v.
struct UncertaintyWindow {
  Eigen::VectorXd v;      ///< (L + N,) with the L samples before the window; v is taken as zero before them
  Eigen::VectorXd w;      ///< (N,) NaN where it is missing
  Eigen::VectorXd shape;  ///< (N,) above zero: |delta_t| <= gamma shape_t; empty for ones
  bool from_rest = true;  ///< false when v was not zero before its first sample, but is not recorded
};

/// Samples first..first + count - 1 (from zero) of w with `past` samples of v before them, from signals that start at
/// rest; shape (N,) of the whole record or empty. from_rest holds when the past reaches the start of the record.
/// Throws Error when the window or its past leaves the record.
UncertaintyWindow cut_window(const Eigen::VectorXd& v, const Eigen::VectorXd& w, Eigen::Index first, Eigen::Index count,
                             Eigen::Index past, const Eigen::VectorXd& shape = {});

/// |w - A h| <= gamma, all rows divided by their shape; (A h)_t = sum_k h_k v_{t-k}.
struct UncertaintyProgramme {
  Eigen::MatrixXd a;  ///< (rows, n)
  Eigen::VectorXd w;  ///< (rows,)
};

/// The rows of all windows, for the same h_0..h_{n-1} with n the longest v; missing samples are left out.
///
/// The past must cover the memory of Delta: a truncated past stands in w like noise and makes "invalidated" unsound.
/// Throws Error for no window, sizes that do not agree, samples that are not finite, and no sample of w at all.
UncertaintyProgramme uncertainty_programme(std::span<const UncertaintyWindow> windows);
UncertaintyProgramme uncertainty_programme(const UncertaintyWindow& window);

/// X_1, X_2 positive definite (n, n), lambda (rows,): multipliers of |T_h| <= alpha and of |w - A h| <= gamma.
struct DualCertificate {
  Eigen::MatrixXd x1;
  Eigen::MatrixXd x2;
  Eigen::VectorXd lambda;
};

/// alpha >= (lambda'w - gamma |lambda|_1) / (tr X_1 + tr X_2 + |z - A'lambda|_1), z_k = tr(E_k (X_2 - X_1)).
///
/// Holds for every pair of positive semidefinite X, whatever way they came about, up to the rounding of these sums:
/// |h_k| <= |T_h| absorbs the residual. Throws Error unless both X are positive definite (by Cholesky).
double certified_alpha(const UncertaintyProgramme& programme, double gamma, const DualCertificate& certificate);

/// gamma >= (lambda'w - (tr X_1 + tr X_2 + |z - A'lambda|_1) alpha) / |lambda|_1. Throws Error as certified_alpha().
double certified_gamma(const UncertaintyProgramme& programme, double alpha, const DualCertificate& certificate);

struct ProgrammeSolution {
  ProgrammeStatus status = ProgrammeStatus::max_iterations;
  double value = 0.0;        ///< attained by h; infinite with cap_exceeded
  double lower_bound = 0.0;  ///< proven by the certificate
  Eigen::VectorXd h;         ///< (n,) with |T_h| <= alpha and |w - A h| <= gamma
  double slope = 0.0;        ///< d alpha / d gamma = -|lambda|_1 / (tr X_1 + tr X_2)
  int iterations = 0;
  DualCertificate certificate;
};

/// alpha*(gamma) = min |T_h| such that |w - A h| <= gamma. By Caratheodory and Fejer h extends to a stable causal Delta
/// of that norm, so the answer is exact. Throws Error unless gamma > 0 (without noise: noise_free_bound()).
ProgrammeSolution smallest_alpha(const UncertaintyProgramme& programme, double gamma,
                                 const ProgrammeOptions& options = {});

/// gamma*(alpha) = min gamma such that |T_h| <= alpha, |w - A h| <= gamma; it stops early when the value falls to
/// `target` or below, or the lower bound rises above it. A value of 1e-9 max|w| counts as zero.
/// Throws Error unless alpha > 0.
ProgrammeSolution smallest_gamma(const UncertaintyProgramme& programme, double alpha,
                                 const ProgrammeOptions& options = {}, double target = -1.0);

}  // namespace blockid
