#include <blockid/cli/report_evaluation.hpp>

#include <blockid/cli/metrics_table.hpp>
#include <blockid/cli/report/figures.hpp>
#include <blockid/cli/report/residual_figures.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/validation/residual_tests.hpp>

#include <algorithm>

namespace blockid::cli {
namespace {

/// The parameters count as exact.
void add_correlations(HtmlPage& page, const Shown& shown, bool gnuplot) {
  const ScoredRecord& scored = *shown.scored;
  const ResidualRecord record{scored.record.u, scored.yhat, scored_residual(scored), scored_mask(scored), {}, {}};
  try {
    for (const Figure& figure : residual_figures(residual_tests({&record, 1}), shown.set)) {
      add_figure(page, figure, gnuplot);
    }
  } catch (const Error& error) {
    // A report without the tests is worth more than none: too few samples, or a perfect fit.
    page.warning("No residual tests. " + std::string(error.what()));
  }
}

}  // namespace

void add_metrics_table(HtmlPage& page, const Evaluation& train, const std::optional<Evaluation>& test,
                       const std::string& output_unit) {
  const std::string unit = output_unit.empty() ? "" : " [" + output_unit + "]";
  std::vector<std::vector<std::string>> rows = {with_warmup(metrics_row("train", train.total), train.total)};
  if (test) rows.push_back(with_warmup(metrics_row("test", test->total), test->total));
  page.table({"data", "RMSE" + unit, "NRMSE", "fit %", "R²", "VAF %", "MAE" + unit, "samples", "warm-up"}, rows);
}

Shown shown_record(const Evaluation& train, const std::vector<Range>& train_ranges,
                   const std::optional<Evaluation>& test, const std::vector<Range>& test_ranges) {
  const Evaluation& evaluation = test ? *test : train;
  const std::vector<Range>& ranges = test ? test_ranges : train_ranges;
  const auto longest =
      std::max_element(evaluation.records.begin(), evaluation.records.end(),
                       [](const ScoredRecord& a, const ScoredRecord& b) { return a.yhat.size() < b.yhat.size(); });
  const auto place = static_cast<std::size_t>(longest - evaluation.records.begin());
  return {test ? "test" : "training", &*longest, place < ranges.size() ? ranges[place].begin : 0};
}

void add_simulation(HtmlPage& page, const Shown& shown, bool gnuplot) {
  if (!shown.finite()) {
    page.warning("The simulation is not finite: no pictures of it.");
    return;
  }
  page.heading("Simulation");
  add_figure(page, zoom_figure(*shown.scored, shown.set, shown.begin), gnuplot);
  add_figure(page, whole_figure(*shown.scored, shown.set, shown.begin), gnuplot);
}

void add_residuals(HtmlPage& page, const Shown& shown, bool gnuplot) {
  if (!shown.finite()) return;
  page.heading("Residuals");
  add_correlations(page, shown, gnuplot);
  add_figure(page, spectrum_figure(*shown.scored, shown.set), gnuplot);
}

}  // namespace blockid::cli
