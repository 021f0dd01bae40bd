#include <blockid/cli/commands.hpp>
#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/interrupt.hpp>
#include <blockid/cli/linear_outcome.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/metrics_table.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report_fit.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/model_json.hpp>
#include <blockid/data/error.hpp>
#include <blockid/init/polynomial_starts.hpp>
#include <blockid/init/root_groups.hpp>

#include <charconv>
#include <cmath>
#include <iostream>
#include <map>
#include <optional>
#include <utility>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

using Score = LinearScore;

const std::vector<std::string>& keys_of(const std::string& structure) {
  static const std::map<std::string, std::vector<std::string>> kKeys = {{"arx", {"na", "nb", "nk"}},
                                                                        {"armax", {"na", "nb", "nc", "nk"}},
                                                                        {"oe", {"nb", "nf", "nk"}},
                                                                        {"bj", {"nb", "nc", "nd", "nf", "nk"}}};
  return kKeys.at(structure);
}

Index& order_of(PolynomialOrders& orders, const std::string& key) {
  if (key == "na") return orders.na;
  if (key == "nb") return orders.nb;
  if (key == "nc") return orders.nc;
  if (key == "nd") return orders.nd;
  return key == "nf" ? orders.nf : orders.nk;
}

PolynomialOrders orders_of(const LinearCommand& command) {
  constexpr Index kMost = 1000;
  const std::vector<std::string>& keys = keys_of(command.structure);
  PolynomialOrders orders;
  std::vector<std::string> seen;
  for (const std::string& item : command.orders) {
    const std::size_t equals = item.find('=');
    const std::string key = item.substr(0, equals);
    if (equals == std::string::npos || std::find(keys.begin(), keys.end(), key) == keys.end()) {
      fail("--orders ", item, ": expected KEY=N with a key of ", command.structure, ": ", joined(keys));
    }
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) fail("--orders: ", key, " is there twice");
    seen.push_back(key);
    Index value = -1;
    const char* const end = item.data() + item.size();
    const auto [stop, error] = std::from_chars(item.data() + equals + 1, end, value);
    if (error != std::errc() || stop != end || value < 0 || value > kMost) {
      fail("--orders ", item, ": expected a whole number from 0 to ", kMost, " behind ", key, "=");
    }
    order_of(orders, key) = value;
  }
  return orders;
}

std::string orders_text(const std::string& structure, PolynomialOrders orders) {
  std::string text;
  for (const std::string& key : keys_of(structure)) {
    text += (text.empty() ? "" : " ") + key + "=" + std::to_string(order_of(orders, key));
  }
  return text;
}

/// Predictions of all records, scored together; what a missing output hides is left out.
Metrics scored(const PolynomialModel& model, DataSet data, Index ahead, const PredictionOptions& options,
               bool& finite) {
  std::vector<Eigen::VectorXd> predictions;
  for (Record& record : data.records) {
    Eigen::VectorXd yhat = predict(model, record, ahead, options);
    const bool complete = present_count(record) == record.u.size();
    if (record.weights.size() == 0) record.weights = Eigen::VectorXd::Ones(record.u.size());
    for (Index t = 0; t < yhat.size(); ++t) {
      if (!complete && std::isnan(yhat[t])) record.weights[t] = 0.0;
      finite = finite && (record.weights[t] == 0.0 || std::isfinite(yhat[t]));
    }
    predictions.push_back(std::move(yhat));
  }
  return metrics_together(data, predictions, options.warmup);
}

void add_simulations(LinearOutcome& outcome, const SplitData& data, const PredictionOptions& prediction) {
  const PolynomialModel& model = outcome.found.fit.model;
  const Model path = deterministic_part(model);
  const auto simulated = [&](const DataSet& records) {
    return evaluate(path, records, prediction.warmup,
                    [&](const Record& record) { return predict(model, record, kSimulation, prediction); });
  };
  outcome.train_ranges = data.train_ranges;
  outcome.test_ranges = data.test_ranges;
  outcome.train = simulated(data.train);
  if (!data.test.records.empty()) outcome.test = simulated(data.test);
}

LinearOutcome outcome_of(const LinearCommand& command) {
  const PolynomialOrders orders = orders_of(command);
  PolynomialFitOptions options;
  options.prediction = prediction_options(command.scoring, command.data.period);
  options.max_iterations = command.max_iterations;
  options.progress = [](const FitProgress&) { return !interrupted(); };
  const SplitData data = split(load(command.data), command.ranges);
  LinearOutcome outcome;
  outcome.found = identify_polynomial(data.train, orders, options);
  const PolynomialFit& fit = outcome.found.fit;
  outcome.warnings = data.warnings;
  for (std::string& warning : warnings_of(fit)) outcome.warnings.push_back(std::move(warning));
  const std::string unstable = warning_of_unstable_system(orders, data.train, options.prediction);
  if (!unstable.empty()) outcome.warnings.push_back(unstable);
  const std::string lack = warning_of_excitation(orders, data.train);
  if (!lack.empty()) outcome.warnings.push_back(lack);
  if (interrupted()) outcome.warnings.emplace_back("interrupted: this is the best result so far");
  std::vector<std::pair<std::string, Index>> horizons = {{"one step ahead", 1}};
  if (command.ahead > 0) horizons.emplace_back(std::to_string(command.ahead) + " steps ahead", command.ahead);
  horizons.emplace_back("simulation", kSimulation);
  for (const auto& [name, ahead] : horizons) {
    Score score{name, scored(fit.model, data.train, ahead, options.prediction, outcome.finite), {}};
    if (!data.test.records.empty()) {
      score.test = scored(fit.model, data.test, ahead, options.prediction, outcome.finite);
    }
    outcome.scores.push_back(std::move(score));
  }
  add_simulations(outcome, data, options.prediction);
  try {
    outcome.judgement = judge(fit, data.train, data.test, options.prediction);
  } catch (const Error& error) {
    // A result without the tests is worth more than none: a perfect fit, for one, leaves nothing to test.
    outcome.not_judged = error.what();
  }
  return outcome;
}

double deviation_of(const PolynomialFit& fit, Index k) {
  return fit.covariance ? fit.covariance->standard_deviations[k] : std::nan("");
}

void print_roots(const PolynomialModel& model) {
  const Polynomials p = polynomials(model);
  TextTable table{{{"polynomial", Align::left}, {"roots", Align::left}}, {}};
  const Eigen::VectorXd b = p.b.tail(model.orders.nb + 1);
  for (const auto& [name, polynomial] : {std::pair{"A", p.a}, {"B", b}, {"C", p.c}, {"D", p.d}, {"F", p.f}}) {
    if (polynomial.size() < 2 || polynomial.isZero()) continue;
    table.rows.push_back({name, blockid::to_text(root_groups(polynomial))});
  }
  if (!table.rows.empty()) print(std::cout, table);
}

void print_outcome(const LinearCommand& command, const LinearOutcome& outcome) {
  const PolynomialFit& fit = outcome.found.fit;
  std::cout << command.structure << ' ' << orders_text(command.structure, fit.model.orders) << ", sampled every "
            << number(fit.model.sample_time_s) << " s\n"
            << blockid::to_text(fit.status) << ", " << fit.iterations << " iterations from " << outcome.found.how
            << ", " << fit.counted_samples << " samples\n";
  TextTable table{{{"coefficient", Align::left}, {"value", Align::right}, {"standard deviation", Align::right}}, {}};
  const std::vector<std::string> names = parameter_names(fit.model.orders);
  for (Index k = 0; k < fit.model.theta.size(); ++k) {
    table.rows.push_back(
        {names[static_cast<std::size_t>(k)], number(fit.model.theta[k], 8), number(deviation_of(fit, k), 3)});
  }
  print(std::cout, table);
  print_roots(fit.model);
  std::cout << "input mean " << with_unit(number(fit.model.u_mean), command.data.input_unit) << ", output mean "
            << with_unit(number(fit.model.y_mean), command.data.output_unit) << '\n'
            << "noise " << with_unit(number(std::sqrt(fit.model.noise_variance)), command.data.output_unit)
            << " (standard deviation of e)  FPE " << number(fit.final_prediction_error) << "  AIC "
            << number(fit.aic, 8) << "  BIC " << number(fit.bic, 8) << '\n';
  TextTable metrics = metrics_table(command.data.output_unit);
  for (const Score& score : outcome.scores) metrics.rows.push_back(metrics_row("train, " + score.name, score.train));
  for (const Score& score : outcome.scores) {
    if (score.test) metrics.rows.push_back(metrics_row("test, " + score.name, *score.test));
  }
  print(std::cout, metrics);
  if (outcome.judgement) {
    std::cout << "errors one step ahead:\n";
    print_judgement(std::cout, *outcome.judgement);
  } else {
    std::cout << "no residual tests: " << outcome.not_judged << '\n';
  }
}

Json vector_json(const Eigen::VectorXd& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

Json coefficients_json(const PolynomialFit& fit) {
  Json list = Json::array();
  const std::vector<std::string> names = parameter_names(fit.model.orders);
  for (Index k = 0; k < fit.model.theta.size(); ++k) {
    list.push_back({{"name", names[static_cast<std::size_t>(k)]},
                    {"value", finite_or_null(fit.model.theta[k])},
                    {"standard_deviation", finite_or_null(deviation_of(fit, k))}});
  }
  return list;
}

Json trials_json(const std::vector<PolynomialTrial>& trials) {
  Json list = Json::array();
  for (const PolynomialTrial& trial : trials) {
    list.push_back({{"how", trial.how},
                    {"rmse", finite_or_null(trial.start_rmse)},
                    {"final_rmse", finite_or_null(trial.rmse)},
                    {"status", blockid::to_text(trial.status)},
                    {"iterations", trial.iterations}});
  }
  return list;
}

Json scores_json(const std::vector<Score>& scores) {
  Json list = Json::array();
  for (const Score& score : scores) {
    Json entry = {{"prediction", score.name}, {"train", metrics_json(score.train)}};
    if (score.test) entry["test"] = metrics_json(*score.test);
    list.push_back(std::move(entry));
  }
  return list;
}

Json result_json(const LinearCommand& command, const LinearOutcome& outcome) {
  const PolynomialFit& fit = outcome.found.fit;
  PolynomialOrders orders = fit.model.orders;
  const Polynomials p = polynomials(fit.model);
  Json result = {{"format", "blockid-linear"}, {"version", BLOCKID_VERSION}, {"structure", command.structure}};
  for (const std::string& key : keys_of(command.structure)) result["orders"][key] = order_of(orders, key);
  result["sample_time_s"] = fit.model.sample_time_s;
  result["input_mean"] = fit.model.u_mean;
  result["output_mean"] = fit.model.y_mean;
  result["polynomials"] = {{"a", vector_json(p.a)},
                           {"b", vector_json(p.b)},
                           {"c", vector_json(p.c)},
                           {"d", vector_json(p.d)},
                           {"f", vector_json(p.f)}};
  result["coefficients"] = coefficients_json(fit);
  result["status"] = blockid::to_text(fit.status);
  result["message"] = fit.message;
  result["iterations"] = fit.iterations;
  result["wall_seconds"] = fit.wall_seconds;
  result["samples"] = fit.counted_samples;
  result["unknowns"] = fit.unknowns;
  result["noise_variance"] = finite_or_null(fit.model.noise_variance);
  result["final_prediction_error"] = finite_or_null(fit.final_prediction_error);
  result["aic"] = finite_or_null(fit.aic);
  result["bic"] = finite_or_null(fit.bic);
  result["stable"] = is_stable(fit.model);
  result["stationary_noise"] = has_stationary_noise(fit.model);
  result["stable_predictor"] = has_stable_predictor(fit.model);
  if (fit.covariance) {
    result["rank"] = fit.covariance->rank;
    result["condition"] = finite_or_null(fit.covariance->condition);
  }
  result["candidates"] = trials_json(outcome.found.trials);
  result["scores"] = scores_json(outcome.scores);
  if (outcome.judgement) result["residual_tests"] = judgement_json(*outcome.judgement);
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace

int run_linear(const LinearCommand& command) {
  const InterruptGuard guard;
  check_outputs({command.model, command.json, command.report});
  if (!command.report.empty()) announce_missing_gnuplot(std::cerr);
  const LinearOutcome outcome = outcome_of(command);
  for (const std::string& warning : outcome.warnings) std::cerr << "blockid: warning: " << warning << '\n';
  if (!command.quiet) print_outcome(command, outcome);
  std::cout.flush();
  const PolynomialFit& fit = outcome.found.fit;
  if (!command.model.empty()) write_output(command.model, to_json(deterministic_part(fit.model)));
  if (!command.json.empty()) write_output(command.json, json_text(result_json(command, outcome)));
  if (!command.report.empty()) write_output(command.report, linear_report(command, outcome));
  if (interrupted()) return kInterrupted;
  return outcome.finite && fit.status != FitStatus::diverged ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
