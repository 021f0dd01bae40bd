// How large an uncertainty must be that maps v to w, both from rest: lower bounds in closed form.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// (N, N) lower triangular T_v with (T_v x)_t = sum_k v_k x_{t-k}.
Eigen::MatrixXd lower_toeplitz(const Eigen::VectorXd& v);

/// Largest singular value of T_v, to a relative 1e-12, by the Lanczos iteration.
double toeplitz_norm(const Eigen::VectorXd& v);

/// alpha_tau = sigma_max(T_w R^-1), R'R = T_v'T_v + tau^2 I, tau = relative_tau |T_v|.
///
/// A lower bound of |Delta| over all causal, time-invariant Delta with w = Delta v, for every tau > 0, which rises as
/// tau falls. Rounding of w makes it unsound below relative_tau = 1e-10. The triangle R comes from the QR factors of
/// [T_v; tau I]: T_v'T_v itself is singular in double precision. v = 0 gives |T_w| / 0 = infinity, or 0 with w = 0.
/// Throws Error unless v, w (N,) are finite, N >= 1 and relative_tau >= 1e-10.
double noise_free_bound(const Eigen::VectorXd& v, const Eigen::VectorXd& w, double relative_tau = 1e-8);

/// Whether T_w T_w' < alpha^2 T_v T_v' + tau^2 I, by the generalised Schur algorithm in 3 N^2 operations. False means
/// |Delta| >= alpha; tau is absolute.
bool schur_test(const Eigen::VectorXd& v, const Eigen::VectorXd& w, double alpha, double tau);

/// The alpha at which schur_test() changes, to a relative 1e-9 from below, tau = relative_tau |T_v|: a lower bound of
/// |Delta| like noise_free_bound(), without the triangle: some 30 tests of 3 N^2 operations.
double schur_bound(const Eigen::VectorXd& v, const Eigen::VectorXd& w, double relative_tau = 1e-8);

/// max over tau of sqrt(alpha_tau^2 - eta^2 / tau^2), eta = gamma / (2 sin(pi / (4N + 2))) >= |T_e| for |e_t| <= gamma.
///
/// A lower bound of |Delta| over all Delta with |w - Delta v|_t <= gamma; 0 when it says nothing. The maximum is found
/// to a relative 2e-3 from below by schur_test(): with tau^2 = eta^2 / (s alpha^2) it asks whether
/// T_w T_w' <= (1 + s) alpha^2 T_v T_v' + (1 + 1/s) eta^2 I for some s > 0.
double noise_corrected_bound(const Eigen::VectorXd& v, const Eigen::VectorXd& w, double gamma);

/// (N,) max over s <= t of |w_1..w_s| / |v_1..v_s|: a lower bound of |Delta| on line, for time-varying Delta as well.
/// 0 as long as v and w are zero, infinite when w comes before v.
Eigen::VectorXd running_bound(const Eigen::VectorXd& v, const Eigen::VectorXd& w);

}  // namespace blockid
