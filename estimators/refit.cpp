#include <blockid/estimators/refit.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/free_unknowns.hpp>
#include <blockid/estimators/detail/gram_parts.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/predictor_cost.hpp>
#include <blockid/estimators/static_parameters.hpp>

#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

namespace blockid {
namespace {

/// Numbers of a Jacobian up to which Ceres gets all rows, for a QR factorisation that does not square its condition
/// number; above it, compressed rows are several times faster (bench/refit_bench).
constexpr Index kFullFormLimit = 20'000;
/// Steps in a row that may lead to predictions that are not finite before the solver gives up.
constexpr int kMaxInvalidSteps = 30;
/// Condition number of the scaled Jacobian from which a minimum is called ill conditioned.
constexpr double kIllConditioned = 1e10;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double rmse_of(double sum_of_squares, const Predictor& predictor) {
  return std::sqrt(sum_of_squares / static_cast<double>(predictor.counted_samples()));
}

/// Hands Ceres's iterations to the caller's progress function.
class ProgressBridge final : public ceres::IterationCallback {
 public:
  ProgressBridge(const ProgressCallback& progress, const Predictor& predictor, Clock::time_point start)
      : progress_(progress), predictor_(predictor), start_(start) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const double rmse = rmse_of(2.0 * summary.cost, predictor_);
    if (progress_({summary.iteration, rmse, seconds_since(start_)})) return ceres::SOLVER_CONTINUE;
    cancelled_ = true;
    return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

  bool cancelled() const { return cancelled_; }

 private:
  const ProgressCallback& progress_;
  const Predictor& predictor_;
  Clock::time_point start_;
  bool cancelled_ = false;
};

Handover handover_for(ResidualForm form, const Predictor& predictor) {
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
  const bool few_rows = predictor.sample_count() * predictor.unknown_count() <= kFullFormLimit;
  return few_rows ? Handover::full : Handover::compressed;
}

ParameterBounds bounds_of(const Model& model, const RefitOptions& options) {
  ParameterBounds bounds = options.bounds ? *options.bounds : model.chain.bounds();
  const Index count = model.parameters.size();
  if (bounds.lower.size() != count || bounds.upper.size() != count) {
    fail("refit: expected bounds for ", count, " parameters, got ", bounds.lower.size(), " lower and ",
         bounds.upper.size(), " upper");
  }
  for (Index k = 0; k < count; ++k) {
    if (!(bounds.lower[k] <= bounds.upper[k])) {
      fail("refit: the bounds of ", model.chain.parameter_names()[static_cast<std::size_t>(k)], " cross: [",
           bounds.lower[k], ", ", bounds.upper[k], "]");
    }
  }
  return bounds;
}

bool is_bounded(const ParameterBounds& bounds, Index k) {
  return k < bounds.lower.size() && (std::isfinite(bounds.lower[k]) || std::isfinite(bounds.upper[k]));
}

/// The start moved to the nearest point within the bounds. A frozen parameter cannot be moved.
Model within_bounds(const Model& start, const ParameterBounds& bounds, const std::vector<Index>& frozen) {
  Model model = start;
  model.parameters = start.parameters.cwiseMax(bounds.lower).cwiseMin(bounds.upper);
  for (const Index k : frozen) {
    if (model.parameters[k] == start.parameters[k]) continue;
    fail("refit: ", start.chain.parameter_names()[static_cast<std::size_t>(k)], " is frozen at ", start.parameters[k],
         ", outside its bounds [", bounds.lower[k], ", ", bounds.upper[k], "]");
  }
  return model;
}

/// The affine parameters that variable projection takes out of the search; empty for a joint fit.
std::vector<Index> eliminated_unknowns(const Model& model, const RefitOptions& options, const ParameterBounds& bounds,
                                       const std::vector<Index>& fixed) {
  if (options.static_parameters == StaticParameters::joint) return {};
  std::vector<Index> eliminated;
  for (const Index k : affine_parameters(model.chain)) {
    if (is_bounded(bounds, k)) {
      if (options.static_parameters == StaticParameters::automatic) return {};
      fail("refit: ", model.chain.parameter_names()[static_cast<std::size_t>(k)],
           " has bounds, which variable projection cannot keep; fit jointly");
    }
    if (!std::binary_search(fixed.begin(), fixed.end(), k)) eliminated.push_back(k);
  }
  if (eliminated.empty() && options.static_parameters == StaticParameters::eliminated) {
    fail("refit: the chain has no free parameters that enter it linearly, so there is nothing to eliminate");
  }
  return eliminated;
}

/// Positions of the fixed unknowns among those that the cost function shows to Ceres.
std::vector<int> constant_positions(const std::vector<Index>& shown, const std::vector<Index>& fixed) {
  std::vector<int> positions;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    if (std::binary_search(fixed.begin(), fixed.end(), shown[k])) positions.push_back(static_cast<int>(k));
  }
  return positions;
}

void set_bounds(ceres::Problem& problem, double* q, const std::vector<Index>& shown, const ParameterBounds& bounds) {
  for (std::size_t k = 0; k < shown.size(); ++k) {
    if (!is_bounded(bounds, shown[k])) continue;
    const double lower = bounds.lower[shown[k]];
    const double upper = bounds.upper[shown[k]];
    if (std::isfinite(lower)) problem.SetParameterLowerBound(q, static_cast<int>(k), lower);
    if (std::isfinite(upper)) problem.SetParameterUpperBound(q, static_cast<int>(k), upper);
  }
}

/// Rows sqrt(N) weight (q_k - centre).
class PenaltyCost final : public ceres::CostFunction {
 public:
  struct Row {
    Index position;
    double centre;
    double weight;
  };

  PenaltyCost(std::vector<Row> rows, Index unknowns) : rows_(std::move(rows)) {
    set_num_residuals(static_cast<int>(rows_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(unknowns));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Index unknowns = parameter_block_sizes().front();
    const bool tangents = jacobians != nullptr && jacobians[0] != nullptr;
    if (tangents) std::fill_n(jacobians[0], std::ssize(rows_) * unknowns, 0.0);
    for (Index k = 0; k < std::ssize(rows_); ++k) {
      const Row& row = rows_[static_cast<std::size_t>(k)];
      residuals[k] = row.weight * (parameters[0][row.position] - row.centre);
      if (tangents) jacobians[0][k * unknowns + row.position] = row.weight;
    }
    return true;
  }

 private:
  std::vector<Row> rows_;
};

/// Nothing when there are no penalties. Throws Error for a parameter that is not among the shown ones.
std::unique_ptr<PenaltyCost> penalty_cost(const RefitOptions& options, const Model& model,
                                          const std::vector<Index>& shown, const Predictor& predictor) {
  if (options.penalties.empty()) return nullptr;
  std::vector<PenaltyCost::Row> rows;
  for (const Penalty& penalty : options.penalties) {
    const auto place = std::find(shown.begin(), shown.end(), parameter_index(model, penalty.parameter));
    if (place == shown.end()) {
      fail("refit: ", penalty.parameter, " has a penalty, which variable projection cannot keep; fit jointly");
    }
    if (!std::isfinite(penalty.centre) || !(penalty.weight >= 0.0) || !std::isfinite(penalty.weight)) {
      fail("refit: the penalty of ", penalty.parameter, " needs a finite centre and a finite weight >= 0, got ",
           penalty.centre, " and ", penalty.weight);
    }
    rows.push_back({place - shown.begin(), penalty.centre,
                    penalty.weight * std::sqrt(static_cast<double>(predictor.counted_samples()))});
  }
  return std::make_unique<PenaltyCost>(std::move(rows), std::ssize(shown));
}

ceres::Solver::Options solver_options(const RefitOptions& options, Handover handover, Index jacobian_size) {
  ceres::Solver::Options result;
  result.minimizer_type = ceres::TRUST_REGION;
  result.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  const bool many_rows = handover == Handover::full && jacobian_size > kFullFormLimit;
  result.linear_solver_type = many_rows ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_QR;
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

/// Ceres's search over the shown unknowns q; the cost function belongs to the caller.
struct Search {
  Eigen::VectorXd q;
  FitStatus status = FitStatus::diverged;
  std::string message;
  int iterations = 0;
};

Search search(ceres::CostFunction& cost, ceres::CostFunction* penalty, Eigen::VectorXd q,
              const std::vector<int>& constant, const std::vector<Index>& shown, const ParameterBounds& bounds,
              const RefitOptions& options, Handover handover, const Predictor& predictor, Clock::time_point start) {
  Search result;
  if (static_cast<Index>(constant.size()) == q.size()) {
    return {std::move(q), FitStatus::converged, "no free parameter remains to be searched", 0};
  }
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  problem.AddParameterBlock(q.data(), static_cast<int>(q.size()));
  set_bounds(problem, q.data(), shown, bounds);
  if (!constant.empty()) {
    problem.SetManifold(q.data(), new ceres::SubsetManifold(static_cast<int>(q.size()), constant));
  }
  problem.AddResidualBlock(&cost, nullptr, q.data());
  if (penalty != nullptr) problem.AddResidualBlock(penalty, nullptr, q.data());
  ceres::Solver::Options settings =
      solver_options(options, handover, predictor.sample_count() * predictor.unknown_count());
  ProgressBridge bridge(options.progress, predictor, start);
  if (options.progress) settings.callbacks.push_back(&bridge);
  ceres::Solver::Summary summary;
  ceres::Solve(settings, &problem, &summary);
  result.q = std::move(q);
  result.status = status_of(summary, bridge.cancelled());
  result.message = summary.message;
  result.iterations =
      static_cast<int>(summary.iterations.size()) > 0 ? static_cast<int>(summary.iterations.size()) - 1 : 0;
  return result;
}

std::vector<Index> all_unknowns(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  for (Index k = 0; k < count; ++k) all[static_cast<std::size_t>(k)] = k;
  return all;
}

Search search_jointly(const Model& model, const Predictor& predictor, const Eigen::VectorXd& p,
                      const std::vector<Index>& fixed, const ParameterBounds& bounds, const RefitOptions& options,
                      Clock::time_point start) {
  const Handover handover = handover_for(options.residual_form, predictor);
  PredictorCost cost(predictor, handover);
  const std::vector<Index> shown = all_unknowns(predictor.unknown_count());
  const std::unique_ptr<PenaltyCost> penalty = penalty_cost(options, model, shown, predictor);
  return search(cost, penalty.get(), p, constant_positions(shown, fixed), shown, bounds, options, handover, predictor,
                start);
}

Search search_eliminated(const Model& model, const Predictor& predictor, const Eigen::VectorXd& p,
                         const std::vector<Index>& fixed, const std::vector<Index>& eliminated,
                         const ParameterBounds& bounds, const RefitOptions& options, Clock::time_point start) {
  EliminatedCost cost(predictor, eliminated, p);
  const std::vector<Index>& shown = cost.remaining();
  const std::unique_ptr<PenaltyCost> penalty = penalty_cost(options, model, shown, predictor);
  Search result = search(cost, penalty.get(), p(shown), constant_positions(shown, fixed), shown, bounds, options,
                         Handover::compressed, predictor, start);
  const Eigen::VectorXd complete = cost.complete(result.q);
  result.q = complete.size() > 0 ? complete : p;
  return result;
}

void store_states(RefitReport& report, const Predictor& predictor, const Eigen::VectorXd& p) {
  const Index states = report.model.chain.state_count();
  for (Index first = report.model.parameters.size(); first + states <= p.size() && states > 0; first += states) {
    report.initial_states.emplace_back(p.segment(first, states));
  }
  if (predictor.options().initial_state == InitialState::estimated && !report.initial_states.empty()) {
    report.model.initial_state = report.initial_states.front();
  }
}

void add_covariance(RefitReport& report, const DataSet& data, const RefitOptions& options,
                    const std::vector<Index>& fixed) {
  CovarianceOptions settings;
  settings.prediction = options.prediction;
  settings.hold_gauges = false;
  settings.frozen = detail::names_of(report.model, fixed);
  settings.initial_states = report.initial_states;
  report.covariance = covariance(report.model, data, settings);
  report.model.standard_deviations = report.covariance->standard_deviations;
  const bool poor =
      report.covariance->rank < report.covariance->free_count || report.covariance->condition > kIllConditioned;
  if (report.status == FitStatus::converged && poor) report.status = FitStatus::ill_conditioned;
}

}  // namespace

std::string to_text(FitStatus status) {
  switch (status) {
    case FitStatus::converged:
      return "converged";
    case FitStatus::max_iterations:
      return "max_iterations";
    case FitStatus::diverged:
      return "diverged";
    case FitStatus::cancelled:
      return "cancelled";
    case FitStatus::ill_conditioned:
      return "ill_conditioned";
  }
  return "unknown";
}

RefitReport refit(const Model& start, const DataSet& data, const RefitOptions& options) {
  const Clock::time_point began = Clock::now();
  check(start);
  if (options.max_iterations < 0) fail("refit: max_iterations must be >= 0, got ", options.max_iterations);
  const Predictor predictor(start.chain, data, options.prediction);
  const detail::FixedParameters fixed = detail::fixed_parameters(start, options.frozen, options.hold_gauges);
  const Index free = predictor.unknown_count() - static_cast<Index>(fixed.all.size());
  if (predictor.counted_samples() < free) {
    fail("refit: ", predictor.counted_samples(), " samples count, fewer than the ", free, " free parameters");
  }
  const ParameterBounds bounds = bounds_of(start, options);
  const std::vector<Index> eliminated = eliminated_unknowns(start, options, bounds, fixed.all);

  RefitReport report{.model = within_bounds(start, bounds, fixed.frozen)};
  report.free_parameters = start.parameters.size() - static_cast<Index>(fixed.all.size());
  report.held = detail::names_of(start, fixed.gauges);
  const Eigen::VectorXd p = detail::unknowns_of(report.model, predictor);
  report.initial_rmse = rmse_of(predictor.sum_of_squares(p), predictor);
  report.rmse = report.initial_rmse;
  if (!std::isfinite(report.initial_rmse)) {
    report.message = "the start does not give finite predictions";
    report.wall_seconds = seconds_since(began);
    return report;
  }
  const Search found =
      eliminated.empty() ? search_jointly(report.model, predictor, p, fixed.all, bounds, options, began)
                         : search_eliminated(report.model, predictor, p, fixed.all, eliminated, bounds, options, began);
  report.status = found.status;
  report.message = found.message;
  report.iterations = found.iterations;
  const double final_rmse = rmse_of(predictor.sum_of_squares(found.q), predictor);
  if (std::isfinite(final_rmse) && final_rmse <= report.initial_rmse * (1.0 + 1e-9)) {
    report.model.parameters = found.q.head(start.parameters.size());
    report.rmse = final_rmse;
    store_states(report, predictor, found.q);
  } else {
    report.status = FitStatus::diverged;
  }
  if (options.covariance) add_covariance(report, data, options, fixed.all);
  report.wall_seconds = seconds_since(began);
  return report;
}

Eigen::VectorXd predict(const Model& model, const Record& record, const PredictionOptions& options) {
  check(model);
  const DataSet data(record);
  const Predictor predictor(model.chain, data, options);
  return predictor.predict(detail::unknowns_of(model, predictor), 0);
}

Eigen::VectorXd estimate_initial_state(const Model& model, const Record& record, Index warmup) {
  if (model.chain.state_count() == 0) return {};
  RefitOptions options;
  options.prediction = {InitialState::estimated, warmup, 1};
  options.static_parameters = StaticParameters::joint;
  options.frozen = model.chain.parameter_names();
  options.hold_gauges = false;
  options.covariance = false;
  Model start = model;
  if (start.initial_state.size() == 0) start.initial_state = Eigen::VectorXd::Zero(model.chain.state_count());
  return refit(start, record, options).model.initial_state;
}

Model placed_on(Model model, const Record& record, const PredictionOptions& options) {
  if (options.initial_state == InitialState::estimated) {
    model.initial_state = estimate_initial_state(model, record, options.warmup);
  } else {
    model.initial_state.resize(0);
  }
  return model;
}

}  // namespace blockid
