// Is the model good enough: tests of what it leaves of records.
#pragma once

#include <blockid/validation/autoregression.hpp>

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// One record as an estimator left it, any estimator: only the sensitivities ask for more than signals.
///
/// They say what errors of the parameters add to the residual: d yhat / d p, (N, P) with the same P in all records, or
/// (N, 0) for none. Without any, the parameters count as exact.
struct ResidualRecord {
  Eigen::VectorXd u;                 ///< (N,) input
  Eigen::VectorXd yhat;              ///< (N,) output of the model
  Eigen::VectorXd residual;          ///< (N,) y - yhat; anything where the weight is 0
  Eigen::VectorXd weights;           ///< (N,) >= 0, 0: not scored; empty: ones
  Eigen::MatrixXd fitted_here;       ///< of unknowns fitted by least squares to these very records
  Eigen::MatrixXd fitted_elsewhere;  ///< of parameters that come, with a covariance, from independent records
};

struct ResidualTestOptions {
  Eigen::MatrixXd covariance = {};  ///< (P, P) of the parameters that were fitted elsewhere
  Eigen::Index lags = 25;           ///< longest lag K
  double significance = 0.01;       ///< probability of a false alarm of each test
  Eigen::Index noise_order = 30;    ///< largest order of the autoregression that describes the noise
};

enum class ResidualTestKind {
  offset,          ///< the mean
  whiteness,       ///< autocorrelation, lags 1..K: of the noise, not of the model
  input,           ///< against u_{t-k}, k = 0..K: linear dynamics that were missed
  later_input,     ///< against u_{t+k}, k = 1..K: feedback, or a delay that is too long
  squared_input,   ///< against u_{t-k}^2: an even nonlinearity that was missed
  absolute_input,  ///< against |u_{t-k}|: the same, less sensitive to peaks
  squared_output,  ///< against yhat_{t-k}^2: an even nonlinearity behind the dynamics
  cubed_output     ///< against yhat_{t-k}^3: an odd one
};

/// "input", "later input", "squared input", ...
std::string to_text(ResidualTestKind kind);

struct ResidualTest {
  ResidualTestKind kind = ResidualTestKind::whiteness;
  double statistic = 0.0;
  Eigen::Index degrees_of_freedom = 0;
  double p_value = 1.0;
  bool passed = true;  ///< p_value >= significance
  /// For pictures: correlations r_k at the lags k, and what the same significance allows each alone.
  Eigen::VectorXd lags;
  Eigen::VectorXd correlations;
  Eigen::VectorXd bands;
};

struct ResidualTests {
  std::vector<ResidualTest> tests;  ///< in the order of ResidualTestKind; those that nothing can be said of are missing
  Autoregression noise;             ///< the residual's own spectrum, as the bands use it
  double deviation = 0.0;           ///< sqrt(sum r_t^2 / (n - rank)), n scored samples
  Eigen::Index samples = 0;         ///< n
  Eigen::Index rank = 0;            ///< directions of the parameters that these records determined
  /// Distance of the parameters from the least-squares minimum on these records, in standard deviations a direction:
  /// near zero after a fit to them, about one or more for a model from other records. 0 when none was fitted here.
  double distance_from_minimum = 0.0;
  double significance = 0.01;

  /// nullptr when it was not possible.
  const ResidualTest* find(ResidualTestKind kind) const;
  /// Whether all passed but whiteness, which concerns the noise.
  bool model_passed() const;
};

/// For instruments Z (n, m), lags of a signal with its mean removed, and a residual r = (I - Pi) (v - Psi d):
///
///     c = Zt'r,   Zt = (I - Pi)'Z,   statistic = c' (Zt' R Zt + Zt'Psi C Psi'Zt)^+ c,
///
/// chi-square with the rank as its degrees of freedom. Pi projects on the sensitivities of what was fitted here, Psi
/// are those of what was fitted elsewhere with covariance C. R is the covariance of the noise v by an autoregression
/// fitted to the residual, so that the test holds for coloured residuals and coloured inputs: Z' R Z is a sum over all
/// lags of both autocorrelations. Directions with less than 1e-4 of the variance that the instruments have before the
/// projection are left out. All tests but that of the offset treat the mean as if it had been fitted here.
///
/// Whiteness: N (N + 2) sum_k r_k^2 / (N - k), where what estimated parameters do to the autocorrelations of white
/// noise is taken out. For a model that predicts from the input alone the degrees of freedom are all K: its
/// sensitivities are independent of the noise.
///
/// All assume that the noise is stationary and independent of the input.
/// Sources: Ljung, System Identification, 1999, section 16.6; Ljung and Box 1978; Söderström and Stoica, System
/// Identification, 1989, section 11.2; Billings and Voon 1983 for the nonlinear instruments.
///
/// Throws Error for sizes that do not agree, values that are not finite, fewer than 4 (K + 1) scored samples, a
/// residual that does not vary.
ResidualTests residual_tests(std::span<const ResidualRecord> records, const ResidualTestOptions& options = {});

/// What a failed test says about the model, in words; empty for one that passed.
std::string explanation(const ResidualTest& test);

}  // namespace blockid
