// All that a continuous-time fit of a record has brought, and its three forms.
#pragma once

#include <blockid/blocks/hold.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/cli/continuous_summary.hpp>
#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/judgement.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/options.hpp>
#include <blockid/estimators/continuous_model.hpp>

#include <nlohmann/json.hpp>

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// What an estimator has found, in a form that all share.
struct CtEstimate {
  ContinuousTransferFunction transfer_function;
  /// Of [a, b]; empty when unknown.
  Eigen::MatrixXd covariance;
  ContinuousSummary summary;
  /// Of the input, in samples.
  Index delay = 0;
  /// Numbers of A and B that were free.
  Index coefficients = 0;
  /// How the input runs between samples.
  Hold hold = Hold::zero_order;
  /// What the estimator says of itself, a line each.
  std::vector<std::string> facts;
  /// The same for JSON.
  nlohmann::ordered_json details;
  std::vector<std::string> warnings;
};

struct CtOutcome {
  std::string source;
  std::string method;
  CtEstimate estimate;
  /// `[delay(...) |] G=continuous_rational(...)`
  Model model;
  PredictionOptions prediction;
  std::vector<Range> train_ranges;
  std::vector<Range> test_ranges;
  Evaluation train;
  std::optional<Evaluation> test;
  FitJudgement tests = {};
  std::vector<std::string> warnings = {};
};

void print_ct(std::ostream& stream, const CtOutcome& outcome);
nlohmann::ordered_json ct_json(const CtOutcome& outcome);
/// The report as one HTML file.
std::string ct_report(const CtOutcome& outcome);

/// A least-squares fit over trends as an estimate.
CtEstimate estimate_of(const TrendFit& fit);

/// Ends in least squares of the simulation error over the data, inputs as late as the estimate says.
void refit_estimate(CtEstimate& estimate, const DataSet& late, const PredictionOptions& prediction);

/// --method flbf, svf, srivc with what belongs to them. prediction: how records start, for the fit, too.
/// Throws Error for bad options and for what fit_continuous() and refit() refuse.
CtEstimate continuous_estimate(const CtCommand& command, const DataSet& data, const PredictionOptions& prediction);

/// Simulations by such an estimate, splines over the whole record; the block of the model file has to cut them short.
Evaluation evaluate(const CtEstimate& estimate, const Model& model, const DataSet& data,
                    const PredictionOptions& prediction);

}  // namespace blockid::cli
