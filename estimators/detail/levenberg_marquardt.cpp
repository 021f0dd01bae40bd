#include <blockid/estimators/detail/levenberg_marquardt.hpp>

#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <utility>

namespace blockid::detail {
namespace {

/// Numbers of a Jacobian up to which Ceres gets all rows, for a QR factorisation that does not square its condition
/// number; above it, compressed rows are several times faster (bench/refit_bench).
constexpr Index kFullFormLimit = 20'000;
/// Steps in a row that may lead to residuals that are not finite before the solver gives up.
constexpr int kMaxInvalidSteps = 30;

Index jacobian_size(const ResidualFunction& residuals) { return residuals.sample_count() * residuals.unknown_count(); }

/// Hands Ceres's iterations to those who want to know.
class IterationBridge final : public ceres::IterationCallback {
 public:
  IterationBridge(const SearchOptions& options, const ResidualFunction& residuals, Clock::time_point start)
      : options_(options), residuals_(residuals), start_(start) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const double rmse = rmse_of(2.0 * summary.cost, residuals_);
    if (options_.after_step && summary.iteration > 0 && summary.step_is_successful) {
      options_.after_step(rmse, summary.cost_change / (summary.cost + summary.cost_change));
    }
    if (!options_.progress || options_.progress({summary.iteration, rmse, seconds_since(start_)})) {
      return ceres::SOLVER_CONTINUE;
    }
    cancelled_ = true;
    return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

  bool cancelled() const { return cancelled_; }

 private:
  const SearchOptions& options_;
  const ResidualFunction& residuals_;
  Clock::time_point start_;
  bool cancelled_ = false;
};

void set_bounds(ceres::Problem& problem, double* q, const ParameterBounds& bounds) {
  for (Index k = 0; k < bounds.lower.size(); ++k) {
    if (std::isfinite(bounds.lower[k])) problem.SetParameterLowerBound(q, static_cast<int>(k), bounds.lower[k]);
    if (std::isfinite(bounds.upper[k])) problem.SetParameterUpperBound(q, static_cast<int>(k), bounds.upper[k]);
  }
}

ceres::Solver::Options solver_options(const SearchOptions& options, bool normal_equations) {
  ceres::Solver::Options result;
  result.minimizer_type = ceres::TRUST_REGION;
  result.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  result.linear_solver_type = normal_equations ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_QR;
  result.max_num_iterations = options.max_iterations;
  result.function_tolerance = options.function_tolerance;
  result.parameter_tolerance = options.parameter_tolerance;
  result.gradient_tolerance = 0.0;
  result.max_num_consecutive_invalid_steps = kMaxInvalidSteps;
  result.logging_type = ceres::SILENT;
  result.minimizer_progress_to_stdout = false;
  result.num_threads = 1;
  return result;
}

FitStatus status_of(const ceres::Solver::Summary& summary, bool cancelled) {
  if (cancelled) return FitStatus::cancelled;
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
      return FitStatus::converged;
    case ceres::NO_CONVERGENCE:
      return FitStatus::max_iterations;
    default:
      return FitStatus::diverged;
  }
}

}  // namespace

Handover handover_for(ResidualForm form, const ResidualFunction& residuals) {
  switch (form) {
    case ResidualForm::full:
      return Handover::full;
    case ResidualForm::compressed:
      return Handover::compressed;
    case ResidualForm::triangle:
      return Handover::triangle;
    case ResidualForm::automatic:
      break;
  }
  return jacobian_size(residuals) <= kFullFormLimit ? Handover::full : Handover::compressed;
}

SearchResult levenberg_marquardt(ceres::CostFunction& cost, const std::vector<ceres::CostFunction*>& others,
                                 SearchSpace space, const SearchOptions& options, Handover handover,
                                 const ResidualFunction& residuals, Clock::time_point began) {
  SearchResult result{.q = std::move(space.start)};
  if (std::ssize(space.constant) == result.q.size()) {
    result.status = FitStatus::converged;
    result.message = "no free parameter remains to be searched";
    return result;
  }
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  double* const q = result.q.data();
  const int size = static_cast<int>(result.q.size());
  problem.AddParameterBlock(q, size);
  set_bounds(problem, q, space.bounds);
  if (!space.constant.empty()) problem.SetManifold(q, new ceres::SubsetManifold(size, space.constant));
  problem.AddResidualBlock(&cost, nullptr, q);
  for (ceres::CostFunction* other : others) problem.AddResidualBlock(other, nullptr, q);
  ceres::Solver::Options settings =
      solver_options(options, handover == Handover::full && jacobian_size(residuals) > kFullFormLimit);
  IterationBridge bridge(options, residuals, began);
  settings.callbacks.push_back(&bridge);
  ceres::Solver::Summary summary;
  ceres::Solve(settings, &problem, &summary);
  result.status = status_of(summary, bridge.cancelled());
  result.message = summary.message;
  result.iterations = std::max(static_cast<int>(summary.iterations.size()) - 1, 0);
  return result;
}

}  // namespace blockid::detail
