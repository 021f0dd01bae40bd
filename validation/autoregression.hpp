// The colour of a residual as an autoregression: from it the variance of any sum that the residual enters.
#pragma once

#include <blockid/validation/masked_correlation.hpp>

#include <Eigen/Core>
#include <span>

namespace blockid {

/// v_t + a_1 v_{t-1} + ... + a_p v_{t-p} = e_t, e white.
struct Autoregression {
  Eigen::VectorXd coefficients;     ///< (p,) a_1..a_p, stable
  Eigen::VectorXd autocorrelation;  ///< (p + 1,) rho_0 = 1, .., rho_p of v, which the coefficients reproduce
  double innovation_variance = 0.0;
  double variance = 0.0;  ///< of v

  Eigen::Index order() const { return coefficients.size(); }
};

/// By the Yule-Walker equations from the autocovariances of all records together, mean removed; the order p <=
/// max_order is the one with the least n ln(innovation variance) + 2 p (Akaike).
/// Source: Brockwell and Davis, Time Series, 1991, sections 8.1 and 9.3.
///
/// Throws Error for sizes that differ, values that are not finite, and no sample at all. A constant signal gives order
/// 0 and variance 0.
Autoregression fit_autoregression(std::span<const MaskedSignal> records, Eigen::Index max_order);

/// The same from sums that may have been corrected; products_0 > 0, counts_0 > 0, as many lags as max_order.
Autoregression fit_autoregression(const PairSums& sums);

/// (M + N, columns) F with F'F = Z' R Z / innovation_variance, R (N, N) the covariance of v: F solves A'F = [0; Z],
/// with A the lower Toeplitz matrix of 1, a_1..a_p, by running the recursion backwards in time. The M <= N rows before
/// the record are those in which it has not yet died away: they stand for the past of a stationary v.
Eigen::MatrixXd backward_filtered(const Autoregression& noise, const Eigen::MatrixXd& z);

/// (N, columns) R Z = innovation_variance A^-1 A'^-1 [0; Z], its last N rows.
Eigen::MatrixXd covariance_times(const Autoregression& noise, const Eigen::MatrixXd& z);

/// n / sum_k rho_k^2 over all lags k: the number of white samples whose mean square is as uncertain as that of n
/// samples of v. Source: Brockwell and Davis 1991, section 7.2.
double effective_samples(const Autoregression& noise, Eigen::Index n);

}  // namespace blockid
