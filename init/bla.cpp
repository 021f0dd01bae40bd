#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/filtered.hpp>
#include <blockid/estimators/detail/parallel_for.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/init/bla.hpp>
#include <blockid/init/detail/lagged_regression.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

namespace blockid {
namespace {

using detail::deviations;
using detail::Means;
using detail::means_of;

Eigen::VectorXd all_pole(const Eigen::VectorXd& denominator, const Eigen::VectorXd& signal) {
  return detail::filtered(Eigen::VectorXd::Ones(1), denominator, signal);
}

Eigen::VectorXd arx_parameters(const DataSet& data, const BlaOrders& orders, Index warmup) {
  Eigen::VectorXd theta = detail::arx_coefficients(data, orders, warmup);
  Eigen::VectorXd a(orders.na + 1);
  a[0] = 1.0;
  a.tail(orders.na) = theta.tail(orders.na);
  theta.tail(orders.na) = stabilised(a).tail(orders.na);
  return theta;
}

Model rational_model(const BlaOrders& orders, Eigen::VectorXd theta, double sample_time_s) {
  Model model = make_model(Series({{"G", Rational(orders.nb, orders.na, orders.nk)}}), sample_time_s);
  model.parameters = std::move(theta);
  return model;
}

/// sqrt(sum r^2 / counted samples), each record from its own initial state.
double output_error(const Model& model, const DataSet& data, const PredictionOptions& options) {
  double sum = 0.0;
  Index counted = 0;
  for (const Record& record : data.records) {
    const DataSet alone(record);
    const Predictor predictor(model.chain, alone, options);
    sum += predictor.sum_of_squares(detail::unknowns_of(placed_on(model, record, options), predictor));
    counted += predictor.counted_samples();
  }
  return std::sqrt(sum / static_cast<double>(counted));
}

void check_orders(const BlaOrders& orders) {
  if (orders.nb < 0 || orders.na < 0 || orders.nk < 0) {
    fail("best linear approximation: nb, na and nk must be >= 0, got nb=", orders.nb, ", na=", orders.na,
         ", nk=", orders.nk);
  }
}

}  // namespace

Model arx(const DataSet& data, const BlaOrders& orders) {
  check_orders(orders);
  check(data);
  check_sample_count(data, orders.nb + 1 + orders.na);
  return rational_model(orders, arx_parameters(data, orders, 0), data.records.front().sample_time_s);
}

Model steiglitz_mcbride(const DataSet& data, const BlaOrders& orders, const PredictionOptions& prediction,
                        int iterations) {
  Model best = arx(data, orders);
  double best_error = output_error(best, data, prediction);
  Eigen::VectorXd theta = best.parameters;
  const DataSet passable = deviations(data, {});
  for (int round = 0; round < iterations && orders.na > 0; ++round) {
    Eigen::VectorXd a(orders.na + 1);
    a[0] = 1.0;
    a.tail(orders.na) = theta.tail(orders.na);
    DataSet filtered = passable;
    for (Record& record : filtered.records) {
      record.u = all_pole(a, record.u);
      record.y = all_pole(a, record.y);
    }
    const Eigen::VectorXd next = arx_parameters(filtered, orders, prediction.warmup);
    const double change = (next - theta).norm();
    theta = next;
    const Model model = rational_model(orders, theta, best.sample_time_s);
    const double error = output_error(model, data, prediction);
    if (error < best_error) {
      best = model;
      best_error = error;
    }
    if (!(change > 1e-9 * theta.norm())) break;
  }
  return best;
}

BestLinearApproximation best_linear_approximation(const DataSet& data, const BlaOrders& orders,
                                                  const BlaOptions& options) {
  check_orders(orders);
  check(data);
  check_excitation(data);
  check_sample_count(data, orders.nb + 1 + orders.na);
  const Means means = means_of(data, options.prediction.warmup);
  const DataSet deviation = deviations(data, means);

  RefitOptions settings;
  settings.prediction = options.prediction;
  settings.max_iterations = options.max_iterations;
  settings.covariance = options.covariance;
  settings.hold_gauges = false;
  BestLinearApproximation best{.model = rational_model(orders, Eigen::VectorXd(), 1.0), .refit = {.model = best.model}};
  best.rmse = std::numeric_limits<double>::infinity();
  const std::vector<std::pair<std::string, Model>> starts = {
      {"Steiglitz-McBride", steiglitz_mcbride(deviation, orders, options.prediction, options.prefilter_iterations)},
      {"ARX", arx(deviation, orders)}};
  for (const auto& [how, start] : starts) {
    settings.progress = [&, stage = how](const FitProgress& p) {
      return !options.progress || options.progress({"best linear approximation from " + stage, p.iteration,
                                                    settings.max_iterations, p.rmse, p.elapsed_s});
    };
    RefitReport report = refit(start, deviation, settings);
    const bool first = best.how.empty();
    if (first || report.rmse < best.rmse) {
      best.model = report.model;
      best.rmse = report.rmse;
      best.how = how;
      best.refit = std::move(report);
    }
    if (best.refit.status == FitStatus::cancelled) break;
  }
  best.input_mean = means.u;
  best.output_mean = means.y;
  const Record& record = data.records.front();
  best.model.input_name = record.input_name;
  best.model.output_name = record.output_name;
  Eigen::VectorXd a(orders.na + 1);
  a[0] = 1.0;
  a.tail(orders.na) = best.model.parameters.tail(orders.na);
  best.poles = root_groups(a, 0.0);
  best.zeros = root_groups(best.model.parameters.head(orders.nb + 1));
  return best;
}

std::vector<BlaScore> bla_order_table(const DataSet& data, const DataSet& validation, Index max_order, Index max_delay,
                                      const BlaOptions& options, int threads) {
  if (max_order < 1 || max_delay < 0) {
    fail("order table: expected max_order >= 1 and max_delay >= 0, got ", max_order, " and ", max_delay);
  }
  std::vector<BlaScore> table;
  for (Index nk = 0; nk <= max_delay; ++nk) {
    for (Index n = 1; n <= max_order; ++n) table.push_back({.orders = {n, n, nk}});
  }
  BlaOptions quiet = options;
  quiet.progress = {};
  std::atomic<bool> cancelled = false;
  std::mutex progress_mutex;
  Index done = 0;
  double best = std::numeric_limits<double>::infinity();
  detail::parallel_for(table.size(), threads, [&](std::size_t k) {
    BlaScore& score = table[k];
    if (cancelled) {
      constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
      score = {score.orders, kNone, kNone, kNone, kNone};
      return;
    }
    const BestLinearApproximation bla = best_linear_approximation(data, score.orders, quiet);
    const double samples = static_cast<double>(Predictor(bla.model.chain, data, options.prediction).counted_samples());
    const double parameters = static_cast<double>(score.orders.nb + 1 + score.orders.na);
    score.rmse = bla.rmse;
    score.aic = samples * std::log(bla.rmse * bla.rmse) + 2.0 * parameters;
    score.bic = samples * std::log(bla.rmse * bla.rmse) + parameters * std::log(samples);
    score.validation_rmse = std::numeric_limits<double>::quiet_NaN();
    if (!validation.records.empty()) {
      const DataSet shifted = deviations(validation, {bla.input_mean, bla.output_mean});
      score.validation_rmse = output_error(bla.model, shifted, options.prediction);
    }
    const std::lock_guard lock(progress_mutex);
    best = std::min(best, score.rmse);
    if (options.progress && !options.progress({"order table", ++done, std::ssize(table), best, 0.0})) cancelled = true;
  });
  return table;
}

}  // namespace blockid
