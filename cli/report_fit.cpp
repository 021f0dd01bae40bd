#include <blockid/cli/report_fit.hpp>

#include <blockid/cli/judgement.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/report/figures.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/cli/report_evaluation.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <ostream>

namespace blockid::cli {
namespace {

void add_task(HtmlPage& page, const FitOutcome& outcome) {
  page.paragraph(outcome.source + ": " + outcome.input_name + " → " + outcome.output_name + ", sampled every " +
                 number(outcome.sample_time_s) + " s (" + number(1.0 / outcome.sample_time_s) + " Hz).");
  std::string ranges = "Trained on samples " + to_text(outcome.train_ranges);
  if (outcome.test) ranges += ", tested on samples " + to_text(outcome.test_ranges);
  page.paragraph(ranges + " (zero-based, half-open; each range is a record of its own). Start of each record: " +
                 initial_state_text(outcome.prediction.initial_state) + "; the first " +
                 std::to_string(outcome.prediction.warmup) + " samples are not scored.");
  page.code(outcome.requested_model);
  page.paragraph("Starting models by “" + outcome.init +
                 "”, the best refitted by Levenberg-Marquardt on the simulation "
                 "error: " +
                 blockid::to_text(outcome.fit.report.status) + " after " + std::to_string(outcome.fit.iterations()) +
                 " iterations, " + fixed_number(outcome.fit.wall_seconds, 2) + " s on " +
                 std::to_string(outcome.threads) + (outcome.threads == 1 ? " thread." : " threads."));
  for (const std::string& warning : outcome.warnings) page.warning(warning);
}

void add_metrics(HtmlPage& page, const FitOutcome& outcome) {
  page.heading("How good the model is");
  add_metrics_table(page, outcome.train, outcome.test, outcome.output_unit);
  if (outcome.test && outcome.prediction.initial_state == InitialState::estimated) {
    page.paragraph("The initial state of each test record was estimated from that record.");
  }
  const double noise = noise_standard_deviation(outcome);
  if (std::isfinite(noise)) {
    page.paragraph("Estimated standard deviation of the noise: " + with_unit(number(noise), outcome.output_unit) +
                   " (what the model leaves of the training data, " + std::to_string(free_count(outcome)) +
                   " free parameters taken into account).");
  }
}

Eigen::MatrixXd covariance_of(const FitOutcome& outcome, const LeafBlock& leaf) {
  const std::optional<Covariance>& covariance = outcome.fit.report.covariance;
  if (!covariance) return {};
  const Index count = leaf.parameters.size();
  return covariance->parameters.block(leaf.offset, leaf.offset, count, count);
}

bool has_response(const LeafBlock& leaf) { return leaf.parameters.size() > 0 && dc_gain(leaf.block, leaf.parameters); }

void add_filters(HtmlPage& page, const FitOutcome& outcome, bool gnuplot) {
  page.heading("Linear filters");
  page.paragraph("Gains that neighbouring blocks could trade are held by convention and count as exact in the bands.");
  page.paragraph("Covariance: " + covariance_text(outcome) + ".");
  const double sample_time_s = outcome.sample_time_s;
  const Eigen::VectorXd frequencies = logarithmic_frequencies(sample_time_s, kBodeDecades, kBodePoints);
  for (const LeafBlock& leaf : leaf_blocks(outcome.model())) {
    // A static gain is linear, too, but has nothing to show.
    if (!has_response(leaf) || leaf.block.is_static()) continue;
    const BodeBand band =
        bode_band(leaf.block, leaf.parameters, covariance_of(outcome, leaf), frequencies, sample_time_s);
    add_figure(page, bode_figure(leaf.path, band, {}), gnuplot);
    const std::optional<LinearRoots> roots = linear_roots(leaf.block, leaf.parameters);
    if (!roots) continue;
    add_figure(page, pole_zero_figure(leaf.path, *roots), gnuplot);
    std::vector<std::vector<std::string>> rows;
    const auto add = [&](const char* what, const std::vector<std::complex<double>>& list) {
      for (const std::complex<double>& root : list) {
        rows.push_back(
            {what, to_text(root), number(std::abs(root), 5), number(natural_frequency_hz(root, sample_time_s), 5)});
      }
    };
    add("pole", roots->poles);
    add("zero", roots->zeros);
    page.table({leaf.path, "root", "modulus", "natural frequency [Hz]"}, rows);
  }
}

void add_static_blocks(HtmlPage& page, const FitOutcome& outcome, bool gnuplot) {
  page.heading("Static blocks");
  const ScoredRecord& first = outcome.train.records.front();
  const std::vector<LeafBlock> leaves = leaf_blocks(outcome.model());
  const std::vector<Eigen::VectorXd> inputs = leaf_inputs(first.model, first.record.u);
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    const std::optional<AnyBlock> curve = static_block_of(leaves[k].block);
    if (!curve || curve->is_linear() || !inputs[k].allFinite()) continue;
    const LeafBlock shown{leaves[k].path, *curve, leaves[k].offset, leaves[k].parameters};
    add_figure(page, static_figure(shown, covariance_of(outcome, shown), inputs[k]), gnuplot);
  }
}

void add_residual_tests(HtmlPage& page, const FitOutcome& outcome, const FitJudgement& tests, bool gnuplot) {
  if (tests.judgement) {
    add_judgement(page, *tests.judgement, outcome.output_unit, gnuplot);
    return;
  }
  page.heading("Residual tests");
  page.warning("Not made. " + tests.problem);
}

void add_parameters(HtmlPage& page, const FitOutcome& outcome) {
  page.heading("Parameters");
  const Model& model = outcome.model();
  page.paragraph(std::to_string(free_count(outcome)) + " free of " + std::to_string(model.parameters.size()) +
                 "; held parameters keep the gains between neighbouring blocks from wandering, or were frozen.");
  std::vector<std::vector<std::string>> rows;
  const std::vector<std::string> names = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    const bool known = model.standard_deviations.size() > 0;
    rows.push_back({names[static_cast<std::size_t>(k)], number(model.parameters[k], 8),
                    is_free(outcome, k) && known ? number(model.standard_deviations[k], 3) : "-",
                    is_free(outcome, k) ? "free" : "held"});
  }
  page.table({"name", "value", "standard deviation" + std::string(outcome.robust ? " (robust)" : ""), ""}, rows);
  page.paragraph("The whole chain, as blockid reads it:");
  page.code(blockid::to_text(model.chain));
}

/// Of the best trial whose initialiser shared the roots out, if there is one.
void add_root_shares(HtmlPage& page, const FitOutcome& outcome, bool gnuplot) {
  const std::vector<Trial>& trials = outcome.fit.trials;
  const auto shown = std::find_if(trials.begin(), trials.end(),
                                  [](const Trial& trial) { return !trial.candidate.root_shares.empty(); });
  if (shown != trials.end()) add_figure(page, root_shares_figure(shown->candidate), gnuplot);
}

void add_candidates(HtmlPage& page, const FitOutcome& outcome, bool gnuplot) {
  page.heading("Candidates");
  add_root_shares(page, outcome, gnuplot);
  std::vector<std::vector<std::string>> rows;
  for (const Trial& trial : outcome.fit.trials) {
    rows.push_back({std::to_string(rows.size() + 1), number(trial.candidate.rmse),
                    trial.refitted ? number(trial.refit.rmse) : "-",
                    trial.refitted ? std::to_string(trial.refit.iterations) : "-",
                    trial.refitted ? blockid::to_text(trial.refit.status) : "not refitted", trial.candidate.how});
  }
  page.table({"#", "start RMSE", "final RMSE", "iterations", "status", "how it came about"}, rows);
}

}  // namespace

std::string fit_report(const FitOutcome& outcome, const FitJudgement& tests) {
  const bool gnuplot = gnuplot_is_there();
  HtmlPage page("Identification of " + outcome.output_name + " from " + outcome.input_name);
  add_task(page, outcome);
  if (!gnuplot) page.warning(kGnuplotMissing);
  add_metrics(page, outcome);
  const Shown shown = shown_record(outcome.train, outcome.train_ranges, outcome.test, outcome.test_ranges);
  add_simulation(page, shown, gnuplot);
  add_filters(page, outcome, gnuplot);
  add_static_blocks(page, outcome, gnuplot);
  if (shown.finite()) {
    add_residual_tests(page, outcome, tests, gnuplot);
    add_figure(page, spectrum_figure(*shown.scored, shown.set), gnuplot);
  }
  add_parameters(page, outcome);
  add_candidates(page, outcome, gnuplot);
  return page.text();
}

void announce_missing_gnuplot(std::ostream& stream) {
  if (!gnuplot_is_there()) stream << "blockid: " << kGnuplotMissing << std::endl;
}

}  // namespace blockid::cli
