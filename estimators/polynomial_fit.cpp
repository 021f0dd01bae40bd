#include <blockid/estimators/polynomial_fit.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/filtered.hpp>
#include <blockid/estimators/detail/levenberg_marquardt.hpp>
#include <blockid/estimators/detail/local_covariance.hpp>
#include <blockid/estimators/prediction_error.hpp>

#include <algorithm>
#include <cmath>

namespace blockid {
namespace {

using Eigen::VectorXd;

void store(PolynomialFit& fit, const PredictionError& function, const VectorXd& p) {
  const Index parameters = parameter_count(fit.model.orders);
  fit.model.theta = p.head(parameters);
  fit.rmse = detail::rmse_of(function.sum_of_squares(p), function);
  for (Index first = parameters; first < p.size(); first += function.state_count()) {
    fit.initial_states.emplace_back(p.segment(first, function.state_count()));
  }
}

void add_criteria(PolynomialFit& fit) {
  const double samples = static_cast<double>(fit.counted_samples);
  const double unknowns = static_cast<double>(fit.unknowns);
  const double v = fit.rmse * fit.rmse;
  fit.model.noise_variance = samples > unknowns ? v * samples / (samples - unknowns) : 0.0;
  fit.final_prediction_error =
      samples > unknowns ? v * (samples + unknowns) / (samples - unknowns) : std::numeric_limits<double>::infinity();
  fit.aic = samples * std::log(v) + 2.0 * unknowns;
  fit.bic = samples * std::log(v) + unknowns * std::log(samples);
}

/// A record with the model's prediction errors of it.
struct PlacedStates {
  PredictionError function;
  VectorXd p;

  PlacedStates(const PolynomialModel& model, const Record& record, const PredictionOptions& options)
      : function(model.orders, record, options, model.u_mean, model.y_mean),
        p(function.with_fitted_states(model.theta)) {}

  /// X of the free response.
  VectorXd past() const { return p.tail(function.state_count()); }
};

/// (B/F u - X/(D F) delta) / A and the mean: e = 0 from the first sample on.
VectorXd simulated(const PolynomialModel& model, const Record& record, const VectorXd& past) {
  const auto [a, b, c, d, f] = polynomials(model);
  const VectorXd one = VectorXd::Ones(1);
  VectorXd w = detail::filtered(b, f, record.u.array() - model.u_mean);
  VectorXd pulse = VectorXd::Zero(w.size());
  const Index count = std::min(w.size(), past.size());
  pulse.head(count) = past.head(count);
  w -= detail::filtered(one, detail::convolved(d, f), pulse);
  return detail::filtered(one, a, w).array() + model.y_mean;
}

bool has_white_noise_at_output(const PolynomialOrders& orders) {
  return orders.na == 0 && orders.nc == 0 && orders.nd == 0;
}

}  // namespace

PolynomialFit refit(const PolynomialModel& start, const DataSet& data, const PolynomialFitOptions& options) {
  const detail::Clock::time_point began = detail::Clock::now();
  check(start);
  if (options.max_iterations < 0) fail("refit: max_iterations must be >= 0, got ", options.max_iterations);
  const PredictionError function(start.orders, data, options.prediction, start.u_mean, start.y_mean);
  PolynomialFit fit{.model = start};
  fit.counted_samples = function.counted_samples();
  fit.unknowns = function.unknown_count();
  if (fit.counted_samples < fit.unknowns) {
    fail("refit: ", fit.counted_samples, " samples count, fewer than the ", fit.unknowns, " unknowns");
  }
  const VectorXd p = function.with_fitted_states(start.theta);
  fit.initial_rmse = detail::rmse_of(function.sum_of_squares(p), function);
  fit.rmse = fit.initial_rmse;
  if (!std::isfinite(fit.initial_rmse)) {
    fit.message = "the start does not give finite predictions";
    fit.wall_seconds = detail::seconds_since(began);
    return fit;
  }
  const Handover handover = detail::handover_for(options.residual_form, function);
  PredictorCost cost(function, handover);
  const detail::SearchOptions search{
      options.max_iterations, options.function_tolerance, options.parameter_tolerance, options.progress, {}};
  const detail::SearchResult found =
      detail::levenberg_marquardt(cost, {}, {.start = p}, search, handover, function, began);
  fit.status = found.status;
  fit.message = found.message;
  fit.iterations = found.iterations;
  store(fit, function, found.q);
  add_criteria(fit);
  if (options.covariance) {
    fit.covariance = detail::local_covariance(function, found.q, {}, parameter_names(start.orders));
    if (fit.status == FitStatus::converged && detail::is_poor(*fit.covariance)) {
      fit.status = FitStatus::ill_conditioned;
    }
  }
  fit.wall_seconds = detail::seconds_since(began);
  return fit;
}

VectorXd prediction_errors(const PolynomialModel& model, const Record& record, const PredictionOptions& options) {
  check(model);
  const PlacedStates placed(model, record, options);
  return placed.function.errors(placed.p, 0);
}

VectorXd predict(const PolynomialModel& model, const Record& record, Index k, const PredictionOptions& options) {
  check(model);
  if (k < 1) fail("prediction: expected a horizon of at least one sample, got ", k);
  const PlacedStates placed(model, record, options);
  if (k == kSimulation || has_white_noise_at_output(model.orders)) return simulated(model, record, placed.past());
  const Index horizon = std::min(k, record.u.size());
  VectorXd e = placed.function.errors(placed.p, 0);
  VectorXd yhat = record.y;
  Index last_unknown = -horizon;
  for (Index t = 0; t < e.size(); ++t) {
    if (std::isnan(e[t])) {
      last_unknown = t;
      e[t] = 0.0;
    }
    if (t - last_unknown < horizon) yhat[t] = std::numeric_limits<double>::quiet_NaN();
  }
  return yhat - detail::filtered(noise_impulse_response(model, horizon), VectorXd::Ones(1), e);
}

}  // namespace blockid
