#include <blockid/cli/garnier2004.hpp>

#include <blockid/cli/report/decibels.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/unstable_poles.hpp>
#include <blockid/data/metrics.hpp>
#include <blockid/estimators/continuous_fit.hpp>
#include <blockid/problems/measured.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Lines 1, 3, .. 199 of the period are excited.
constexpr Index kLastLine = 199;
/// 0.6 s, as in figure 3.
constexpr Index kSamplesOfFigure3 = 300;
constexpr double kPublished = 0.95;
/// Of a coefficient of determination over another interval than the printed one.
constexpr double kNear = 0.02;
constexpr double kWanted = 0.96;

double line(const Record& record, Index k) {
  return 2.0 * std::numbers::pi * static_cast<double>(k) / (record.sample_time_s * static_cast<double>(record.period));
}

RationalBasis localising(const Record& record, Index numerator_degree, Index order) {
  return localising_basis(break_points(line(record, 1), line(record, kLastLine), order), numerator_degree);
}

ContinuousFitOptions with(ContinuousMethod method, InitialState initial_state) {
  ContinuousFitOptions options;
  options.method = method;
  options.initial_state = initial_state;
  return options;
}

/// Of the whole record, simulated with the initial state that fits it best.
VectorXd simulated(const ContinuousFit& fit, const Record& record, InitialState initial_state) {
  ContinuousSimulation options;
  options.initial_state = initial_state;
  return simulate(fit.model, record, options);
}

double determination(const VectorXd& y, const VectorXd& yhat) {
  return yhat.allFinite() ? evaluate_metrics(y, yhat).r2 : -std::numeric_limits<double>::infinity();
}

/// Refined estimates of 5/5 and 4/4 models: the first that is stable and at which the iterations ended.
std::optional<ContinuousFit> best_of_ours(const Record& record) {
  for (const Index order : {Index{5}, Index{4}}) {
    const ContinuousFit fit =
        fit_continuous(record, localising(record, order, order),
                       with(ContinuousMethod::refined_instrumental_variables, InitialState::estimated));
    if (!fit.flags.unstable && !fit.flags.not_converged) return fit;
  }
  return std::nullopt;
}

/// Y / U at the excited lines.
struct MeasuredLines {
  VectorXd omega;
  VectorXcd response;
};
MeasuredLines measured_lines(const Record& record) {
  MeasuredLines result{VectorXd((kLastLine + 1) / 2), VectorXcd((kLastLine + 1) / 2)};
  for (Index i = 0; i < result.omega.size(); ++i) {
    const Index k = 2 * i + 1;
    std::complex<double> u = 0.0;
    std::complex<double> y = 0.0;
    for (Index t = 0; t < record.period; ++t) {
      const double turn = static_cast<double>(k * t % record.period) / static_cast<double>(record.period);
      const std::complex<double> wave = std::polar(1.0, -2.0 * std::numbers::pi * turn);
      u += record.u[t] * wave;
      y += record.y[t] * wave;
    }
    result.omega[i] = line(record, k);
    result.response[i] = y / u;
  }
  return result;
}

VectorXd degrees(const VectorXcd& g) { return 180.0 / std::numbers::pi * g.array().arg(); }

Picture figure_2(const Record& record, const ContinuousFit& published, const ContinuousFit& ours) {
  const MeasuredLines dots = measured_lines(record);
  const VectorXd omega = break_points(line(record, 1), line(record, kLastLine), 600);
  const VectorXcd iv = response_at(published.model, omega);
  const VectorXcd refined = response_at(ours.model, omega);
  const auto panel = [](const std::string& label, int column) {
    const std::string k = std::to_string(column);
    return "set ylabel " + cli::plot_text(label) + "\nplot $dots using 1:" + k +
           " with points pt 7 ps 0.4 lc rgb '#9ca3af' title 'fifth period', $model using 1:" + k +
           " with lines ls 3 title 'IV-FLBF', $model using 1:" + std::to_string(column + 2) +
           " with lines ls 2 title 'SRIVC-FLBF'\n";
  };
  return {"figure_2", "Bode plot of the models of the robot arm",
          data_block("dots", {dots.omega, decibels(dots.response), degrees(dots.response)}) +
              data_block("model", {omega, decibels(iv), degrees(iv), decibels(refined), degrees(refined)}) +
              "set logscale x\nset multiplot layout 2,1\nset xlabel ''\n" + panel("magnitude [dB]", 2) +
              "set xlabel 'frequency [rad/s]'\n" + panel("phase [deg]", 3) + "unset multiplot\n",
          900, 560};
}

Picture figure_3(const Record& record, const VectorXd& published, const VectorXd& ours) {
  const VectorXd t =
      VectorXd::LinSpaced(kSamplesOfFigure3, 0.0, static_cast<double>(kSamplesOfFigure3 - 1) * record.sample_time_s);
  return {
      "figure_3", "Seventh period: measured and simulated",
      data_block(
          "y", {t, record.y.head(kSamplesOfFigure3), published.head(kSamplesOfFigure3), ours.head(kSamplesOfFigure3)}) +
          "set xlabel 'time [s]'\nset ylabel 'acceleration'\n"
          "plot $y using 1:2 with lines ls 1 title 'measured', $y using 1:3 with lines ls 3 title 'IV-FLBF', $y using "
          "1:4 with lines ls 2 title 'SRIVC-FLBF'\n",
      900, 360};
}

}  // namespace

Reproduction garnier2004_robot_arm(std::uint64_t) {
  const problems::Problem problem = problems::robot_arm();
  const Record& fifth = problem.train.records.front();
  const Record& seventh = problem.test.records.front();
  const ContinuousFitOptions iv = with(ContinuousMethod::instrumental_variables, InitialState::estimated);
  const ContinuousFit svf = fit_continuous(fifth, state_variable_basis(5, 5, line(fifth, kLastLine)), iv);
  const ContinuousFit flbf = fit_continuous(fifth, localising(fifth, 5, 5), iv);
  const std::optional<ContinuousFit> ours = best_of_ours(fifth);
  const VectorXd of_flbf = simulated(flbf, seventh, InitialState::estimated);
  Reproduction result;
  const double whole = determination(seventh.y, of_flbf);
  result.figures = {{"IV-SVF: unstable poles", std::nullopt, unstable_poles(svf), "at least 1: no reasonable model",
                     svf.flags.unstable},
                    {"IV-FLBF: unstable poles", std::nullopt, unstable_poles(flbf), "0", !flbf.flags.unstable},
                    {"IV-FLBF: coefficient of determination, whole seventh period", kPublished, whole,
                     "within " + number(kNear), std::abs(whole - kPublished) <= kNear}};
  if (!ours) {
    result.figures.push_back({"SRIVC-FLBF: stable models", std::nullopt, 0.0, "at least 1", false});
    return result;
  }
  const VectorXd of_ours = simulated(*ours, seventh, InitialState::periodic);
  const double reached = determination(seventh.y, of_ours);
  result.figures.push_back(
      {"SRIVC-FLBF: unstable poles", std::nullopt, unstable_poles(*ours), "0", !ours->flags.unstable});
  result.figures.push_back({"SRIVC-FLBF: coefficient of determination, whole seventh period in steady state",
                            kPublished, reached, "at least " + number(kWanted), reached >= kWanted});
  result.pictures = {figure_2(fifth, flbf, *ours), figure_3(seventh, of_flbf, of_ours)};
  for (Picture& picture : result.pictures) picture.script = kFigureStyles + picture.script;
  result.notes = {
      "The coefficient of determination of 0.95 is given for an interval of 0.6 s that is not named; ours are over all "
      "8.2 s.",
      "Break points are not printed; ours span the excited lines, 0.77 to 153 rad/s.",
      "The data do not support a fifth pole: the refined 5/5 model moves it about zero without coming to rest, the 4/4 "
      "model comes to rest, stable."};
  return result;
}

}  // namespace blockid::cli
