#include <blockid/cli/measured_bla.hpp>

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/json_lists.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/decibels.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

/// "12.3 dB below"
std::string beside(double decibels) {
  return fixed_number(std::abs(decibels), 1) + (decibels > 0.0 ? " dB above" : " dB below");
}

std::string percent(double share) { return number(100.0 * share, 3) + " %"; }

std::string p_value_statement(double p_value) {
  constexpr double kLeast = 1e-6;
  return p_value < kLeast ? "p < 1e-6" : "p = " + number(p_value, 2);
}

/// "... 12.3 dB below the linear output (5.9 % of its power)"
std::string against_linear(double decibels, double power, double linear) {
  return beside(decibels) + " the linear output (" + percent(power / linear) + " of its power)";
}

std::string kind_text(Nonlinearity kind) {
  switch (kind) {
    case Nonlinearity::none:
      return "none";
    case Nonlinearity::weak:
      return "weak";
    case Nonlinearity::clear:
      return "clear";
    case Nonlinearity::strong:
      return "strong";
    case Nonlinearity::unknown:
      break;
  }
  return "unknown";
}

std::string distortion_text(const MeasuredBla& measured) {
  const NonlinearityVerdict& verdict = measured.verdict;
  const BlaPowers& power = verdict.powers;
  if (!(power.linear > 0.0)) return "No linear output to compare noise and nonlinear distortion with.";
  if (verdict.kind == Nonlinearity::none) {
    return "No nonlinear distortion above the noise (" + p_value_statement(verdict.p_value) + "); the noise lies " +
           against_linear(verdict.noise_db, power.noise, power.linear) + ".";
  }
  if (verdict.kind != Nonlinearity::unknown) {
    const double over_noise = 10.0 * std::log10(power.distortion / power.noise);
    return "Nonlinear distortion is " + kind_text(verdict.kind) + ": " +
           against_linear(verdict.distortion_db, power.distortion, power.linear) + ", " +
           (std::isfinite(over_noise) ? beside(over_noise) + " the noise." : "without noise.");
  }
  if (!std::isnan(power.rest)) {
    return "Noise and nonlinear distortion together lie " + against_linear(verdict.rest_db, power.rest, power.linear) +
           "; to tell them apart takes several realisations of a periodic input, two periods each.";
  }
  return "The noise lies " + against_linear(verdict.noise_db, power.noise, power.linear) +
         "; nonlinear distortion shows with several realisations only, a range for each.";
}

std::string vanishing_text(const VanishingBla& test) {
  const std::string numbers =
      "(" + p_value_statement(test.p_value) + ", significance " + percent(test.significance) + ")";
  if (!test.vanishes) {
    return "The linear output is significant " + numbers + " and explains " + percent(test.explained) +
           " of the output's power.";
  }
  return "The linear approximation vanishes: the linear output is not significant beside noise and distortion " +
         numbers + ". The nonlinearity may be even, and a start from the linear model will not do.";
}

VectorXd hertz(const FrequencyResponse& response) { return response.omega_rad_s / (2.0 * std::numbers::pi); }

}  // namespace

std::optional<MeasuredBla> measure_bla(const DataSet& data, bool periodic, Index transient_periods,
                                       std::vector<std::string>& warnings) {
  try {
    PeriodicBlaOptions options;
    options.transient_periods = transient_periods;
    MeasuredBla measured{
        .lines = periodic ? periodic_bla(data, options) : local_polynomial_bla(data), .verdict = {}, .vanishing = {}};
    measured.verdict = nonlinearity(measured.lines);
    if (measured.lines.total_variance.size() > 0) measured.vanishing = bla_vanishes(measured.lines);
    return measured;
  } catch (const Error& error) {
    warnings.push_back(std::string("no frequency response without a model: ") + error.what());
    return std::nullopt;
  }
}

std::string method_text(const MeasuredBla& measured) {
  const NonparametricBla& lines = measured.lines;
  const std::string realisations =
      std::to_string(lines.realisations) + (lines.realisations == 1 ? " realisation" : " realisations");
  const std::string count = std::to_string(lines.response.response.size()) + " lines";
  if (lines.periods == 0) {
    return "local polynomial method, " + realisations + ", " + count + ", " + std::to_string(lines.total_dof) +
           " degrees of freedom each";
  }
  return "robust method, " + realisations + " of " + std::to_string(lines.periods) +
         (lines.periods == 1 ? " period, " : " periods, ") + count + ", degrees of freedom: noise " +
         std::to_string(lines.noise_dof) + ", total " + std::to_string(lines.total_dof);
}

std::vector<std::string> verdict_texts(const MeasuredBla& measured) {
  std::vector<std::string> texts = {distortion_text(measured)};
  if (measured.vanishing) texts.push_back(vanishing_text(*measured.vanishing));
  return texts;
}

Json measured_json(const MeasuredBla& measured) {
  const NonparametricBla& lines = measured.lines;
  const NonlinearityVerdict& verdict = measured.verdict;
  Json result;
  result["method"] = lines.periods == 0 ? "local polynomial" : "robust";
  result["realisations"] = lines.realisations;
  result["periods"] = lines.periods;
  result["noise_degrees_of_freedom"] = lines.noise_dof;
  result["total_degrees_of_freedom"] = lines.total_dof;
  result["distortion"] = {{"kind", kind_text(verdict.kind)},
                          {"p_value", finite_or_null(verdict.p_value)},
                          {"linear_power", finite_or_null(verdict.powers.linear)},
                          {"distortion_power", finite_or_null(verdict.powers.distortion)},
                          {"noise_power", finite_or_null(verdict.powers.noise)},
                          {"rest_power", finite_or_null(verdict.powers.rest)},
                          {"distortion_db", finite_or_null(verdict.distortion_db)},
                          {"noise_db", finite_or_null(verdict.noise_db)},
                          {"rest_db", finite_or_null(verdict.rest_db)}};
  if (measured.vanishing) {
    const VanishingBla& test = *measured.vanishing;
    result["vanishing"] = {{"vanishes", test.vanishes},
                           {"statistic", finite_or_null(test.statistic)},
                           {"degrees_of_freedom", test.degrees_of_freedom},
                           {"p_value", test.p_value},
                           {"significance", test.significance},
                           {"explained", finite_or_null(test.explained)}};
  }
  result["verdict"] = verdict_texts(measured);
  result["frequency_hz"] = numbers_json(hertz(lines.response));
  result["real"] = numbers_json(lines.response.response.real());
  result["imaginary"] = numbers_json(lines.response.response.imag());
  result["noise_variance"] = numbers_json(lines.noise_variance);
  result["total_variance"] = numbers_json(lines.total_variance);
  result["distortion_variance"] = numbers_json(lines.distortion_variance);
  return result;
}

Figure lines_figure(const MeasuredBla& measured, const LeafBlock& model) {
  const NonparametricBla& lines = measured.lines;
  const VectorXd frequency = hertz(lines.response);
  const BodeBand curve = bode_band(model.block, model.parameters, {}, frequency, lines.response.sample_time_s);
  Figure figure{.id = "bla-lines",
                .title = "Frequency response line by line, with its deviations",
                .caption = "No model behind the points: " + method_text(measured) +
                           ". Standard deviations are those of the points; the distortion is that of one realisation, "
                           "drawn where its estimate is positive.",
                .script = {},
                .height = 400};
  std::vector<VectorXd> columns = {frequency, magnitude_db(lines.response), curve.magnitude_db};
  std::string plot =
      "plot $d using 1:2 with points pt 7 ps 0.35 lc rgb '#6b7280' title 'measured', $d using 1:3 with lines ls 2 "
      "title 'model'";
  const auto add = [&](const VectorXd& variance, const char* colour, const char* title) {
    if (variance.size() == 0) return;
    columns.push_back(power_decibels(variance));
    plot += ", $d using 1:" + std::to_string(columns.size()) + " with points pt 7 ps 0.25 lc rgb '" + colour +
            "' title '" + title + "'";
  };
  add(lines.noise_variance, "#059669", "deviation, noise");
  add(lines.total_variance, "#dc2626", "deviation, noise and distortion");
  add(lines.distortion_variance, "#f59e0b", "distortion");
  figure.script = std::string(kFigureStyles) + data_block("d", columns) +
                  "set xlabel 'frequency [Hz]'\nset ylabel 'magnitude [dB]'\nset xrange [" +
                  number(std::min(frequency[0], 0.5 * frequency[frequency.size() - 1]), 10) + ":" +
                  number(frequency[frequency.size() - 1], 10) + "]\nset logscale x\n" + plot + "\n";
  return figure;
}

}  // namespace blockid::cli
