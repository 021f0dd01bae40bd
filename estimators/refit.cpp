#include <blockid/estimators/refit.hpp>

#include <blockid/blocks/detail/infinity.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/free_unknowns.hpp>
#include <blockid/estimators/detail/gram_parts.hpp>
#include <blockid/estimators/detail/levenberg_marquardt.hpp>
#include <blockid/estimators/detail/local_covariance.hpp>
#include <blockid/estimators/detail/state_damping.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/predictor_cost.hpp>
#include <blockid/estimators/static_parameters.hpp>

#include <ceres/cost_function.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace blockid {
namespace {

using detail::kInfinity;
using detail::rmse_of;
using detail::seconds_since;

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

std::vector<Index> all_unknowns(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  for (Index k = 0; k < count; ++k) all[static_cast<std::size_t>(k)] = k;
  return all;
}

/// The part of the unknowns in `shown` as Ceres sees it.
detail::SearchSpace space_of(const Eigen::VectorXd& p, const std::vector<Index>& shown, const std::vector<Index>& fixed,
                             const ParameterBounds& bounds) {
  detail::SearchSpace space{.start = p(shown), .constant = constant_positions(shown, fixed)};
  space.bounds.lower = Eigen::VectorXd::Constant(space.start.size(), -kInfinity);
  space.bounds.upper = Eigen::VectorXd::Constant(space.start.size(), kInfinity);
  for (std::size_t k = 0; k < shown.size(); ++k) {
    if (!is_bounded(bounds, shown[k])) continue;
    space.bounds.lower[static_cast<Index>(k)] = bounds.lower[shown[k]];
    space.bounds.upper[static_cast<Index>(k)] = bounds.upper[shown[k]];
  }
  return space;
}

detail::SearchOptions search_options(const RefitOptions& options) {
  return {options.max_iterations, options.function_tolerance, options.parameter_tolerance, options.progress, {}};
}

/// One search: what is to be minimised, and what goes with it.
struct Task {
  const Model& model;
  const Predictor& predictor;
  const Eigen::VectorXd& p;
  const std::vector<Index>& fixed;
  const ParameterBounds& bounds;
  const RefitOptions& options;
  double initial_rmse;
  detail::Clock::time_point began;
};

detail::SearchResult search(const Task& task, ceres::CostFunction& cost, const std::vector<Index>& shown,
                            Handover handover) {
  const std::unique_ptr<PenaltyCost> penalty = penalty_cost(task.options, task.model, shown, task.predictor);
  detail::StateDamping damping(task.predictor, task.p, shown, task.initial_rmse);
  std::vector<ceres::CostFunction*> others;
  if (penalty) others.push_back(penalty.get());
  if (!damping.empty()) others.push_back(&damping);
  detail::SearchOptions options = search_options(task.options);
  options.after_step = [&damping](double rmse, double decrease) { damping.follow(rmse, decrease); };
  return detail::levenberg_marquardt(cost, others, space_of(task.p, shown, task.fixed, task.bounds), options, handover,
                                     task.predictor, task.began);
}

detail::SearchResult search_jointly(const Task& task) {
  const Handover handover = detail::handover_for(task.options.residual_form, task.predictor);
  PredictorCost cost(task.predictor, handover);
  return search(task, cost, all_unknowns(task.predictor.unknown_count()), handover);
}

detail::SearchResult search_eliminated(const Task& task, const std::vector<Index>& eliminated) {
  EliminatedCost cost(task.predictor, eliminated, task.p, local_bases(task.model.chain));
  detail::SearchResult result = search(task, cost, cost.remaining(), Handover::compressed);
  const Eigen::VectorXd complete = cost.complete(result.q);
  result.q = complete.size() > 0 ? complete : task.p;
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
  if (report.status == FitStatus::converged && detail::is_poor(*report.covariance)) {
    report.status = FitStatus::ill_conditioned;
  }
}

/// Ceres writes to stderr when they do at its start.
bool derivatives_overflow(const Predictor& predictor, const Eigen::VectorXd& p, double rmse) {
  constexpr double kHugeRmse = 1e50;
  if (rmse <= kHugeRmse) return false;
  NormalEquations sums(predictor.unknown_count() + 1);
  return !predictor.accumulate(p, sums);
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
  const detail::Clock::time_point began = detail::Clock::now();
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
  if (derivatives_overflow(predictor, p, report.initial_rmse)) {
    report.message = "the start does not give finite derivatives";
    report.wall_seconds = seconds_since(began);
    return report;
  }
  const Task task{report.model, predictor, p, fixed.all, bounds, options, report.initial_rmse, began};
  const detail::SearchResult found = eliminated.empty() ? search_jointly(task) : search_eliminated(task, eliminated);
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
