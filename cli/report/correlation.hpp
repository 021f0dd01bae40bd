// Correlations of residuals and what whiteness and independence allow them to be.
#pragma once

#include <Eigen/Core>

namespace blockid::cli {

/// r_k = sum_t d_t d_{t+k} / sum_t d_t^2, d_t = mask_t (x_t - mean), k = 0..max_lag: (max_lag + 1,).
/// x, mask: (N,); mask is 0 where a sample does not count, else 1. NaN when x does not vary.
Eigen::VectorXd autocorrelation(const Eigen::VectorXd& x, const Eigen::VectorXd& mask, Eigen::Index max_lag);

/// r_k = sum_t a_t b_{t+k} / sqrt(sum a_t^2 sum b_t^2) of the deviations from the means, k = -max_lag..max_lag:
/// (2 max_lag + 1,). A peak at k > 0 says that b follows a by k samples. a is unmasked, b as x above.
Eigen::VectorXd cross_correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& mask,
                                  Eigen::Index max_lag);

/// Two-sided 99 % point of the normal distribution.
inline constexpr double kTwoSided99 = 2.575829303548901;

/// 2.58 / sqrt(N): 99 % of the autocorrelations of N white samples lie within.
double whiteness_band(Eigen::Index samples);

/// 2.58 sqrt(P / N), P = 1 + 2 sum_{k>=1} r_a(k) r_b(k): 99 % of the cross-correlations of two independent signals with
/// the autocorrelations r_a, r_b (lags 0..) lie within. Source: Ljung, System Identification, 1999, section 16.6.
double independence_band(const Eigen::VectorXd& autocorrelation_a, const Eigen::VectorXd& autocorrelation_b,
                         Eigen::Index samples);

}  // namespace blockid::cli
