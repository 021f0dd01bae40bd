#include <blockid/cli/commands.hpp>
#include <blockid/cli/continuous_options.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/frf_data.hpp>
#include <blockid/cli/frf_outcome.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report_fit.hpp>

#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/model_json.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/continuous_chain.hpp>
#include <blockid/estimators/continuous_fit.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <iostream>
#include <utility>

namespace blockid::cli {
namespace {

/// Damping ratio of a Kautz basis that is not told.
constexpr double kKautzDamping = 0.7;

/// The first of the options that only localising functions have.
void check_localising_options(const FrfCommand& command, BasisKind kind) {
  const bool localising = kind == BasisKind::localising;
  const auto refuse = [&](const char* option) {
    fail(option, ": does not belong to --basis ", command.basis, "; leave it out");
  };
  if (!localising && !command.break_points.empty()) refuse("--break-points");
  if (!localising && command.no_relocate) refuse("--no-relocate");
  if (localising && !command.point.empty()) refuse("--point");
}

double point_of(const FrfCommand& command, std::size_t index, double otherwise) {
  return index < command.point.size() ? command.point[index] : otherwise;
}

RationalBasis basis_of(const FrfCommand& command, const Degrees& degrees, const FrfData& data) {
  const FrequencyRange band = band_of(data.response);
  const BasisKind kind = basis_kind(command.basis);
  check_localising_options(command, kind);
  const std::size_t most = kind == BasisKind::kautz ? 2 : 1;
  if (command.point.size() > most) fail("--point: expected at most ", most, " numbers for --basis ", command.basis);
  const auto [nb, na] = degrees;
  const double middle = geometric_mean(band.low, band.high);
  switch (kind) {
    case BasisKind::monomial:
      return monomial_basis(na, nb, point_of(command, 0, middle));
    case BasisKind::chebyshev:
      return chebyshev_basis(na, nb, point_of(command, 0, band.high));
    case BasisKind::laguerre:
      return laguerre_basis(na, nb, point_of(command, 0, middle));
    case BasisKind::kautz:
      return kautz_basis(na, nb, point_of(command, 0, middle), point_of(command, 1, kKautzDamping));
    case BasisKind::localising:
      break;
  }
  if (!command.break_points.empty()) return localising_basis(parse_break_points(command.break_points, na, band), nb);
  const FrequencyRange place = break_point_band(data);
  return localising_basis(break_points(place.low, place.high, na), nb);
}

FrequencyFitOptions options_of(const FrfCommand& command, const FrfData& data) {
  FrequencyFitOptions options;
  options.method = frequency_method(command.method);
  options.max_iterations = command.max_iterations;
  options.relocate = !command.no_relocate;
  if (!command.weighting.empty()) {
    options.weighting = frequency_weighting(command.weighting);
  } else if (data.weighty_deviations) {
    options.weighting = FrequencyWeighting::deviation;
  }
  if (options.weighting == FrequencyWeighting::deviation && data.response.standard_deviation.size() == 0) {
    fail("--weighting deviation: the data have no standard deviations; name them by --deviation, or average periods");
  }
  return options;
}

void find_largest_differences(FrfOutcome& outcome) {
  const FrequencyResponse& g = outcome.data.response;
  const Eigen::VectorXcd model = response_at(outcome.fit.model, g.omega_rad_s);
  for (Index k = 0; k < model.size(); ++k) {
    if (g.response[k] == 0.0) continue;
    const std::complex<double> ratio = model[k] / g.response[k];
    outcome.largest_db = std::max(outcome.largest_db, std::abs(20.0 * std::log10(std::abs(ratio))));
    outcome.largest_deg = std::max(outcome.largest_deg, kDegrees * std::abs(std::arg(ratio)));
  }
}

Model saved_model(const FrfCommand& command, const FrfOutcome& outcome, const Sampling& sampling) {
  Model model = as_model(outcome.fit.model, sampling, known_covariance(outcome.fit));
  if (!command.data.input.empty()) model.input_name = command.data.input;
  if (command.data.output) model.output_name = *command.data.output;
  model.input_unit = command.data.input_unit;
  model.output_unit = command.data.output_unit;
  return model;
}

/// In steady state where periods are told and none of them is a transient.
void add_simulation(FrfOutcome& outcome, const FrfCommand& command, Hold hold) {
  if (outcome.data.records.records.empty()) return;
  // Scores come from the simulation alone; a chain there is not in every basis.
  const Model chain = outcome.model ? *outcome.model : make_model(Gain());
  outcome.simulation = evaluate(chain, outcome.data.records, 0, [&](const Record& record) {
    const bool periodic = record.period > 0 && command.transient_periods == 0;
    return simulate(outcome.fit.model, record, {hold, periodic ? InitialState::periodic : InitialState::estimated, 0});
  });
  outcome.tests = judge_simulations(*outcome.simulation, std::nullopt);
}

FrfOutcome outcome_of(const FrfCommand& command) {
  const Degrees degrees = parse_degrees(command.orders);
  const Hold hold = parse_hold(command.hold);
  FrfOutcome outcome;
  outcome.source = command.data.file;
  outcome.data = load_frf(command, hold);
  outcome.options = options_of(command, outcome.data);
  const RationalBasis basis = basis_of(command, degrees, outcome.data);
  outcome.fit = fit_frequency_response(outcome.data.response, basis, outcome.options);
  outcome.summary = summary_of(outcome.fit.model, known_covariance(outcome.fit));
  find_largest_differences(outcome);
  outcome.warnings = outcome.data.warnings;
  if (outcome.data.excitation) {
    const std::string lack = text_of_lack(*outcome.data.excitation, outcome.fit.covariance.rows());
    if (!lack.empty()) outcome.warnings.push_back(lack);
  }
  for (const std::string& text : texts(outcome.fit.flags)) outcome.warnings.push_back(text);
  // Roots of polynomials, which other bases need, may overflow: then only when it was asked for.
  const bool asked = !command.outputs.model.empty() || basis.kind == BasisKind::localising;
  if (outcome.data.sample_time_s && asked) {
    outcome.model = saved_model(command, outcome, {*outcome.data.sample_time_s, hold});
  }
  add_simulation(outcome, command, hold);
  return outcome;
}

}  // namespace

int run_frf(const FrfCommand& command) {
  check_outputs({command.outputs.model, command.outputs.json, command.outputs.report});
  if (!command.outputs.report.empty()) announce_missing_gnuplot(std::cerr);
  const FrfOutcome outcome = outcome_of(command);
  for (const std::string& warning : outcome.warnings) std::cerr << "blockid: warning: " << warning << '\n';
  if (!command.quiet) print_frf(std::cout, outcome);
  std::cout.flush();
  if (!command.outputs.model.empty()) write_output(command.outputs.model, to_json(*outcome.model));
  if (!command.outputs.json.empty()) write_output(command.outputs.json, json_text(frf_json(outcome)));
  if (!command.outputs.report.empty()) write_output(command.outputs.report, frf_report(outcome));
  return std::isfinite(outcome.fit.cost) ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
