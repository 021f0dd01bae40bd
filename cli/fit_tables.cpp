#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/metrics_table.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/text.hpp>

#include <algorithm>
#include <cmath>
#include <ostream>

namespace blockid::cli {
namespace {}  // namespace

void print_task(std::ostream& stream, const FitOutcome& outcome) {
  stream << outcome.source << ": " << outcome.input_name << " -> " << outcome.output_name << ", sampled every "
         << number(outcome.sample_time_s) << " s (" << number(1.0 / outcome.sample_time_s) << " Hz)\n"
         << "model  " << outcome.requested_model << '\n'
         << "train  " << to_text(outcome.train_ranges);
  if (outcome.test) stream << "   test  " << to_text(outcome.test_ranges);
  stream << "   warm-up  " << outcome.prediction.warmup << "   start  "
         << initial_state_text(outcome.prediction.initial_state) << '\n';
}

void print_structures(std::ostream& stream, const FitOutcome& outcome) {
  if (outcome.structures.empty()) return;
  TextTable table{{{"validation RMSE", Align::right},
                   {"parameters", Align::right},
                   {"taken", Align::left},
                   {"structure", Align::left}},
                  {}};
  for (const StructureScore& score : outcome.structures) {
    table.rows.push_back(
        {number(score.validation_rmse), std::to_string(score.parameters), score.taken ? "yes" : "", score.chain});
  }
  stream << "\nstructures, in the order they were tried\n";
  print(stream, table);
}

void print_candidates(std::ostream& stream, const FitOutcome& outcome) {
  constexpr std::size_t kShown = 12;
  TextTable table{{{"#", Align::right},
                   {"start RMSE", Align::right},
                   {"final RMSE", Align::right},
                   {"iterations", Align::right},
                   {"status", Align::left},
                   {"how", Align::left}},
                  {}};
  const std::vector<Trial>& trials = outcome.fit.trials;
  for (std::size_t k = 0; k < std::min(trials.size(), kShown); ++k) {
    const Trial& trial = trials[k];
    table.rows.push_back({std::to_string(k + 1), number(trial.candidate.rmse),
                          trial.refitted ? number(trial.refit.rmse) : "-",
                          trial.refitted ? std::to_string(trial.iterations()) : "-",
                          trial.refitted ? blockid::to_text(trial.refit.status) : "not refitted", trial.candidate.how});
  }
  stream << "\ncandidates\n";
  print(stream, table);
  if (trials.size() > kShown) stream << "  and " << trials.size() - kShown << " more\n";
}

void print_metrics(std::ostream& stream, const FitOutcome& outcome) {
  const RefitReport& report = outcome.fit.report;
  stream << "\nresult  " << blockid::to_text(report.status) << ", " << outcome.fit.iterations() << " iterations, "
         << fixed_number(outcome.fit.wall_seconds, 2) << " s\n";
  TextTable table = metrics_table(outcome.output_unit);
  table.rows.push_back(metrics_row("train", outcome.train.total));
  if (outcome.test) table.rows.push_back(metrics_row("test", outcome.test->total));
  print(stream, table);
  if (outcome.test && outcome.prediction.initial_state == InitialState::estimated) {
    stream << "  the initial state of each test record was estimated from that record\n";
  }
  if (std::isfinite(noise_standard_deviation(outcome))) {
    stream << "  estimated noise " << with_unit(number(noise_standard_deviation(outcome)), outcome.output_unit)
           << " (standard deviation of what the model leaves, training data)\n";
  }
}

void print_fit(std::ostream& stream, const FitOutcome& outcome) {
  print_task(stream, outcome);
  print_structures(stream, outcome);
  print_candidates(stream, outcome);
  print_metrics(stream, outcome);

  const Model& model = outcome.model();
  stream << "\nparameters  " << free_count(outcome) << " free of " << model.parameters.size() << '\n';
  const std::string deviation = outcome.robust ? "standard deviation (robust)" : "standard deviation";
  TextTable table{{{"name", Align::left}, {"value", Align::right}, {deviation, Align::right}}, {}};
  const std::vector<std::string> names = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    const bool known = model.standard_deviations.size() > 0;
    table.rows.push_back({names[static_cast<std::size_t>(k)], number(model.parameters[k], 8),
                          !is_free(outcome, k) ? "held"
                          : known              ? number(model.standard_deviations[k], 3)
                                               : "-"});
  }
  print(stream, table);
  for (const std::string& warning : outcome.warnings) stream << "warning: " << warning << '\n';
}

}  // namespace blockid::cli
