#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/initialisers.hpp>
#include <blockid/cli/interrupt.hpp>
#include <blockid/cli/judgement.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/progress_display.hpp>
#include <blockid/cli/report_fit.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/gauges.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <utility>

namespace blockid::cli {
namespace {

/// Share of test samples outside the range of the training data from which the user is told.
constexpr double kNotableShare = 1e-3;
/// Word for a chain chosen from the data.
constexpr const char* kAutomaticModel = "wh";

/// The chain to identify and where the search begins.
struct Start {
  AnyBlock chain;
  Initialiser initialiser;
  std::string text;
  /// Set when a saved model is the start.
  std::optional<double> sample_time_s;
};

Start start_of(const FitCommand& command) {
  if (is_model_file(command.init)) {
    if (!command.model.empty()) {
      fail("--init ", command.init, ": the chain comes from the model file; leave --model out");
    }
    const Model model = load_model(command.init);
    return {model.chain, start_from(model), blockid::to_text(model.chain), model.sample_time_s};
  }
  Initialiser initialiser = initialiser_by_name(command.init, command.starts);
  if (command.model.empty()) fail("--model is required, e.g. --model \"G=rational(nb=2,na=2) | f=spline(knots=10)\"");
  try {
    return {parse(command.model), std::move(initialiser), command.model, std::nullopt};
  } catch (const Error& error) {
    fail("--model: ", error.what());
  }
}

/// Throws Error for a frozen name that the chain does not have, before any work is done.
void check_frozen(const AnyBlock& chain, const std::vector<std::string>& frozen) {
  const Model model = make_model(chain);
  for (const std::string& name : frozen) {
    try {
      static_cast<void>(parameter_index(model, name));
    } catch (const Error& error) {
      fail("--freeze: ", error.what());
    }
  }
}

/// Standard deviations that are not finite cannot be saved and mean nothing.
void drop_meaningless_deviations(FitResult& fit, std::vector<std::string>& warnings) {
  if (fit.model.standard_deviations.allFinite()) return;
  fit.model.standard_deviations.resize(0);
  fit.report.covariance.reset();
  warnings.emplace_back("the covariance of the parameters is not finite and was left out");
}

void warn_of_status(const RefitReport& report, std::vector<std::string>& warnings) {
  if (report.status == FitStatus::max_iterations) {
    warnings.emplace_back("the fit stopped at the iteration limit (--max-iterations); it may not have converged");
  }
  if (report.status == FitStatus::diverged) warnings.push_back("the fit diverged: " + report.message);
  if (report.status == FitStatus::cancelled) warnings.emplace_back("interrupted: this is the best model so far");
  if (!report.covariance || report.covariance->undetermined.empty()) return;
  warnings.push_back("the data do not determine all parameters; in doubt are " +
                     joined(report.covariance->undetermined));
}

void warn_of_unstable_poles(const Model& model, std::vector<std::string>& warnings) {
  for (const LeafBlock& leaf : leaf_blocks(model)) {
    const std::optional<LinearRoots> roots = linear_roots(leaf.block, leaf.parameters);
    if (!roots) continue;
    const bool unstable = std::any_of(roots->poles.begin(), roots->poles.end(),
                                      [](std::complex<double> pole) { return std::abs(pole) >= 1.0; });
    if (unstable) warnings.push_back(leaf.path + " has a pole on or outside the unit circle");
  }
}

void warn_of_extrapolation(const FitOutcome& outcome, std::vector<std::string>& warnings) {
  if (!outcome.test) return;
  const std::vector<LeafBlock> leaves = leaf_blocks(outcome.model());
  std::vector<double> lower(leaves.size(), std::numeric_limits<double>::infinity());
  std::vector<double> upper(leaves.size(), -std::numeric_limits<double>::infinity());
  for (const ScoredRecord& scored : outcome.train.records) {
    const std::vector<Eigen::VectorXd> inputs = leaf_inputs(scored.model, scored.record.u);
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      lower[k] = std::min(lower[k], inputs[k].minCoeff());
      upper[k] = std::max(upper[k], inputs[k].maxCoeff());
    }
  }
  std::vector<Index> outside(leaves.size(), 0);
  Index samples = 0;
  for (const ScoredRecord& scored : outcome.test->records) {
    const std::vector<Eigen::VectorXd> inputs = leaf_inputs(scored.model, scored.record.u);
    samples += scored.record.u.size();
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      outside[k] += (inputs[k].array() < lower[k] || inputs[k].array() > upper[k]).count();
    }
  }
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    const bool many = static_cast<double>(outside[k]) > kNotableShare * static_cast<double>(samples);
    if (leaves[k].block.is_linear() || !static_block_of(leaves[k].block) || !many) continue;
    warnings.push_back(std::to_string(outside[k]) + " of " + std::to_string(samples) + " test samples reach " +
                       leaves[k].path + " outside the range of the training data");
  }
}

std::vector<Index> held_parameters(const Model& model, const std::vector<std::string>& frozen) {
  std::vector<Index> held;
  for (const std::string& name : frozen) held.push_back(parameter_index(model, name));
  std::sort(held.begin(), held.end());
  held.erase(std::unique(held.begin(), held.end()), held.end());
  const std::vector<Index> gauges = gain_gauges(model.chain, model.parameters, held);
  held.insert(held.end(), gauges.begin(), gauges.end());
  std::sort(held.begin(), held.end());
  return held;
}

void write_results(const FitOutcome& outcome, const OutputOptions& outputs) {
  if (!outputs.model.empty()) write_output(outputs.model, to_json(outcome.model()));
  if (outputs.json.empty() && outputs.report.empty()) return;
  const FitJudgement tests = judge_fit(outcome);
  if (!outputs.json.empty()) write_output(outputs.json, json_text(fit_json(outcome, tests)));
  if (!outputs.report.empty()) write_output(outputs.report, fit_report(outcome, tests));
}

/// `--model wh`: everything but the family of chains is chosen from the data.
bool chooses_structure(const FitCommand& command) { return command.model == kAutomaticModel; }

/// `--orders auto`: the static block is the user's, the filters come from the data.
bool chooses_orders(const FitCommand& command) { return command.orders == "auto"; }

void check_automatic(const FitCommand& command) {
  const std::string what = chooses_structure(command) ? "--model wh" : "--orders auto";
  if (!command.frozen.empty())
    fail("--freeze: ", what, " chooses the chain itself; name one to freeze parameters of it");
  if (is_model_file(command.init)) fail(what, " chooses the start itself; leave --init ", command.init, " out");
  if (chooses_structure(command) && chooses_orders(command))
    fail("--orders auto: --model wh chooses the orders anyway");
}

/// Puts the sandwich covariance in the place of that for white residuals.
void make_robust(FitResult& fit, const DataSet& data, const FitOptions& options) {
  CovarianceOptions settings;
  settings.prediction = options.refit.prediction;
  settings.frozen = options.refit.frozen;
  settings.hold_gauges = options.refit.hold_gauges;
  settings.robust = true;
  settings.batch = batch_length(data);
  settings.initial_states = fit.report.initial_states;
  fit.report.covariance = covariance(fit.model, data, settings);
  fit.model.standard_deviations = fit.report.covariance->standard_deviations;
  fit.report.model = fit.model;
}

}  // namespace

Index batch_length(const DataSet& data) {
  constexpr Index kBatches = 200;
  constexpr Index kShortest = 20;
  constexpr Index kLongest = 1000;
  return std::clamp<Index>(total_samples(data) / kBatches, kShortest, kLongest);
}

FitOutcome make_outcome(FitResult fit, const SplitData& data, const PredictionOptions& prediction,
                        const std::vector<std::string>& frozen) {
  FitOutcome outcome{.fit = std::move(fit)};
  outcome.held = held_parameters(outcome.fit.model, frozen);
  const Record& record = data.train.records.front();
  outcome.input_name = record.input_name;
  outcome.output_name = record.output_name;
  outcome.input_unit = record.input_unit;
  outcome.output_unit = record.output_unit;
  outcome.sample_time_s = record.sample_time_s;
  outcome.train_ranges = data.train_ranges;
  outcome.test_ranges = data.test_ranges;
  outcome.prediction = prediction;
  outcome.warnings = data.warnings;

  Model& model = outcome.fit.model;
  model.sample_time_s = record.sample_time_s;
  model.input_name = record.input_name;
  model.output_name = record.output_name;
  model.input_unit = record.input_unit;
  model.output_unit = record.output_unit;
  drop_meaningless_deviations(outcome.fit, outcome.warnings);
  outcome.train = evaluate(model, data.train, prediction, outcome.fit.report.initial_states);
  model.initial_state = outcome.train.records.front().model.initial_state;
  if (!data.test.records.empty()) outcome.test = evaluate(model, data.test, prediction);
  warn_of_status(outcome.fit.report, outcome.warnings);
  warn_of_unstable_poles(model, outcome.warnings);
  warn_of_extrapolation(outcome, outcome.warnings);
  return outcome;
}

std::string covariance_text(const FitOutcome& outcome) {
  return outcome.robust ? "robust (sandwich), right for coloured residuals, too"
                        : "s^2 (J'J)^-1, right when the residual is white";
}

double noise_standard_deviation(const FitOutcome& outcome) {
  const std::optional<Covariance>& covariance = outcome.fit.report.covariance;
  return covariance ? std::sqrt(covariance->noise_variance) : std::numeric_limits<double>::quiet_NaN();
}

bool is_free(const FitOutcome& outcome, Index parameter) {
  return !std::binary_search(outcome.held.begin(), outcome.held.end(), parameter);
}

Index free_count(const FitOutcome& outcome) {
  return outcome.model().parameters.size() - static_cast<Index>(outcome.held.size());
}

std::string initial_state_text(InitialState state) {
  switch (state) {
    case InitialState::zero:
      return "rest";
    case InitialState::estimated:
      return "estimated from each record";
    case InitialState::periodic:
      return "periodic steady state";
  }
  return "unknown";
}

int exit_code(const FitOutcome& outcome) {
  switch (outcome.fit.report.status) {
    case FitStatus::cancelled:
      return kInterrupted;
    case FitStatus::diverged:
      return kNumericalFailure;
    default:
      return std::isfinite(outcome.train.total.rmse) ? kSuccess : kNumericalFailure;
  }
}

int run_fit(const FitCommand& command) {
  const InterruptGuard guard;
  const bool automatic = chooses_structure(command) || chooses_orders(command);
  if (automatic) check_automatic(command);
  std::optional<Start> start;
  if (!chooses_structure(command)) {
    start = start_of(command);
    check_frozen(start->chain, command.frozen);
  }
  check_outputs({command.outputs.model, command.outputs.json, command.outputs.report});
  if (!command.outputs.report.empty()) announce_missing_gnuplot(std::cerr);
  const PredictionOptions prediction = prediction_options(command.scoring, command.data.period);
  const SplitData data = split(load(command.data, start ? start->sample_time_s : std::nullopt), command.ranges);

  FitOptions options;
  options.refit.prediction = prediction;
  options.refit.max_iterations = command.max_iterations;
  options.refit.frozen = command.frozen;
  options.refit.covariance = !command.robust_covariance;
  if (command.best > 0) options.best = command.best;
  options.seed = command.run.seed;
  options.threads = thread_count(command.run);
  std::string text = start ? start->text : std::string();
  std::vector<StructureScore> tried;
  FitResult fit = [&] {
    ProgressDisplay display(progress_style(command.run.quiet), std::cerr, command.data.output_unit);
    options.progress = [&display](const Progress& progress) { return display(progress); };
    if (!automatic) return blockid::fit(start->chain, data.train, start->initialiser, options);
    AutomaticResult chosen =
        start ? fit_with_chosen_orders(start->chain, data.train, {.fit = options}, start->initialiser)
              : fit_wiener_hammerstein(data.train, {.fit = options});
    text = chosen.chain;
    tried = std::move(chosen.tried);
    return std::move(chosen.fit);
  }();

  if (command.robust_covariance) make_robust(fit, data.train, options);
  FitOutcome outcome = make_outcome(std::move(fit), data, prediction, command.frozen);
  outcome.robust = command.robust_covariance;
  outcome.source = command.data.file;
  outcome.requested_model = text;
  outcome.structures = std::move(tried);
  outcome.init = automatic ? "structures by validation" : command.init;
  outcome.seed = command.run.seed;
  outcome.threads = options.threads;
  if (!command.run.quiet) print_fit(std::cout, outcome);
  std::cout.flush();
  write_results(outcome, command.outputs);
  return exit_code(outcome);
}

}  // namespace blockid::cli
