// Whether the numerator and the denominator of an estimated filter have a factor in common, up to what is known of
// them.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

namespace blockid {

/// B(q) / A(q) = (b_0 + ... + b_nb q^-nb) / (1 + a_1 q^-1 + ... + a_na q^-na) as it was estimated.
struct EstimatedFilter {
  std::string name;
  Eigen::VectorXd numerator;    ///< (nb + 1,) b_0 .. b_nb
  Eigen::VectorXd denominator;  ///< (na + 1,) 1, a_1 .. a_na
  Eigen::MatrixXd covariance;   ///< (nb + 1 + na, nb + 1 + na) of b_0 .. b_nb, a_1 .. a_na
};

/// Roots that the data do not tell apart: one real zero and pole, or two zeros and two poles.
struct CommonFactor {
  std::vector<std::complex<double>> zeros;
  std::vector<std::complex<double>> poles;
  double statistic = 0.0;
  double p_value = 1.0;
};

/// Wald's test that a factor of B and one of A are the same: for real roots z = p, for two roots of each (conjugate, or
/// any two real ones) the same sum and the same product,
///
///     statistic = c' (J P J')^-1 c,  c = z - p or (z_1 + z_2 - p_1 - p_2, z_1 z_2 - p_1 p_2),
///
/// with J from the derivatives of roots, dz / db_k = -z^{nb - k} / B'(z). To first order it is what the fit loses when
/// the factor is taken out and all else is fitted anew, so that it is small just where the effect on the output is
/// below the noise. Chi-square with one or two degrees of freedom at a known place of the factor; the place is
/// estimated, too, which makes it larger, so that a small `significance` suits.
///
/// Given are pairs with p >= significance, the likeliest first, each root in one of them at most. Roots at the origin,
/// multiple roots and variances of zero are left out. Throws Error for sizes that do not agree.
/// Source: Söderström and Stoica, System Identification, 1989, chapter 11 (cancelling poles and zeros).
std::vector<CommonFactor> common_factors(const EstimatedFilter& filter, double significance = 0.003);

/// The last coefficients, b_nb and a_na, that lie within two standard deviations of zero, as "b3", "a2": a lower degree
/// may do. Only where one coefficient more is left; coefficients that were held are left out.
std::vector<std::string> vanishing_coefficients(const EstimatedFilter& filter);

}  // namespace blockid
