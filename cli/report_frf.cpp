#include <blockid/cli/frf_outcome.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/figures.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/report_continuous.hpp>
#include <blockid/cli/report_evaluation.hpp>
#include <blockid/cli/text_table.hpp>

#include <cmath>
#include <numbers>
#include <optional>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

constexpr double kPointSize = 0.5;

/// Modulus of the difference of model and data beside the standard deviation of the data, in dB of the response.
Figure difference_figure(const FrfOutcome& outcome) {
  const FrequencyResponse& g = outcome.data.response;
  const Eigen::VectorXcd difference = response_at(outcome.fit.model, g.omega_rad_s) - g.response;
  const auto size_db = [&](const VectorXd& size) {
    return VectorXd(size.unaryExpr([](double v) { return v > 0.0 ? 20.0 * std::log10(v) : std::nan(""); }));
  };
  std::vector<VectorXd> columns = {g.omega_rad_s / (2.0 * std::numbers::pi), magnitude_db(g),
                                   size_db(difference.cwiseAbs())};
  const bool has_deviation = g.standard_deviation.size() > 0;
  if (has_deviation) columns.push_back(size_db(g.standard_deviation));
  Figure figure{.id = "frf-difference",
                .title = "What the model leaves of the data",
                .caption = "Modulus of the difference beside the response itself" +
                           std::string(has_deviation ? " and the standard deviation of the points." : "."),
                .script = {}};
  figure.script = std::string(kFigureStyles) + data_block("d", columns) +
                  "set logscale x\nset xlabel 'frequency [Hz]'\nset ylabel 'magnitude [dB]'\n"
                  "plot $d using 1:2 with points pt 7 ps 0.4 lc rgb '#9ca3af' title 'data', $d using 1:3 with points "
                  "pt 7 ps 0.4 lc rgb '#dc2626' title 'difference'" +
                  (has_deviation ? ", $d using 1:4 with lines ls 2 title 'standard deviation'" : "") + "\n";
  return figure;
}

BodeBand data_points(const FrequencyResponse& g) {
  BodeBand points;
  points.frequency_hz = g.omega_rad_s / (2.0 * std::numbers::pi);
  points.magnitude_db = magnitude_db(g);
  points.phase_deg = phase_deg(g);
  return points;
}

}  // namespace

std::string frf_report(const FrfOutcome& outcome) {
  const bool gnuplot = gnuplot_is_there();
  const FrequencyFit& fit = outcome.fit;
  const FrequencyRange band = band_of(outcome.data.response);
  HtmlPage page("Rational model of the frequency response in " + outcome.source);
  page.paragraph(outcome.source + ": " + outcome.data.origin + "; " +
                 std::to_string(outcome.data.response.response.size()) + " tones fitted, " + number(band.low) + " to " +
                 number(band.high) + " rad/s.");
  page.paragraph("Basis " + blockid::to_text(fit.model.basis.kind) + ", degrees " +
                 std::to_string(fit.model.basis.numerator_degree) + " over " + std::to_string(fit.model.basis.order) +
                 "; method " + blockid::to_text(outcome.options.method) + ", weights " +
                 blockid::to_text(outcome.options.weighting) + ", " + std::to_string(fit.iterations) + " iterations.");
  for (const std::string& warning : outcome.warnings) page.warning(warning);
  if (!gnuplot) page.warning(kGnuplotMissing);

  page.heading("How good it is");
  page.table({"relative error, RMS", "largest [dB]", "largest [deg]", "condition", "columns of unit norm", "rank",
              "drift of |A/E|"},
             {{number(relative_rms(outcome)), number(outcome.largest_db, 4), number(outcome.largest_deg, 4),
               number(fit.condition, 4), number(fit.condition_normalised, 4),
               std::to_string(fit.rank) + " of " + std::to_string(fit.covariance.rows()), number(fit.drift, 4)}});

  std::optional<Shown> shown;
  if (outcome.simulation) {
    add_metrics_table(page, *outcome.simulation, std::nullopt, outcome.simulation->records.front().record.output_unit);
    shown = shown_record(*outcome.simulation, outcome.data.ranges, std::nullopt, {});
    add_simulation(page, *shown, gnuplot);
  }

  page.heading("Frequency response");
  add_continuous_figures(page, fit.model, known_covariance(fit), band,
                         {.response = data_points(outcome.data.response),
                          .label = "data",
                          .caption = "Points: the data.",
                          .size = kPointSize},
                         gnuplot);
  add_figure(page, difference_figure(outcome), gnuplot);
  if (shown) add_residuals(page, *shown, gnuplot);
  add_summary(page, outcome.summary);
  return page.text();
}

}  // namespace blockid::cli
