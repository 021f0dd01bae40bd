#include <blockid/cli/continuous_summary.hpp>
#include <blockid/cli/ct_outcome.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/frf_data.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/cli/report_continuous.hpp>
#include <blockid/cli/report_evaluation.hpp>
#include <blockid/cli/text_table.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace blockid::cli {
namespace {

/// The response that the record shows, without that of the hold.
BodeBand measured_points(const Record& record, Hold hold) {
  const bool complete = record.weights.size() == 0 || record.weights.minCoeff() > 0.0;
  if (!complete) return {};
  BodeBand points = measured_response(record);
  const Eigen::VectorXcd held = hold_response(hold, Eigen::VectorXd(kTurn * points.frequency_hz), record.sample_time_s);
  for (Index k = 0; k < held.size(); ++k) {
    points.magnitude_db[k] -= 20.0 * std::log10(std::abs(held[k]));
    points.phase_deg[k] -= 180.0 / std::numbers::pi * std::arg(held[k]);
  }
  return points;
}

/// From the decades below the Nyquist frequency, or the slowest pole if that is slower, up to it.
FrequencyRange band_of_curve(const CtOutcome& outcome) {
  const double nyquist = std::numbers::pi / outcome.model.sample_time_s;
  FrequencyRange band{nyquist * std::pow(10.0, -kBodeDecades), nyquist};
  for (const ContinuousRoot& pole : outcome.estimate.summary.poles) {
    const double modulus = std::abs(pole.value);
    if (modulus > 0.0) band.low = std::min(band.low, 0.3 * modulus);
  }
  return band;
}

}  // namespace

std::string ct_report(const CtOutcome& outcome) {
  const bool gnuplot = gnuplot_is_there();
  const Model& model = outcome.model;
  const CtEstimate& estimate = outcome.estimate;
  HtmlPage page("Continuous-time model of " + model.output_name + " from " + model.input_name);
  page.paragraph(outcome.source + ", sampled every " + number(model.sample_time_s) + " s (" +
                 number(1.0 / model.sample_time_s) + " Hz); samples " + to_text(outcome.train_ranges) +
                 (outcome.test ? ", tested on " + to_text(outcome.test_ranges) : "") +
                 " (zero-based, half-open). Start of each simulated record: " +
                 initial_state_text(outcome.prediction.initial_state) +
                 "; input between samples: " + blockid::to_text(estimate.hold) + ".");
  page.paragraph("Method " + outcome.method + ".");
  for (const std::string& fact : estimate.facts) page.paragraph(fact + ".");
  for (const std::string& warning : outcome.warnings) page.warning(warning);
  if (!gnuplot) page.warning(kGnuplotMissing);

  page.heading("How good the model is");
  add_metrics_table(page, outcome.train, outcome.test, model.output_unit);
  const Shown shown = shown_record(outcome.train, outcome.train_ranges, outcome.test, outcome.test_ranges);
  add_simulation(page, shown, gnuplot);

  page.heading("Frequency response");
  if (estimate.delay > 0) page.paragraph("Without the delay of the input, which the points have been freed of, too.");
  BodeBand points = measured_points(outcome.train.records.front().record, estimate.hold);
  const double turn_per_hz = 360.0 * static_cast<double>(estimate.delay) * model.sample_time_s;
  if (points.phase_deg.size() > 0) points.phase_deg += turn_per_hz * points.frequency_hz;
  add_continuous_figures(page, estimate.transfer_function, estimate.covariance, band_of_curve(outcome),
                         {.response = std::move(points)}, gnuplot);
  add_residuals(page, shown, gnuplot);
  add_summary(page, estimate.summary);
  return page.text();
}

}  // namespace blockid::cli
