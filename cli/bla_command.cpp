#include <blockid/cli/bla_outcome.hpp>
#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/interrupt.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/progress_display.hpp>
#include <blockid/cli/report_fit.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/refit.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

namespace blockid::cli {
namespace {

constexpr int kOrdersWithoutDelay = 2;
constexpr int kOrdersWithDelay = 3;

BlaOrders given_orders(const std::vector<int>& orders) {
  if (orders.size() != kOrdersWithoutDelay && orders.size() != kOrdersWithDelay) {
    fail("--orders: expected NB,NA or NB,NA,NK, got ", orders.size(), " numbers");
  }
  return {orders[0], orders[1], orders.size() == kOrdersWithDelay ? orders[2] : 0};
}

/// Covariance that holds under nonlinear distortions, too: they colour the residual.
Eigen::MatrixXd robust_covariance(const BestLinearApproximation& bla, const DataSet& data,
                                  const PredictionOptions& prediction) {
  CovarianceOptions options;
  options.prediction = prediction;
  options.hold_gauges = false;
  options.robust = true;
  Eigen::MatrixXd result = covariance(bla.model, data, options).parameters;
  if (!result.allFinite()) result.resize(0, 0);
  return result;
}

}  // namespace

int run_bla(const BlaCommand& command) {
  const InterruptGuard guard;
  if (command.transient_periods > 0 && command.data.period < 1) {
    fail("--transient-periods: expected --period N with the samples in one period of the input");
  }
  check_outputs({command.json, command.report});
  if (!command.report.empty()) announce_missing_gnuplot(std::cerr);
  BlaOptions options;
  options.prediction = prediction_options(command.scoring, command.data.period);
  std::vector<BlaScore> table;
  BlaOrders orders;
  std::string choice = "as given";
  if (!command.orders.empty()) orders = given_orders(command.orders);
  const SplitData data = split(load(command.data), command.ranges);

  BestLinearApproximation bla = [&] {
    ProgressDisplay display(progress_style(command.run.quiet), std::cerr, command.data.output_unit);
    options.progress = [&display](const Progress& progress) { return display(progress); };
    if (command.orders.empty()) {
      table = bla_order_table(data.train, data.test, command.max_order, command.max_delay, options,
                              thread_count(command.run));
      orders = best_score(table).orders;
      choice = data.test.records.empty() ? "smallest BIC" : "smallest test RMSE";
    }
    return best_linear_approximation(data.train, orders, options);
  }();

  BlaOutcome outcome{.bla = std::move(bla)};
  outcome.source = command.data.file;
  outcome.input_unit = command.data.input_unit;
  outcome.output_unit = command.data.output_unit;
  outcome.train_ranges = data.train_ranges;
  outcome.test_ranges = data.test_ranges;
  outcome.prediction = options.prediction;
  outcome.table = std::move(table);
  outcome.choice = choice;
  outcome.orders = orders;
  outcome.warnings = data.warnings;
  const DataSet train = deviations(data.train, outcome.bla);
  outcome.train = evaluate(outcome.bla.model, train, options.prediction, outcome.bla.refit.initial_states);
  if (!data.test.records.empty()) {
    outcome.test = evaluate(outcome.bla.model, deviations(data.test, outcome.bla), options.prediction);
  }
  outcome.measured = measure_bla(data.train, command.data.period > 0, command.transient_periods, outcome.warnings);
  outcome.covariance = robust_covariance(outcome.bla, train, options.prediction);
  const bool cancelled = interrupted();
  if (cancelled) outcome.warnings.emplace_back("interrupted: this is the best result so far");

  if (!command.run.quiet) print_bla(std::cout, outcome);
  std::cout.flush();
  if (!command.json.empty()) write_output(command.json, json_text(bla_json(outcome)));
  if (!command.report.empty()) write_output(command.report, bla_report(outcome));
  if (cancelled) return kInterrupted;
  return std::isfinite(outcome.bla.rmse) ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
