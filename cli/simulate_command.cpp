#include <blockid/cli/commands.hpp>
#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/csv.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/refit.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>

namespace blockid::cli {
namespace {

Eigen::VectorXd simulated(Model& model, const Record& record, const SimulateCommand& command, bool has_output) {
  const PredictionOptions options = prediction_options(command.scoring, command.data.period);
  if (command.scoring.initial_state == "zero" || command.scoring.initial_state == "periodic") {
    model.initial_state.resize(0);
  } else if (command.scoring.initial_state == "estimated") {
    if (!has_output) fail("--initial-state estimated: expected --output NAME to fit the state to");
    model.initial_state = estimate_initial_state(model, record, options.warmup);
  } else if (model.initial_state.size() == 0) {
    fail("--initial-state model: ", command.model, " holds no initial state");
  }
  if (!has_output) {
    // Nothing is scored; the warm-up only has to fit into the record.
    Record any = record;
    any.y = Eigen::VectorXd::Zero(record.u.size());
    any.weights.resize(0);
    return predict(model, any, options);
  }
  return predict(model, record, options);
}

/// Columns t_s, u, [y], yhat, [error].
std::string csv_text(const Record& record, const Eigen::VectorXd& yhat, Index begin, bool has_output) {
  Table table;
  table.has_header = true;
  table.names = has_output ? std::vector<std::string>{"t_s", "u", "y", "yhat", "error"}
                           : std::vector<std::string>{"t_s", "u", "yhat"};
  table.values.resize(yhat.size(), static_cast<Index>(table.names.size()));
  for (Index t = 0; t < yhat.size(); ++t) {
    table.values(t, 0) = static_cast<double>(begin + t) * record.sample_time_s;
  }
  table.values.col(1) = record.u;
  if (has_output) {
    table.values.col(2) = record.y;
    table.values.col(3) = yhat;
    table.values.col(4) = record.y - yhat;
  } else {
    table.values.col(2) = yhat;
  }
  return to_csv(table);
}

void print_simulation(const SimulateCommand& command, const Model& model, const Record& record, const Range& range,
                      const Eigen::VectorXd& yhat, const std::optional<Metrics>& metrics) {
  const std::string& unit = command.data.output_unit.empty() ? model.output_unit : command.data.output_unit;
  std::cout << command.model << " on " << command.data.file << ", samples " << blockid::to_text(range)
            << ", sampled every " << number(record.sample_time_s) << " s\n"
            << "model  " << blockid::to_text(model.chain) << '\n'
            << "yhat   from " << with_unit(number(yhat.minCoeff()), unit) << " to "
            << with_unit(number(yhat.maxCoeff()), unit) << ", mean " << with_unit(number(yhat.mean()), unit) << '\n';
  if (!metrics) return;
  std::cout << "RMSE " << with_unit(number(metrics->rmse), unit) << "  NRMSE " << number(metrics->nrmse) << "  fit "
            << number(metrics->fit_percent) << " %  R2 " << number(metrics->r2) << "  VAF " << number(metrics->vaf)
            << " %  MAE " << with_unit(number(metrics->mae), unit) << "  (" << metrics->samples << " samples, warm-up "
            << metrics->warmup << ")\n";
}

}  // namespace

int run_simulate(const SimulateCommand& command) {
  Model model = load_model(command.model);
  check_outputs({command.csv, command.json});
  const LoadedRecord loaded = load(command.data, model.sample_time_s);
  const Record& whole = loaded.record;
  for (const std::string& warning : loaded.warnings) std::cerr << "blockid: warning: " << warning << '\n';
  Range range;
  try {
    range = resolve(command.range.empty() ? Range{} : parse_range(command.range), sample_count(whole));
  } catch (const Error& error) {
    fail("--range ", command.range, ": ", error.what());
  }
  const Record record = slice(whole, range);
  const bool has_output = command.data.output.has_value();
  const Eigen::VectorXd yhat = simulated(model, record, command, has_output);

  std::optional<Metrics> metrics;
  if (has_output) metrics = evaluate_metrics(record.y, yhat, command.scoring.warmup, record.weights);
  if (!command.quiet) print_simulation(command, model, record, range, yhat, metrics);
  if (!yhat.allFinite()) {
    const auto first = std::find_if(yhat.begin(), yhat.end(), [](double value) { return !std::isfinite(value); });
    std::cerr << "blockid: the simulation is not finite from sample "
              << range.begin + std::distance(yhat.begin(), first) << " on: the model is unstable\n";
  }
  if (!command.csv.empty()) write_output(command.csv, csv_text(record, yhat, range.begin, has_output));
  if (!command.json.empty()) {
    nlohmann::ordered_json result = {{"format", "blockid-simulation"},
                                     {"version", BLOCKID_VERSION},
                                     {"model", blockid::to_text(model.chain)},
                                     {"range", blockid::to_text(range)},
                                     {"sample_time_s", record.sample_time_s},
                                     {"finite", yhat.allFinite()},
                                     {"warnings", loaded.warnings}};
    if (metrics) result["metrics"] = metrics_json(*metrics);
    write_output(command.json, json_text(result));
  }
  return yhat.allFinite() ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
