#include <blockid/cli/garnier2004.hpp>

#include <blockid/cli/report/decibels.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/unstable_poles.hpp>
#include <blockid/estimators/continuous_fit.hpp>
#include <blockid/problems/garnier2004.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;
using problems::Garnier2004Experiment;

constexpr double kSnrDb = 20.0;
/// Of a condition number that depends on phases and holds that are not printed.
constexpr double kCondition = 0.05;

RationalBasis localising() { return localising_basis(problems::garnier2004_break_points(), 7); }
RationalBasis state_variable() { return state_variable_basis(8, 7, problems::kGarnier2004SvfPole); }

ContinuousFitOptions with(ContinuousMethod method, Hold hold, bool smoothed = false) {
  ContinuousFitOptions options;
  options.method = method;
  options.input_hold = hold;
  options.output_hold = hold;
  options.smoothed_regressand = smoothed;
  return options;
}
ContinuousFitOptions least_squares(Hold hold, bool smoothed = false) {
  return with(ContinuousMethod::least_squares, hold, smoothed);
}

/// 500 frequencies from 2 to 6000 rad/s and the four resonances, ascending.
VectorXd grid_with_resonances() {
  VectorXd omega(504);
  omega << break_points(2.0, 6000.0, 500), problems::Garnier2004::omega_rad_s();
  std::sort(omega.begin(), omega.end());
  return omega;
}

/// |G| of the model over |G| of the system, in dB.
VectorXd error_db(const ContinuousFit& fit) {
  const VectorXd omega = grid_with_resonances();
  return decibels(response_at(fit.model, omega)) - decibels(problems::garnier2004_response(omega));
}

double largest_error_db(const ContinuousFit& fit) { return error_db(fit).cwiseAbs().maxCoeff(); }

ReproducedFigure at_most(const std::string& quantity, double reproduced, double limit) {
  return {quantity, std::nullopt, reproduced, "at most " + number(limit), reproduced <= limit};
}
ReproducedFigure at_least(const std::string& quantity, double reproduced, double limit) {
  return {quantity, std::nullopt, reproduced, "at least " + number(limit), reproduced >= limit};
}
ReproducedFigure relative(const std::string& quantity, double published, double reproduced) {
  return {quantity, published, reproduced, "within " + number(100.0 * kCondition) + " %",
          std::abs(reproduced / published - 1.0) <= kCondition};
}

Picture figure_1(const ContinuousFit& svf, const ContinuousFit& flbf) {
  const VectorXd omega = grid_with_resonances();
  return {
      "figure_1",
      "Magnitude of the eighth-order system and of its models by the state-variable filter and by localising functions",
      data_block("g", {omega, decibels(problems::garnier2004_response(omega)), decibels(response_at(svf.model, omega)),
                       decibels(response_at(flbf.model, omega))}) +
          "set logscale x\nset xrange [2:6000]\nset xlabel 'frequency [rad/s]'\nset ylabel 'magnitude [dB]'\n"
          "plot $g using 1:3 with lines ls 3 title 'LS-SVF, first-order hold', $g using 1:2 with lines ls 1 title "
          "'system', $g using 1:4 with lines lc rgb '#2563eb' lw 1.6 dt 2 title 'LS-FLBF, cubic spline'\n",
      900, 420};
}

/// A hold and its model.
struct Held {
  std::string name;
  ContinuousFit fit;
};

Picture errors_picture(const std::vector<Held>& holds) {
  std::vector<VectorXd> columns = {grid_with_resonances()};
  std::string plots;
  const std::vector<std::string> colours = {"#dc2626", "#b45309", "#2563eb", "#047857"};
  for (std::size_t k = 0; k < holds.size(); ++k) {
    columns.emplace_back(error_db(holds[k].fit).cwiseAbs().cwiseMax(1e-15));
    plots += (k == 0 ? "plot " : ", ") + std::string("$e using 1:") + std::to_string(k + 2) +
             " with lines lw 1.4 lc rgb '" + colours[k % colours.size()] + "' title " + plot_text(holds[k].name);
  }
  return {
      "errors", "Error of localising models by the hold of their filters",
      data_block("e", columns) +
          "set logscale xy\nset xrange [2:6000]\nset format y '10^{%L}'\nset xlabel 'frequency [rad/s]'\nset ylabel "
          "'error of the magnitude [dB]'\n" +
          plots + "\n",
      900, 420};
}

/// Distance of the mode at 4000 rad/s from the true one, in standard deviations of an efficient estimator.
struct FastMode {
  double least_squares = 0.0;
  double refined = 0.0;
};
FastMode fast_mode(std::uint64_t seed) {
  Garnier2004Experiment experiment;
  experiment.steady_state = false;
  experiment.snr_db = kSnrDb;
  experiment.seed = seed;
  const Record record = problems::garnier2004_record(experiment);
  const ContinuousFit refined =
      fit_continuous(record, localising(), with(ContinuousMethod::refined_instrumental_variables, Hold::cubic));
  const ContinuousFit biased = fit_continuous(record, localising(), least_squares(Hold::cubic));
  const double deviation = refined.pole_deviations.frequency[6];
  const std::complex<double> truth = problems::garnier2004_poles()[6];
  const auto distance = [&](const ContinuousFit& fit) {
    const VectorXcd found = poles(fit.model);
    Index nearest = 0;
    (found.array() - truth).abs().minCoeff(&nearest);
    return std::abs(std::abs(found[nearest]) - std::abs(truth)) / deviation;
  };
  return {distance(biased), distance(refined)};
}

std::vector<std::string> garnier2004_notes() {
  return {
      "(15) prints the numerator s^(k-1) p_k inside the product; it belongs in front of it.",
      "(22) and (24) let the terms of the input begin at F_(n-1); theta has n of them, F_n to F_1. With n - 1 the "
      "system is "
      "not in the class of models.",
      "Phases and amplitudes of the multisine, the initial state, the hold of the filters and the fit in numbers are "
      "not "
      "printed. We take unit amplitudes and, for 4120, one draw of phases from rest; the phases of Schroeder in steady "
      "state give 1242.",
      "1.4e14 is the condition number under first-order hold; with exact filters it is 1e18 and more. The instability "
      "of "
      "the state-variable model comes of that hold times the condition, not of rounding.",
      "Under first-order hold the localising model is unstable, too: its mode at 4000 rad/s is wrong by more than its "
      "damping at 50 samples a period. A better hold, or the regressand (y(t-1) + 10 y(t) + y(t+1)) / 12, gives the "
      "fit "
      "that the paper shows."};
}

}  // namespace

Reproduction garnier2004(std::uint64_t seed) {
  const Record steady = problems::garnier2004_record();
  Garnier2004Experiment printed;
  printed.steady_state = false;
  printed.input = problems::garnier2004_multisine(problems::garnier2004_printed_phases());
  const ContinuousFit svf = fit_continuous(steady, state_variable(), least_squares(Hold::first_order));
  const ContinuousFit draw =
      fit_continuous(problems::garnier2004_record(printed), localising(), least_squares(Hold::cubic));
  std::vector<Held> holds;
  const auto held = [&](const std::string& name, const ContinuousFitOptions& options) -> const ContinuousFit& {
    holds.push_back({name, fit_continuous(steady, localising(), options)});
    return holds.back().fit;
  };
  Reproduction result;
  result.figures.push_back(relative("condition number, SVF, first-order hold", 1.4e14, svf.condition_normalised));
  result.figures.push_back(relative("condition number, FLBF, a draw of phases", 4120.0, draw.condition_normalised));
  result.figures.push_back(at_least("unstable poles, LS-SVF, first-order hold", unstable_poles(svf), 1.0));
  result.figures.push_back(at_least("largest error, LS-SVF, first-order hold [dB]", largest_error_db(svf), 3.0));
  const ContinuousFit first_order = held("first-order hold", least_squares(Hold::first_order));
  result.figures.push_back(at_least("unstable poles, LS-FLBF, first-order hold", unstable_poles(first_order), 1.0));
  result.figures.push_back(
      at_most("largest error, LS-FLBF, first-order hold, smoothed regressand [dB]",
              largest_error_db(held("the same, smoothed regressand", least_squares(Hold::first_order, true))), 2e-2));
  const ContinuousFit cubic = held("cubic spline", least_squares(Hold::cubic));
  result.figures.push_back({"condition number, FLBF, steady state", std::nullopt, cubic.condition_normalised,
                            "1241.8778, that of exact filters, within 1e-5",
                            std::abs(cubic.condition_normalised / 1241.8778 - 1.0) <= 1e-5});
  result.figures.push_back(at_most("unstable poles, LS-FLBF, cubic spline", unstable_poles(cubic), 0.0));
  result.figures.push_back(at_most("largest error, LS-FLBF, cubic spline [dB]", largest_error_db(cubic), 3e-3));
  result.figures.push_back(at_most("largest error, LS-FLBF, septic spline [dB]",
                                   largest_error_db(held("septic spline", least_squares(Hold::septic))), 1e-8));
  const FastMode noisy = fast_mode(seed);
  result.figures.push_back(
      at_least("noise at 20 dB: mode at 4000 rad/s off by, LS-FLBF [deviations]", noisy.least_squares, 10.0));
  result.figures.push_back(at_most("the same, SRIVC [deviations]", noisy.refined, 4.0));
  result.pictures = {figure_1(svf, cubic), errors_picture(holds)};
  for (Picture& picture : result.pictures) picture.script = kFigureStyles + picture.script;
  result.notes = garnier2004_notes();
  return result;
}

}  // namespace blockid::cli
