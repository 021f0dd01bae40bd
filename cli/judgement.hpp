// A model judged on records: residual tests with what is known of its parameters, in figures and in words.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/predictor.hpp>
#include <blockid/validation/error_spectrum.hpp>
#include <blockid/validation/fit_hints.hpp>
#include <blockid/validation/noise_spectrum.hpp>
#include <blockid/validation/residual_tests.hpp>

#include <nlohmann/json.hpp>

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

struct FitOutcome;

struct JudgementOptions {
  PredictionOptions prediction = {};
  ResidualTestOptions tests = {};
  /// Places of parameters that were not estimated, ascending.
  std::vector<Index> held = {};
  /// Names of parameters that the training data do not determine.
  std::vector<std::string> undetermined = {};
  std::optional<double> noise_deviation = std::nullopt;
  /// (M,) samples of the noise alone; empty for none.
  Eigen::VectorXd noise_record = {};
};

struct Judgement {
  /// "training", "test", or "given" when the records that the model was fitted to are not known.
  std::string set;
  /// How errors of the parameters were counted, in words.
  std::string parameters;
  ResidualTests tests;
  /// sqrt(sum r^2 / sum (y - mean y)^2) over the scored samples.
  double residual_over_output = 0.0;
  std::optional<PeriodicError> periodic = std::nullopt;
  std::optional<NoiseLevelTest> noise = std::nullopt;
  std::optional<NoiseSpectrumTest> noise_spectrum = std::nullopt;
  std::optional<ErrorComparison> errors = std::nullopt;
  std::vector<std::string> under_fit = {};
  std::vector<std::string> over_fit = {};
  std::vector<std::string> warnings = {};

  /// Whether the residual is so much larger than the output that the model explains nothing; its colour then hides
  /// all else from the tests.
  bool worse_than_nothing() const;
  /// Whether all tests of the model passed; whiteness is one of the noise.
  bool passed() const;
};

/// Judges the test data, where there are any, with the covariance of the parameters from the training data; otherwise
/// the training data. Neither set need be there, but one must. Throws Error as residual_tests() does.
Judgement judge(const Model& model, const DataSet& training, const DataSet& test, const JudgementOptions& options);

/// The tests of a fit, or why there are none: a perfect fit, for one, leaves nothing to test.
struct FitJudgement {
  std::optional<Judgement> judgement = std::nullopt;
  std::string problem = {};
};

/// With what the fit knows of its parameters.
FitJudgement judge_fit(const FitOutcome& outcome);

/// Simulations of the test data, where there are any, otherwise of the training data; the parameters count as exact, so
/// that what they owe to the training data makes the tests pass a little more often there.
FitJudgement judge_simulations(const Evaluation& train, const std::optional<Evaluation>& test);

/// Places of parameters that a saved model's estimator did not move: gauges and those without a standard deviation.
std::vector<Index> held_places(const Model& model);

/// "all tests passed", or "failed: input, squared input".
std::string verdict_text(const Judgement& judgement);

void print_judgement(std::ostream& stream, const Judgement& judgement);
/// One line.
void print_verdict(std::ostream& stream, const FitJudgement& tests);
nlohmann::ordered_json judgement_json(const Judgement& judgement);
/// Without correlations lag by lag, which `validate --json` has; or the `problem` that there was.
nlohmann::ordered_json tests_json(const FitJudgement& tests);

/// Heading, tables, hints and pictures.
void add_judgement(HtmlPage& page, const Judgement& judgement, const std::string& unit, bool gnuplot);

}  // namespace blockid::cli
