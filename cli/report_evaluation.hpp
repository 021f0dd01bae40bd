// Parts of reports that show a simulation beside the measurement.
#pragma once

#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/data/data_set.hpp>

#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// How good the simulations of both sets are, as a table.
void add_metrics_table(HtmlPage& page, const Evaluation& train, const std::optional<Evaluation>& test,
                       const std::string& output_unit);

/// The set and record that pictures of the error are drawn from.
struct Shown {
  std::string set;
  const ScoredRecord* scored;
  /// Number of the record's first sample in the file.
  Index begin;

  bool finite() const { return scored->yhat.allFinite(); }
};

/// The longest record of the test data; of the training data when there are no others.
Shown shown_record(const Evaluation& train, const std::vector<Range>& train_ranges,
                   const std::optional<Evaluation>& test, const std::vector<Range>& test_ranges);

/// Measured and simulated in detail and as a whole; a warning instead when the simulation is not finite.
void add_simulation(HtmlPage& page, const Shown& shown, bool gnuplot);

/// Correlations and spectrum of the residual; nothing when the simulation is not finite.
void add_residuals(HtmlPage& page, const Shown& shown, bool gnuplot);

}  // namespace blockid::cli
