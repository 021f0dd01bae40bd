// All that a fit of a frequency response has brought, and its three forms.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/cli/continuous_summary.hpp>
#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/frf_data.hpp>
#include <blockid/cli/judgement.hpp>
#include <blockid/estimators/frequency_fit.hpp>

#include <nlohmann/json.hpp>

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

struct FrfOutcome {
  std::string source;
  /// With the tones that were fitted.
  FrfData data;
  FrequencyFitOptions options;
  FrequencyFit fit;
  ContinuousSummary summary;
  /// Largest differences of model and data over the tones.
  double largest_db = 0.0;
  double largest_deg = 0.0;
  /// None without a sample time.
  std::optional<Model> model;
  /// Of the records that the response was measured on; none of a table.
  std::optional<Evaluation> simulation;
  FitJudgement tests;
  std::vector<std::string> warnings;
};

/// sqrt(mean |Ghat / G - 1|^2) over the tones where G is not zero.
double relative_rms(const FrfOutcome& outcome);

/// Covariance of [a, b]; empty when as many numbers were fitted as measured.
Eigen::MatrixXd known_covariance(const FrequencyFit& fit);

void print_frf(std::ostream& stream, const FrfOutcome& outcome);
nlohmann::ordered_json frf_json(const FrfOutcome& outcome);
/// The report as one HTML file.
std::string frf_report(const FrfOutcome& outcome);

}  // namespace blockid::cli
