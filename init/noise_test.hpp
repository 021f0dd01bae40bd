// Whether a model's residuals look like noise.
#pragma once

#include <blockid/estimators/predictor.hpp>

#include <Eigen/Core>

namespace blockid {

struct NoiseTestOptions {
  /// Lags of residual, input and squared input; a sixtieth of the samples at most.
  Index lags = 20;
  /// Chance that white residuals which do not depend on the input fail.
  double level = 1e-4;
};

/// Outcome of a noise test.
struct NoiseTest {
  /// N R^2 of the regression.
  double statistic = 0.0;
  /// Its limit: the quantile 1 - level of chi-squared with as many degrees as the regression has directions.
  double limit = 0.0;

  bool like_noise() const { return statistic <= limit; }
};

/// Regresses the residuals of a predictor at p (Predictor::unknown_count()) on a constant and their own past, the
/// input and its square,
///
///   r_t ~ 1, r_{t-1} .. r_{t-L}, u_t .. u_{t-L+1}, u_t^2 .. u_{t-L+1}^2
///
/// N R^2 of that regression is chi-squared, 3 L + 1 degrees, when the residuals are white and independent of the input,
/// whatever the spectrum of the input; fitted parameters make it smaller. Wrong models leave a multiple. Rows of
/// missing samples and of the warm-up do not count. Infinite statistic when the residuals are not finite, no degrees
/// and a statistic of zero when there are too few samples for a lag or the residuals vanish.
///
/// Sources: Ljung 1999, section 16.6 (correlations with past residuals and inputs); Breusch 1978 and Godfrey 1978 (the
/// regression and its statistic).
NoiseTest noise_test(const Predictor& predictor, const Eigen::VectorXd& p, const NoiseTestOptions& options = {});

}  // namespace blockid
