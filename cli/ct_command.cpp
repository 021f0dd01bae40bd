#include <blockid/cli/commands.hpp>
#include <blockid/cli/continuous_options.hpp>
#include <blockid/cli/ct_outcome.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report_fit.hpp>

#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/continuous_chain.hpp>
#include <blockid/estimators/continuous_delay.hpp>
#include <blockid/estimators/trend_fit.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

namespace blockid::cli {
namespace {

bool by_trends(const CtCommand& command) { return command.method == "goodwin" || command.method == "tustin"; }

/// Options of one family of methods do not belong to the other.
void check_options(const CtCommand& command) {
  if (command.refit && !command.without.empty()) {
    fail("--refit: estimates all coefficients, those of --without, too; leave one of the two out");
  }
  if (!by_trends(command)) return;
  const std::vector<std::pair<const char*, bool>> of_filters = {{"--break-points", !command.break_points.empty()},
                                                                {"--hold", !command.hold.empty()},
                                                                {"--iv", command.iv},
                                                                {"--no-relocate", command.no_relocate},
                                                                {"--max-iterations", command.max_iterations > 0}};
  for (const auto& [option, given] : of_filters) {
    if (given) fail(option, ": does not belong to --method ", command.method, ", only to flbf, svf and srivc");
  }
}

/// Trends start where their first row does, so a record from rest is what their simulation shows best.
ScoringOptions scoring_of(const CtCommand& command) {
  ScoringOptions scoring = command.scoring;
  if (scoring.initial_state.empty()) scoring.initial_state = by_trends(command) ? "zero" : "estimated";
  return scoring;
}

TrendStructure trend_structure_of(const CtCommand& command) {
  if (command.orders.size() != 2 || command.orders[0] < 0 || command.orders[1] <= command.orders[0]) {
    fail("--orders: expected NB,NA with 0 <= NB < NA");
  }
  const TrendScheme scheme = command.method == "goodwin" ? TrendScheme::goodwin : TrendScheme::tustin;
  TrendStructure structure = full_trends(scheme, command.orders[0], command.orders[1], command.delay);
  const MissingCoefficients missing = parse_without(command.without, {command.orders[0], command.orders[1]});
  for (const Index power : missing.denominator) std::erase(structure.a, power);
  for (const Index power : missing.numerator) std::erase(structure.b, power);
  return structure;
}

CtEstimate trends(const CtCommand& command, const DataSet& data, const PredictionOptions& prediction) {
  const TrendStructure structure = trend_structure_of(command);
  CtEstimate estimate = estimate_of(command.max_delay > 0 ? fit_trends_with_delay(data, structure, command.max_delay)
                                                          : fit_trends(data, structure));
  if (command.refit) refit_estimate(estimate, with_late_input(data, estimate.delay, estimate.delay), prediction);
  return estimate;
}

/// The estimate as a chain that simulates the record's samples.
Model chain_of(const CtEstimate& estimate, const Record& record) {
  Model model = as_model(estimate.transfer_function, {record.sample_time_s, estimate.hold}, estimate.covariance);
  if (estimate.delay > 0) {
    const ChildParameters g = top_level_blocks(model).front();
    model.chain = Series({{"", AnyBlock(Delay(estimate.delay))}, {g.label, g.block}});
  }
  model.input_name = record.input_name;
  model.output_name = record.output_name;
  model.input_unit = record.input_unit;
  model.output_unit = record.output_unit;
  return model;
}

/// Numerical rank does not tell of inputs that excite too little: noise and transients fill it.
void add_excitation(CtOutcome& outcome, const DataSet& data) {
  const Excitation excited = excitation(data);
  outcome.estimate.details["excitation"] = excitation_json(excited, outcome.estimate.coefficients);
  const std::string lack = text_of_lack(excited, outcome.estimate.coefficients);
  if (!lack.empty()) outcome.warnings.push_back(lack);
}

CtOutcome outcome_of(const CtCommand& command) {
  check_options(command);
  const PredictionOptions prediction = prediction_options(scoring_of(command), command.data.period);
  const LoadedRecord loaded = load(command.data);
  const Record& record = loaded.record;
  const SplitData data = split(loaded, command.ranges);
  CtEstimate estimate = by_trends(command) ? trends(command, data.train, prediction)
                                           : continuous_estimate(command, data.train, prediction);
  Model model = chain_of(estimate, record);
  CtOutcome outcome{.source = command.data.file,
                    .method = command.method,
                    .estimate = std::move(estimate),
                    .model = std::move(model),
                    .prediction = prediction,
                    .train_ranges = data.train_ranges,
                    .test_ranges = data.test_ranges,
                    .train = {},
                    .test = std::nullopt,
                    .tests = {},
                    .warnings = data.warnings};
  add_excitation(outcome, data.train);
  for (const std::string& warning : outcome.estimate.warnings) outcome.warnings.push_back(warning);
  const auto evaluated = [&](const DataSet& records) {
    return by_trends(command) ? evaluate(outcome.model, records, prediction)
                              : evaluate(outcome.estimate, outcome.model, records, prediction);
  };
  outcome.train = evaluated(data.train);
  outcome.model.initial_state = outcome.train.records.front().model.initial_state;
  if (!data.test.records.empty()) outcome.test = evaluated(data.test);
  outcome.tests = judge_simulations(outcome.train, outcome.test);
  return outcome;
}

bool finite(const CtOutcome& outcome) {
  return std::isfinite(outcome.train.total.rmse) && (!outcome.test || std::isfinite(outcome.test->total.rmse));
}

}  // namespace

int run_ct(const CtCommand& command) {
  check_outputs({command.outputs.model, command.outputs.json, command.outputs.report});
  if (!command.outputs.report.empty()) announce_missing_gnuplot(std::cerr);
  const CtOutcome outcome = outcome_of(command);
  for (const std::string& warning : outcome.warnings) std::cerr << "blockid: warning: " << warning << '\n';
  if (!command.quiet) print_ct(std::cout, outcome);
  std::cout.flush();
  if (!command.outputs.model.empty()) write_output(command.outputs.model, to_json(outcome.model));
  if (!command.outputs.json.empty()) write_output(command.outputs.json, json_text(ct_json(outcome)));
  if (!command.outputs.report.empty()) write_output(command.outputs.report, ct_report(outcome));
  return finite(outcome) ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
