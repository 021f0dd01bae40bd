// Ceres's Levenberg-Marquardt over the unknowns of a residual function.
#pragma once

#include <blockid/estimators/detail/elapsed.hpp>
#include <blockid/estimators/predictor_cost.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/estimators/residual_function.hpp>

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace blockid::detail {

/// sqrt(sum r^2 / counted samples).
inline double rmse_of(double sum_of_squares, const ResidualFunction& residuals) {
  return std::sqrt(sum_of_squares / static_cast<double>(residuals.counted_samples()));
}

/// When to stop, and whom to tell.
struct SearchOptions {
  int max_iterations = 300;
  double function_tolerance = 1e-10;
  double parameter_tolerance = 1e-12;
  ProgressCallback progress = {};
  /// Told after every step that was taken: rmse, and the share by which the cost fell.
  std::function<void(double rmse, double decrease)> after_step = {};
};

/// The unknowns q that a cost function shows to Ceres.
struct SearchSpace {
  Eigen::VectorXd start;
  /// Positions of those that keep their values.
  std::vector<int> constant = {};
  /// Limits of all of q, infinite where there are none; empty for no limits at all.
  ParameterBounds bounds = {};
};

struct SearchResult {
  Eigen::VectorXd q;
  FitStatus status = FitStatus::diverged;
  /// Ceres's own account of how it ended.
  std::string message = {};
  int iterations = 0;
};

/// What Ceres is handed: all rows when they are few, for a QR factorisation that does not square their condition.
Handover handover_for(ResidualForm form, const ResidualFunction& residuals);

/// argmin_q |cost(q)|^2 + sum of |other(q)|^2 from space.start. `cost` hands over `residuals` in the form `handover`;
/// all cost functions belong to the caller. began: where the elapsed time of progress counts from.
SearchResult levenberg_marquardt(ceres::CostFunction& cost, const std::vector<ceres::CostFunction*>& others,
                                 SearchSpace space, const SearchOptions& options, Handover handover,
                                 const ResidualFunction& residuals, Clock::time_point began);

}  // namespace blockid::detail
