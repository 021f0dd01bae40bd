// All that `blockid bla` has found.
#pragma once

#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/measured_bla.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/init/bla.hpp>

#include <nlohmann/json.hpp>

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

struct BlaOutcome {
  std::string source = {};
  std::string input_unit = {};
  std::string output_unit = {};
  std::vector<Range> train_ranges = {};
  std::vector<Range> test_ranges = {};
  PredictionOptions prediction = {};
  /// Empty when the orders were given.
  std::vector<BlaScore> table = {};
  /// How the orders were chosen, in words.
  std::string choice = {};
  BlaOrders orders = {};
  BestLinearApproximation bla;
  /// Of the deviations from the means.
  Evaluation train = {};
  std::optional<Evaluation> test = std::nullopt;
  /// Without a model; none when the data cannot give it.
  std::optional<MeasuredBla> measured = std::nullopt;
  /// (n_theta, n_theta) robust to nonlinear distortions, or empty when it could not be had.
  Eigen::MatrixXd covariance = {};
  std::vector<std::string> warnings = {};
};

/// The entry of the table with the smallest validation RMSE, or the smallest BIC when there is no validation.
const BlaScore& best_score(const std::vector<BlaScore>& table);

/// "chosen, best AIC, best BIC, best test": what holds of score k of the table.
std::string marks(const BlaOutcome& outcome, std::size_t k);

/// Data as deviations from the means that the approximation has found.
DataSet deviations(const DataSet& data, const BestLinearApproximation& bla);

/// Zeros and poles of the approximation.
LinearRoots bla_roots(const BlaOutcome& outcome);

/// "nb=3, na=3, nk=0"
std::string to_text(const BlaOrders& orders);

void print_bla(std::ostream& stream, const BlaOutcome& outcome);
nlohmann::ordered_json bla_json(const BlaOutcome& outcome);
/// The report as one HTML file.
std::string bla_report(const BlaOutcome& outcome);

}  // namespace blockid::cli
