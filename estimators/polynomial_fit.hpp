// Prediction-error fits of linear models with a model of their noise, and what they predict.
#pragma once

#include <blockid/data/data_set.hpp>
#include <blockid/estimators/polynomial_model.hpp>
#include <blockid/estimators/refit.hpp>

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace blockid {

struct PolynomialFitOptions {
  /// The unknown past is estimated by default: noise does not begin at rest.
  PredictionOptions prediction = {.initial_state = InitialState::estimated};
  ResidualForm residual_form = ResidualForm::automatic;
  int max_iterations = 300;
  /// Stop when the relative decrease of the cost falls below.
  double function_tolerance = 1e-10;
  /// Stop when the relative change of the parameters falls below.
  double parameter_tolerance = 1e-12;
  /// Compute the covariance of the result.
  bool covariance = true;
  ProgressCallback progress = {};
};

struct PolynomialFit {
  PolynomialModel model;
  FitStatus status = FitStatus::diverged;
  /// Ceres's own account of how it ended.
  std::string message = {};
  int iterations = 0;
  double initial_rmse = 0.0;
  /// sqrt(V), V = sum r^2 / N, over the N prediction errors that count.
  double rmse = 0.0;
  double wall_seconds = 0.0;
  Index counted_samples = 0;
  /// n, parameters and estimated initial states.
  Index unknowns = 0;
  /// V (1 + n/N) / (1 - n/N): the prediction error to expect on new data. Source: Akaike 1969.
  double final_prediction_error = 0.0;
  /// N ln V + 2 n.
  double aic = 0.0;
  /// N ln V + n ln N.
  double bic = 0.0;
  /// What the past adds to each record (PredictionError), when initial states were estimated.
  std::vector<Eigen::VectorXd> initial_states = {};
  /// s^2 (J'J)^+ of theta.
  std::optional<Covariance> covariance = std::nullopt;
};

/// argmin over theta (and the unknown past) of sum_t r_t^2, r_t the weighted one-step-ahead prediction errors, by
/// Levenberg-Marquardt from `start`. The means of `start` are kept; model.noise_variance becomes sum r^2 / (N - n).
///
/// Throws Error for what PredictionError refuses, a start that does not pass check() and fewer samples than unknowns.
/// Numerical outcomes are in `status`, never exceptions.
PolynomialFit refit(const PolynomialModel& start, const DataSet& data, const PolynomialFitOptions& options = {});

/// e (N,), one-step-ahead prediction errors of a record, unweighted: white and independent of past inputs when the
/// model is right. The unknown past is fitted to the record when initial states are estimated. Not a number where an
/// output that it takes is missing.
Eigen::VectorXd prediction_errors(const PolynomialModel& model, const Record& record,
                                  const PredictionOptions& options = {.initial_state = InitialState::estimated});

/// No outputs are used but those that the initial state is fitted to: simulation.
inline constexpr Index kSimulation = std::numeric_limits<Index>::max();

/// (N,) yhat_{t|t-k}: y_t from all inputs and the outputs up to t - k,
///
///     yhat_{t|t-k} = y_t - (h_0 e_t + h_1 e_{t-1} + ... + h_{k-1} e_{t-k+1}),   H = C/(A D) = h_0 + h_1 q^-1 + ...
///
/// k >= 1 samples, or kSimulation. The unknown past is fitted to the record's prediction errors when initial states are
/// estimated. Not a number where an output that it takes is missing. Source: Ljung 1999, equation (3.31).
Eigen::VectorXd predict(const PolynomialModel& model, const Record& record, Index k,
                        const PredictionOptions& options = {.initial_state = InitialState::estimated});

}  // namespace blockid
