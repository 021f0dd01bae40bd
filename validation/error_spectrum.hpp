// The error of a model beside the noise of the measurement.
#pragma once

#include <blockid/validation/residual_tests.hpp>

#include <Eigen/Core>
#include <span>

namespace blockid {

/// One period of M samples seen P >= 2 times, at the lines k = 1 .. (M - 1) / 2:
///
///     E_p = DFT of the residual of period p,  E = mean_p E_p,  s^2 = sum_p |E_p - E|^2 / (P - 1).
///
/// The noise is what differs between periods; what repeats is the model's error, when |E|^2 exceeds s^2 / P.
struct PeriodicError {
  Eigen::VectorXd frequency_hz;   ///< (F,)
  Eigen::VectorXd error_density;  ///< (F,) of the residual's mean over periods, less the noise in it; below zero by
                                  ///< chance where there is no error
  Eigen::VectorXd noise_density;  ///< (F,) of the noise in one period; both one-sided, in unit^2 / Hz
  Eigen::Index periods = 0;       ///< of all records together
  double statistic = 0.0;         ///< 2 nu sum_k ln(1 + |E_k|^2 P / (nu s_k^2)), nu = P - 1
  Eigen::Index degrees_of_freedom = 0;
  double p_value = 1.0;
  bool passed = true;
};

/// Fisher's sum of the p-values (1 + x / nu)^-nu of x = |E|^2 P / s^2, which is F(2, 2 nu) without a model error: exact
/// for noise that is normal and independent from one period to the next. Parameters fitted to these records take part
/// of the noise out of E, so that the test errs on the safe side. The last whole periods of each record are used.
/// Source: Pintelon and Schoukens, System Identification, 2012, section 2.5 for the sample variance over periods.
///
/// period: samples M >= 3. Throws Error for sizes that do not agree, fewer than two whole periods behind the samples
/// that are not scored, and samples missing within them.
PeriodicError periodic_error(std::span<const ResidualRecord> records, Eigen::Index period, double sample_time_s,
                             double significance = 0.01);

/// The residual's variance beside that of the noise, which is known from elsewhere.
struct NoiseLevelTest {
  double ratio = 0.0;    ///< of the standard deviations, residual over noise
  double samples = 0.0;  ///< white samples that the residual is worth
  double p_value = 1.0;  ///< of a ratio so large by chance
  bool passed = true;
};

/// samples ratio^2 is chi-square with `samples` degrees of freedom for normal noise of the residual's colour.
/// Throws Error unless noise_deviation > 0.
NoiseLevelTest noise_level_test(const ResidualTests& tests, double noise_deviation);

}  // namespace blockid
