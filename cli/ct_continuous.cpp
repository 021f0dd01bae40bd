#include <blockid/cli/ct_outcome.hpp>

#include <blockid/cli/continuous_options.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/continuous_delay.hpp>
#include <blockid/estimators/continuous_fit.hpp>
#include <blockid/estimators/continuous_refit.hpp>
#include <blockid/estimators/excited_band.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace blockid::cli {
namespace {

/// The output of a system is smoother than a held input: a spline between its samples.
Hold output_hold(Hold input) { return input == Hold::zero_order ? Hold::cubic : input; }

ContinuousMethod method_of(const CtCommand& command) {
  if (command.method == "srivc") {
    if (command.iv) fail("--iv: belongs to --method flbf and svf; srivc refines instrumental variables itself");
    return ContinuousMethod::refined_instrumental_variables;
  }
  return command.iv ? ContinuousMethod::instrumental_variables : ContinuousMethod::least_squares;
}

Eigen::VectorXd points_of(const CtCommand& command, Index count, const DataSet& data) {
  if (!command.break_points.empty()) return parse_break_points(command.break_points, count, sampled_band(data));
  const FrequencyRange band = excited_band(data);
  return break_points(band.low, band.high, count);
}

RationalBasis basis_of(const CtCommand& command, const Degrees& degrees, const DataSet& data) {
  const Eigen::VectorXd points = points_of(command, degrees.denominator, data);
  if (command.method != "svf") return localising_basis(points, degrees.numerator);
  const double pole = std::exp(points.array().log().mean());
  return state_variable_basis(degrees.denominator, degrees.numerator, pole);
}

/// The record with its input `delay` samples late. What comes before the record: rest, the first sample, or what stands
/// a period later.
Record with_late_input(const Record& record, Index delay, InitialState state) {
  Record late = record;
  const Index count = record.u.size();
  for (Index t = 0; t < count; ++t) {
    Index source = t - delay;
    if (source < 0 && state == InitialState::periodic) source += (delay / record.period + 1) * record.period;
    if (source >= 0) {
      late.u[t] = record.u[source];
    } else {
      late.u[t] = state == InitialState::zero ? 0.0 : record.u[0];
    }
  }
  return late;
}

std::string prefilter_text(const RationalBasis& basis) {
  if (basis.kind != BasisKind::localising) return "state-variable filter, pole " + number(basis.points[0]) + " rad/s";
  return std::to_string(basis.order) + " break points from " + number(basis.points[0]) + " to " +
         number(basis.points[basis.order - 1]) + " rad/s";
}

std::vector<std::string> facts_of(const ContinuousFit& fit, const ContinuousFitOptions& options,
                                  const RationalBasis& basis, Index delay) {
  return {prefilter_text(basis) + ", " + blockid::to_text(options.method) + ", delay " + std::to_string(delay) +
              " samples, " + std::to_string(fit.iterations) + (fit.iterations == 1 ? " iteration" : " iterations"),
          std::to_string(fit.rows) + " rows, rank " + std::to_string(fit.rank) + " of " + std::to_string(fit.unknowns) +
              " (initial states included), condition " + number(fit.condition, 4) + ", with columns of unit norm " +
              number(fit.condition_normalised, 4)};
}

nlohmann::ordered_json details_of(const ContinuousFit& fit, const ContinuousFitOptions& options,
                                  const RationalBasis& basis) {
  return {{"estimator", blockid::to_text(options.method)},
          {"break_points", std::vector<double>(basis.points.begin(), basis.points.end())},
          {"output_hold", blockid::to_text(options.output_hold)},
          {"iterations", fit.iterations},
          {"rows", fit.rows},
          {"rank", fit.rank},
          {"unknowns", fit.unknowns},
          {"condition", finite_or_null(fit.condition)},
          {"condition_normalised", finite_or_null(fit.condition_normalised)},
          {"drift", finite_or_null(fit.drift)},
          {"relocations", fit.relocations},
          {"noise_standard_deviation", finite_or_null(fit.noise_deviation)},
          {"flags",
           {{"unstable", fit.flags.unstable},
            {"break_points_outside_band", fit.flags.break_points_outside_band},
            {"rank_deficient", fit.flags.rank_deficient},
            {"not_converged", fit.flags.not_converged},
            {"drift", fit.flags.drift},
            {"relocated", fit.flags.relocated}}}};
}

nlohmann::ordered_json delays_json(const std::vector<DelayTrial>& table) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const DelayTrial& trial : table) {
    list.push_back({{"delay", trial.delay},
                    {"squared_error", finite_or_null(trial.squared_error)},
                    {"absolute_error", finite_or_null(trial.absolute_error)}});
  }
  return list;
}

/// What was found of the delay.
struct FoundDelay {
  Index delay = 0;
  /// Empty when it was given.
  std::vector<DelayTrial> table;
};

void check_delay(const CtCommand& command, const DataSet& data) {
  const Index longest = std::max(command.delay, command.max_delay);
  for (const Record& record : data.records) {
    if (longest < record.u.size()) continue;
    fail(command.max_delay > 0 ? "--max-delay " : "--delay ", longest, ": expected less than the ", record.u.size(),
         " samples of ", describe(record));
  }
}

FoundDelay delay_of(const CtCommand& command, const DataSet& data, const Degrees& degrees,
                    const ContinuousFitOptions& options) {
  if (command.max_delay == 0) return {command.delay, {}};
  std::vector<DelayTrial> table = delay_table(data, basis_of(command, degrees, data), options, command.max_delay);
  const Index delay = best_delay(table).delay;
  return {delay, std::move(table)};
}

/// What is left of the highest coefficients of B decides on its degree.
struct ContinuousStructure {
  Degrees degrees;
  MissingCoefficients missing;
};

ContinuousStructure continuous_structure_of(const CtCommand& command) {
  ContinuousStructure result;
  result.degrees = parse_degrees(command.orders);
  result.missing = parse_without(command.without, result.degrees);
  while (std::erase(result.missing.numerator, result.degrees.numerator) > 0) --result.degrees.numerator;
  return result;
}

/// Coefficients that are zero but for rounding, and integrators, as what they are.
void clear_missing(ContinuousSummary& summary, const MissingCoefficients& missing) {
  const auto has = [](const std::vector<Index>& powers, Index power) {
    return std::find(powers.begin(), powers.end(), power) != powers.end();
  };
  std::erase_if(summary.coefficients, [&](const Coefficient& one) {
    const bool numerator = one.name.front() == 'b';
    return has(numerator ? missing.numerator : missing.denominator, std::stol(one.name.substr(1)));
  });
  for (Index power = 0; has(missing.denominator, power); ++power) {
    summary.poles[static_cast<std::size_t>(power)] = {0.0, 0.0, 0.0};
    summary.stable = false;
    summary.dc_gain = std::numeric_limits<double>::infinity();
  }
}

ContinuousFitOptions options_of(const CtCommand& command, const PredictionOptions& prediction,
                                const MissingCoefficients& missing) {
  ContinuousFitOptions options;
  options.method = method_of(command);
  options.input_hold = parse_hold(command.hold.empty() ? "spline3" : command.hold);
  options.output_hold = output_hold(options.input_hold);
  options.smoothed_regressand = options.input_hold == Hold::first_order;
  options.initial_state = prediction.initial_state;
  options.warmup = prediction.warmup;
  options.relocate = !command.no_relocate;
  options.zero_numerator = missing.numerator;
  options.zero_denominator = missing.denominator;
  if (command.max_iterations > 0) options.max_iterations = command.max_iterations;
  return options;
}

std::string search_text(const FoundDelay& found) {
  const DelayTrial& best = best_delay(found.table);
  return "delay " + std::to_string(found.delay) + " of 0 to " + std::to_string(found.table.size() - 1) +
         " samples by the squared error of the simulation, IQ " + number(best.squared_error) + ", IV " +
         number(best.absolute_error);
}

}  // namespace

void refit_estimate(CtEstimate& estimate, const DataSet& late, const PredictionOptions& prediction) {
  RefitOptions options;
  options.prediction = prediction;
  const ContinuousRefit refined = blockid::refit(estimate.transfer_function, late, estimate.hold, options);
  estimate.transfer_function = refined.transfer_function;
  estimate.covariance = refined.covariance;
  if (!estimate.covariance.allFinite()) estimate.covariance.resize(0, 0);
  estimate.summary = summary_of(estimate.transfer_function, estimate.covariance);
  estimate.facts.push_back("refitted to the simulation error: " + blockid::to_text(refined.report.status) + " after " +
                           std::to_string(refined.report.iterations) + " iterations");
  estimate.details["refit"] = {{"status", blockid::to_text(refined.report.status)},
                               {"iterations", refined.report.iterations}};
}

CtEstimate continuous_estimate(const CtCommand& command, const DataSet& data, const PredictionOptions& prediction) {
  const auto [degrees, missing] = continuous_structure_of(command);
  const ContinuousFitOptions options = options_of(command, prediction, missing);
  check_delay(command, data);
  const FoundDelay found = delay_of(command, data, degrees, options);
  const DataSet late = with_late_input(data, found.delay, found.delay);
  const ContinuousFit fit = fit_continuous(late, basis_of(command, degrees, late), options);
  CtEstimate estimate;
  estimate.transfer_function = fit.model;
  estimate.covariance = fit.covariance;
  estimate.delay = found.delay;
  estimate.coefficients = fit.covariance.rows() - std::ssize(missing.numerator) - std::ssize(missing.denominator);
  estimate.hold = options.input_hold;
  estimate.facts = facts_of(fit, options, fit.model.basis, found.delay);
  estimate.details = details_of(fit, options, fit.model.basis);
  if (!found.table.empty()) {
    estimate.facts.push_back(search_text(found));
    estimate.details["delays"] = delays_json(found.table);
  }
  if (!estimate.covariance.allFinite()) estimate.covariance.resize(0, 0);
  estimate.summary = summary_of(estimate.transfer_function, estimate.covariance);
  clear_missing(estimate.summary, missing);
  ContinuousFitFlags flags = fit.flags;
  if (command.refit) {
    refit_estimate(estimate, late, prediction);
    flags.unstable = !is_stable(estimate.transfer_function);
  }
  estimate.warnings = texts(flags);
  return estimate;
}

Evaluation evaluate(const CtEstimate& estimate, const Model& model, const DataSet& data,
                    const PredictionOptions& prediction) {
  const ContinuousSimulation options{estimate.hold, prediction.initial_state, prediction.warmup};
  return evaluate(model, data, prediction.warmup, [&](const Record& record) {
    return simulate(estimate.transfer_function, with_late_input(record, estimate.delay, prediction.initial_state),
                    options);
  });
}

}  // namespace blockid::cli
