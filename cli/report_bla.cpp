#include <blockid/cli/bla_outcome.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/metrics_table.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/figures.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/cli/text_table.hpp>

#include <cmath>

namespace blockid::cli {
namespace {

void add_orders(HtmlPage& page, const BlaOutcome& outcome) {
  if (outcome.table.empty()) return;
  page.heading("Orders");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t k = 0; k < outcome.table.size(); ++k) {
    const BlaScore& score = outcome.table[k];
    rows.push_back({to_text(score.orders), number(score.rmse), number(score.aic, 8), number(score.bic, 8),
                    std::isnan(score.validation_rmse) ? "-" : number(score.validation_rmse), marks(outcome, k)});
  }
  page.table({"orders", "RMSE", "AIC", "BIC", "test RMSE", ""}, rows);
}

void add_roots(HtmlPage& page, const BlaOutcome& outcome, const LinearRoots& roots) {
  const double sample_time_s = outcome.bla.model.sample_time_s;
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const char* what, const std::vector<std::complex<double>>& list) {
    for (const std::complex<double>& root : list) {
      rows.push_back(
          {what, to_text(root), number(std::abs(root), 5), number(natural_frequency_hz(root, sample_time_s), 5)});
    }
  };
  add("pole", roots.poles);
  add("zero", roots.zeros);
  if (!rows.empty()) page.table({"", "root", "modulus", "natural frequency [Hz]"}, rows);
}

void add_parameters(HtmlPage& page, const BlaOutcome& outcome) {
  page.heading("Parameters");
  std::vector<std::vector<std::string>> rows;
  const std::vector<std::string> names = outcome.bla.model.chain.parameter_names();
  for (Index k = 0; k < outcome.bla.model.parameters.size(); ++k) {
    rows.push_back({names[static_cast<std::size_t>(k)], number(outcome.bla.model.parameters[k], 8),
                    outcome.covariance.size() > 0 ? number(std::sqrt(outcome.covariance(k, k)), 3) : "-"});
  }
  page.table({"name", "value", "standard deviation"}, rows);
}

}  // namespace

std::string bla_report(const BlaOutcome& outcome) {
  const bool gnuplot = gnuplot_is_there();
  const Model& model = outcome.bla.model;
  HtmlPage page("Best linear approximation of " + model.output_name + " from " + model.input_name);
  page.paragraph(outcome.source + ", sampled every " + number(model.sample_time_s) + " s (" +
                 number(1.0 / model.sample_time_s) + " Hz); samples " + to_text(outcome.train_ranges) +
                 (outcome.test ? ", tested on " + to_text(outcome.test_ranges) : "") + ".");
  page.paragraph("Output error, deviations from the means; " + to_text(outcome.orders) + ", " + outcome.choice + ".");
  for (const std::string& warning : outcome.warnings) page.warning(warning);
  if (!gnuplot) page.warning(kGnuplotMissing);
  add_orders(page, outcome);

  page.heading("How good it is");
  const std::string unit = outcome.output_unit.empty() ? "" : " [" + outcome.output_unit + "]";
  std::vector<std::vector<std::string>> rows = {
      with_warmup(short_metrics_row("train", outcome.train.total), outcome.train.total)};
  if (outcome.test) rows.push_back(with_warmup(short_metrics_row("test", outcome.test->total), outcome.test->total));
  page.table({"data", "RMSE" + unit, "NRMSE", "fit %", "R²", "samples", "warm-up"}, rows);
  page.paragraph("What is left is noise and whatever of the system is not linear.");

  page.heading("Frequency response");
  const LeafBlock leaf = leaf_blocks(model).front();
  const ScoredRecord& first = outcome.train.records.front();
  const bool complete = first.record.weights.size() == 0 || first.record.weights.minCoeff() > 0.0;
  const BodeBand points = complete ? measured_response(first.record) : BodeBand{};
  const Eigen::VectorXd frequencies = logarithmic_frequencies(model.sample_time_s, kBodeDecades, kBodePoints);
  add_figure(
      page,
      bode_figure("G", bode_band(leaf.block, leaf.parameters, outcome.covariance, frequencies, model.sample_time_s),
                  {.response = points}),
      gnuplot);
  if (outcome.measured) {
    for (const std::string& text : verdict_texts(*outcome.measured)) page.paragraph(text);
    add_figure(page, lines_figure(*outcome.measured, leaf), gnuplot);
  }
  const LinearRoots roots = bla_roots(outcome);
  add_figure(page, pole_zero_figure("G", roots), gnuplot);
  add_roots(page, outcome, roots);

  const ScoredRecord& shown = outcome.test ? outcome.test->records.front() : first;
  const std::vector<Range>& ranges = outcome.test ? outcome.test_ranges : outcome.train_ranges;
  if (shown.yhat.allFinite()) {
    page.heading("Simulation");
    const std::string set = outcome.test ? "test" : "training";
    add_figure(page, zoom_figure(shown, set, ranges.front().begin), gnuplot);
    add_figure(page, spectrum_figure(shown, set), gnuplot);
  }
  add_parameters(page, outcome);
  return page.text();
}

}  // namespace blockid::cli
