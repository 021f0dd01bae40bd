#include <blockid/cli/report/residual_figures.hpp>

#include <blockid/cli/report/decibels.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>

#include <cmath>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;
using Kind = ResidualTestKind;

/// What several tests have measured, joined along their lags.
struct Correlogram {
  VectorXd lags;
  VectorXd correlations;
  VectorXd bands;
  Index outside() const { return (correlations.array().abs() > bands.array()).count(); }
};

VectorXd concatenated(const VectorXd& a, const VectorXd& b) {
  VectorXd result(a.size() + b.size());
  result << a, b;
  return result;
}

Correlogram correlogram(const ResidualTests& tests, const std::vector<Kind>& kinds) {
  Correlogram result;
  for (const Kind kind : kinds) {
    const ResidualTest* const test = tests.find(kind);
    if (test == nullptr) continue;
    result.lags = concatenated(result.lags, test->lags);
    result.correlations = concatenated(result.correlations, test->correlations);
    result.bands = concatenated(result.bands, test->bands);
  }
  return result;
}

std::string plot(const std::string& block, const std::string& title) {
  return "plot $" + block + " using 1:2 with impulses ls 2 lw 2.5 title " + plot_text(title) + ", $" + block +
         " using 1:3 with lines ls 4 title 'band', $" + block + " using 1:(-$3) with lines ls 4 notitle\n";
}

std::string lag_range(const VectorXd& lags) {
  return "set xrange [" + number(lags[0] - 0.5) + ":" + number(lags[lags.size() - 1] + 0.5) +
         "]\nset xlabel 'lag [samples]'\nset ylabel 'correlation'\n";
}

std::string outside_text(const Correlogram& shown, double significance) {
  return std::to_string(shown.outside()) + " of " + std::to_string(shown.lags.size()) + " lags lie outside the " +
         number(100.0 * (1.0 - significance), 4) + " % band";
}

Figure correlation_figure(const ResidualTests& tests, const std::vector<Kind>& kinds, const std::string& id,
                          const std::string& title, const std::string& rest) {
  const Correlogram shown = correlogram(tests, kinds);
  Figure figure{
      .id = id, .title = title, .caption = outside_text(shown, tests.significance) + rest, .script = {}, .height = 300};
  figure.script = kFigureStyles + data_block("d", {shown.lags, shown.correlations, shown.bands}) +
                  lag_range(shown.lags) + plot("d", "residual");
  return figure;
}

/// One panel for each nonlinear instrument, below one another.
Figure nonlinear_figure(const ResidualTests& tests, const std::string& set) {
  Figure figure{.id = "residual-nonlinear",
                .title = "Correlation of the residual with powers of earlier inputs and outputs, " + set + " data",
                .caption = "Means removed. Outside the bands something nonlinear of the system is not modelled. ",
                .script = kFigureStyles,
                .height = 0};
  constexpr int kPanel = 170;
  std::vector<std::string> blocks;
  std::string panels;
  for (const Kind kind : {Kind::squared_input, Kind::absolute_input, Kind::squared_output, Kind::cubed_output}) {
    const Correlogram shown = correlogram(tests, {kind});
    if (shown.lags.size() == 0) continue;
    const std::string block = "d" + std::to_string(blocks.size());
    figure.script += data_block(block, {shown.lags, shown.correlations, shown.bands});
    panels += lag_range(shown.lags) + plot(block, to_text(kind));
    figure.caption += to_text(kind) + ": " + outside_text(shown, tests.significance) + ". ";
    blocks.push_back(block);
  }
  figure.height = kPanel * static_cast<int>(blocks.size());
  figure.script += "set multiplot layout " + std::to_string(blocks.size()) + ",1\n" + panels + "unset multiplot\n";
  return figure;
}

bool has_any(const ResidualTests& tests, const std::vector<Kind>& kinds) {
  return correlogram(tests, kinds).lags.size() > 0;
}

}  // namespace

std::vector<Figure> residual_figures(const ResidualTests& tests, const std::string& set) {
  std::vector<Figure> figures;
  const std::vector<Kind> cross = {Kind::later_input, Kind::input};
  const std::vector<Kind> nonlinear = {Kind::squared_input, Kind::absolute_input, Kind::squared_output,
                                       Kind::cubed_output};
  if (has_any(tests, cross)) {
    figures.push_back(correlation_figure(
        tests, cross, "residual-cross-correlation", "Cross-correlation of input and residual, " + set + " data",
        " of independent signals; it follows from the autocorrelations of both and from what the parameters have "
        "fitted. Positive lags: the residual follows the input."));
  }
  if (has_any(tests, nonlinear)) figures.push_back(nonlinear_figure(tests, set));
  if (has_any(tests, {Kind::whiteness})) {
    figures.push_back(correlation_figure(
        tests, {Kind::whiteness}, "residual-autocorrelation", "Autocorrelation of the residual, " + set + " data",
        " of white noise. The model is an output-error model: coloured measurement noise alone leads to correlation "
        "here; what the model has missed of the input shows in the other pictures."));
  }
  return figures;
}

namespace {

/// Data $d with frequencies, the model's density and that of the noise in decibels, and the labels of both axes.
std::string densities(const VectorXd& frequency_hz, const VectorXd& of_model, const VectorXd& of_noise,
                      const std::string& unit) {
  const std::string density_unit = unit.empty() ? "1/Hz" : unit + "²/Hz";
  return kFigureStyles + data_block("d", {frequency_hz, power_decibels(of_model), power_decibels(of_noise)}) +
         "set xlabel 'frequency [Hz]'\nset ylabel " + plot_text("density [dB re " + density_unit + "]") + "\n";
}

}  // namespace

Figure periodic_error_figure(const PeriodicError& error, const std::string& unit, const std::string& set) {
  Figure figure{.id = "periodic-error",
                .title = "Error of the model beside the noise, " + set + " data",
                .caption = "What repeats in the residual of " + std::to_string(error.periods) +
                           " periods is the model's error, what does not is noise. The error is drawn where it exceeds "
                           "the noise that is left in the mean over periods.",
                .script = {},
                .height = 340};
  figure.script = densities(error.frequency_hz, error.error_density, error.noise_density, unit) +
                  "plot $d using 1:3 with lines ls 4 title 'noise of one period', $d using 1:2 with points ls 3 pt 7 "
                  "ps 0.4 title 'error of the model'\n";
  return figure;
}

Figure noise_spectrum_figure(const NoiseSpectrumTest& test, const std::string& unit, const std::string& set) {
  Figure figure{.id = "noise-spectrum",
                .title = "Residual beside a record of noise alone, " + set + " data",
                .caption = "Means over bands; " + std::to_string(test.residual_segments) +
                           " segments of the residual, " + std::to_string(test.noise_segments) +
                           " of the noise. What lies above the noise is the model's.",
                .script = {},
                .height = 340};
  figure.script = densities(test.frequency_hz, test.residual_density, test.noise_density, unit) +
                  "plot $d using 1:3 with linespoints ls 4 title 'noise', $d using 1:2 with linespoints ls 3 pt 7 "
                  "ps 0.6 title 'residual'\n";
  return figure;
}

}  // namespace blockid::cli
