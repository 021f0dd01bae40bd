// Levenberg-Marquardt refit of a model on measured data.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/predictor.hpp>

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace blockid {

/// How a refit ended.
enum class FitStatus { converged, max_iterations, diverged, cancelled, ill_conditioned };

/// "converged", "max_iterations", ...
std::string to_text(FitStatus status);

/// State of a running refit.
struct FitProgress {
  int iteration = 0;
  /// sqrt(sum r^2 / counted samples), in units of the output.
  double rmse = 0.0;
  double elapsed_s = 0.0;
};

/// Called after every iteration; false cancels, the best parameters so far are kept.
using ProgressCallback = std::function<bool(const FitProgress&)>;

/// What Ceres is handed; automatic takes full for short records and compressed for long ones.
enum class ResidualForm { automatic, full, compressed, triangle };

/// What happens to parameters in which the chain is affine.
enum class StaticParameters {
  automatic,  ///< eliminated where the chain has some and no bounds touch them
  joint,      ///< fitted as all others
  eliminated  ///< variable projection; Error when the chain has none
};

/// Adds N (weight (theta_k - centre))^2 to the sum of squares, N counted samples: weight in units of the output for a
/// unit of the parameter.
struct Penalty {
  /// Name of the parameter, e.g. "W.alpha1".
  std::string parameter;
  double centre = 0.0;
  double weight = 0.0;
};

struct RefitOptions {
  PredictionOptions prediction = {};
  ResidualForm residual_form = ResidualForm::automatic;
  StaticParameters static_parameters = StaticParameters::automatic;
  int max_iterations = 300;
  /// Stop when the relative decrease of the cost falls below.
  double function_tolerance = 1e-10;
  /// Stop when the relative change of the parameters falls below.
  double parameter_tolerance = 1e-12;
  /// Names of parameters that keep their values, e.g. "G1.b0".
  std::vector<std::string> frozen = {};
  /// Hold the gains that neighbouring blocks could trade (gauges.hpp).
  bool hold_gauges = true;
  /// Limits of theta; the blocks' own bounds apply where none are given.
  std::optional<ParameterBounds> bounds = std::nullopt;
  /// Pulls on parameters that variable projection does not eliminate. The covariance leaves them out.
  std::vector<Penalty> penalties = {};
  /// Compute the covariance of the result.
  bool covariance = true;
  ProgressCallback progress = {};
};

/// Uncertainty of the unknowns at a minimum.
struct Covariance {
  /// (n_theta, n_theta), zero rows for parameters that were held.
  Eigen::MatrixXd parameters;
  /// (n_theta,) square roots of the diagonal; zero for held parameters.
  Eigen::VectorXd standard_deviations;
  /// s^2 = r'r / (counted samples - rank).
  double noise_variance = 0.0;
  /// Directions that the data determine, of free_count.
  Index rank = 0;
  Index free_count = 0;
  double condition = 1.0;
  /// Names of parameters that take part in undetermined directions.
  std::vector<std::string> undetermined;
};

struct RefitReport {
  Model model;
  FitStatus status = FitStatus::diverged;
  /// Ceres's own account of how it ended.
  std::string message = {};
  int iterations = 0;
  double initial_rmse = 0.0;
  double rmse = 0.0;
  double wall_seconds = 0.0;
  /// Parameters of the chain that were free: neither frozen nor held as a gauge.
  Index free_parameters = 0;
  /// Names of parameters held as gauges.
  std::vector<std::string> held = {};
  /// (n_x,) for each record when initial states were estimated.
  std::vector<Eigen::VectorXd> initial_states = {};
  std::optional<Covariance> covariance = std::nullopt;
};

/// argmin over theta (and initial states on request) of sum_t r_t^2, started at `start`, by Ceres's
/// Levenberg-Marquardt.
///
/// Throws Error for a caller's mistake: data that do not pass check(), fewer samples than parameters, unknown frozen
/// names, bounds that cross. Numerical outcomes are in `status`, never exceptions.
RefitReport refit(const Model& start, const DataSet& data, const RefitOptions& options = {});

/// Covariance s^2 (J'J)^+ of the model's free parameters, with held and frozen ones left out.
/// robust: the sandwich (J'J)^+ S (J'J)^+, S summed over batches of `batch` samples: right for coloured residuals too.
struct CovarianceOptions {
  PredictionOptions prediction = {};
  std::vector<std::string> frozen = {};
  bool hold_gauges = true;
  bool robust = false;
  Index batch = 1000;
  /// (n_x,) for each record when initial states are estimated; none: the model's own for all records.
  std::vector<Eigen::VectorXd> initial_states = {};
};
Covariance covariance(const Model& model, const DataSet& data, const CovarianceOptions& options = {});

/// yhat of the model over one record: rest, or the periodic steady state, or (estimated) from the model's initial
/// state.
Eigen::VectorXd predict(const Model& model, const Record& record, const PredictionOptions& options = {});

/// The state at the start of `record` that fits its output best, all parameters of the model kept.
Eigen::VectorXd estimate_initial_state(const Model& model, const Record& record, Index warmup = 0);

/// The model as it starts on `record`: with the state that fits the record best when states are estimated, otherwise
/// without one. What a model is judged by on data that it was not fitted to.
Model placed_on(Model model, const Record& record, const PredictionOptions& options);

}  // namespace blockid
