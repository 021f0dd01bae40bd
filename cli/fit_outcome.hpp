// All that a fit has brought: what tables, JSON and report are made from.
#pragma once

#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/options.hpp>
#include <blockid/estimators/fit.hpp>
#include <blockid/init/automatic.hpp>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

struct FitOutcome {
  /// File or problem that the data came from.
  std::string source = {};
  std::string input_name = {};
  std::string output_name = {};
  std::string input_unit = {};
  std::string output_unit = {};
  double sample_time_s = 1.0;
  std::vector<Range> train_ranges = {};
  std::vector<Range> test_ranges = {};
  /// As the user wrote it.
  std::string requested_model = {};
  std::string init = {};
  PredictionOptions prediction = {};
  /// Places of the parameters that did not move, ascending: frozen, or held as gauges.
  std::vector<Index> held = {};
  std::uint64_t seed = 1;
  int threads = 1;
  /// Whether the standard deviations are those of the sandwich covariance.
  bool robust = false;

  FitResult fit;
  Evaluation train = {};
  std::optional<Evaluation> test = std::nullopt;
  std::vector<std::string> warnings = {};
  /// What was tried when the structure was chosen from the data.
  std::vector<StructureScore> structures = {};

  /// The model as it is saved.
  const Model& model() const { return fit.model; }
};

/// The fit's model scored on both data sets, names and units filled in, warnings added.
FitOutcome make_outcome(FitResult fit, const SplitData& data, const PredictionOptions& prediction,
                        const std::vector<std::string>& frozen);

/// Estimated standard deviation of the output noise, sqrt(r'r / (n - rank)) on the training data; NaN when unknown.
double noise_standard_deviation(const FitOutcome& outcome);

/// Samples of a batch of the sandwich covariance: enough batches, long enough for the residual to forget.
Index batch_length(const DataSet& data);

/// What the standard deviations assume, in words.
std::string covariance_text(const FitOutcome& outcome);

/// Whether a parameter was free: neither frozen nor held as a gauge.
bool is_free(const FitOutcome& outcome, Index parameter);

/// Number of free parameters.
Index free_count(const FitOutcome& outcome);

/// What was done, candidates, metrics and parameters as tables on a stream.
void print_fit(std::ostream& stream, const FitOutcome& outcome);
void print_task(std::ostream& stream, const FitOutcome& outcome);
void print_structures(std::ostream& stream, const FitOutcome& outcome);
void print_candidates(std::ostream& stream, const FitOutcome& outcome);
void print_metrics(std::ostream& stream, const FitOutcome& outcome);

struct FitJudgement;

/// result.json
nlohmann::ordered_json fit_json(const FitOutcome& outcome, const FitJudgement& tests);

/// rmse, nrmse, fit_percent, r2, vaf, mae, samples, warmup; null where not finite.
nlohmann::ordered_json metrics_json(const Metrics& metrics);

/// NaN and infinities as null.
nlohmann::ordered_json finite_or_null(double value);

/// How the records were started, in words: "rest", "estimated from each record", "periodic steady state".
std::string initial_state_text(InitialState state);

/// Exit code of a finished fit: success, numerical failure or interrupted.
int exit_code(const FitOutcome& outcome);

}  // namespace blockid::cli
