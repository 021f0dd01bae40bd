#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/metrics.hpp>
#include <blockid/estimators/trend_fit.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;
using Align = TextTable::Align;

/// A coefficient of the model with its standard deviation.
struct Coefficient {
  std::string name;
  double value = 0.0;
  double standard_deviation = 0.0;
};

struct CtOutcome {
  TrendFit fit;
  double sample_time_s = 1.0;
  std::vector<Coefficient> coefficients;
  Metrics train;
  std::optional<Metrics> test;
  bool finite = true;
  std::vector<std::string> warnings;
};

std::string names_of(const TrendStructure& structure) {
  std::string names;
  for (const Index power : structure.a) names += (names.empty() ? "a" : ", a") + std::to_string(power);
  for (const Index power : structure.b) names += ", b" + std::to_string(power);
  return names;
}

/// Removes the power that `name`, "a0" or "b1", stands for.
void leave_out(const std::string& name, TrendStructure& structure) {
  std::vector<Index>& powers = name.starts_with("b") ? structure.b : structure.a;
  const auto found = std::find_if(powers.begin(), powers.end(), [&](Index power) {
    return name == (name.starts_with("b") ? "b" : "a") + std::to_string(power);
  });
  if (found == powers.end()) fail("--without ", name, ": expected one of ", names_of(structure));
  powers.erase(found);
}

TrendStructure structure_of(const CtCommand& command) {
  if (command.orders.size() != 2 || command.orders[0] < 0 || command.orders[1] <= command.orders[0]) {
    fail("--orders: expected NB,NA with 0 <= NB < NA");
  }
  const TrendScheme scheme = command.method == "goodwin" ? TrendScheme::goodwin : TrendScheme::tustin;
  TrendStructure structure = full_trends(scheme, command.orders[0], command.orders[1], command.delay);
  for (const std::string& name : command.without) leave_out(name, structure);
  if (structure.b.empty()) fail("--without: expected at least one coefficient of the numerator to remain");
  return structure;
}

std::vector<Coefficient> coefficients_of(const TrendFit& fit) {
  std::vector<Coefficient> list;
  const auto deviation = [&] {
    const Index k = std::ssize(list);
    return std::sqrt(fit.covariance(k, k));
  };
  for (const Index power : fit.structure.a) list.push_back({"a" + std::to_string(power), fit.a[power], deviation()});
  for (const Index power : fit.structure.b) list.push_back({"b" + std::to_string(power), fit.b[power], deviation()});
  return list;
}

/// Over all records together, each simulated from rest.
Metrics scored(const TrendFit& fit, const DataSet& data, Index warmup, bool& finite) {
  Index samples = 0;
  for (const Record& record : data.records) {
    if (warmup >= record.u.size()) {
      fail("--warmup ", warmup, ": expected less than the ", record.u.size(), " samples of ", describe(record));
    }
    samples += record.u.size() - warmup;
  }
  Eigen::VectorXd y(samples);
  Eigen::VectorXd yhat(samples);
  Eigen::VectorXd weights(samples);
  Index next = 0;
  for (const Record& record : data.records) {
    const Index count = record.u.size() - warmup;
    y.segment(next, count) = record.y.tail(count);
    yhat.segment(next, count) = simulate(fit, record.u, record.sample_time_s).tail(count);
    for (Index k = 0; k < count; ++k) weights[next + k] = weight(record, warmup + k);
    next += count;
  }
  finite = finite && yhat.allFinite();
  return evaluate_metrics(y, yhat, 0, weights);
}

std::vector<std::string> warnings_of(const TrendFit& fit) {
  std::vector<std::string> warnings;
  const Index columns = fit.covariance.rows();
  if (fit.rank < columns) {
    warnings.push_back("the data determine " + std::to_string(fit.rank) + " of " + std::to_string(columns) +
                       " coefficients: a lower order, or an input that excites more");
  }
  if (!is_stable(fit)) warnings.emplace_back("the model is not stable: a pole has no negative real part");
  return warnings;
}

CtOutcome outcome_of(const CtCommand& command) {
  const TrendStructure structure = structure_of(command);
  const Record record = load(command.data);
  const SplitData data = split(record, command.ranges);
  CtOutcome outcome;
  outcome.fit = command.max_delay > 0 ? fit_trends_with_delay(data.train, structure, command.max_delay)
                                      : fit_trends(data.train, structure);
  outcome.sample_time_s = record.sample_time_s;
  outcome.coefficients = coefficients_of(outcome.fit);
  outcome.warnings = data.warnings;
  for (const std::string& warning : warnings_of(outcome.fit)) outcome.warnings.push_back(warning);
  outcome.train = scored(outcome.fit, data.train, command.warmup, outcome.finite);
  if (!data.test.records.empty()) outcome.test = scored(outcome.fit, data.test, command.warmup, outcome.finite);
  return outcome;
}

std::string root_text(std::complex<double> root) {
  if (root.imag() == 0.0) return number(root.real());
  return number(root.real()) + (root.imag() < 0.0 ? " - " : " + ") + number(std::abs(root.imag())) + "i";
}

std::string metrics_text(const Metrics& metrics, const std::string& unit) {
  return "RMSE " + with_unit(number(metrics.rmse), unit) + "  NRMSE " + number(metrics.nrmse) + "  fit " +
         number(metrics.fit_percent) + " %  R2 " + number(metrics.r2) + "  (" + std::to_string(metrics.samples) +
         " samples)";
}

void print_outcome(const CtCommand& command, const CtOutcome& outcome) {
  const TrendFit& fit = outcome.fit;
  std::cout << "trends, " << command.method << ", order " << fit.structure.order << ", delay " << fit.structure.delay
            << " samples, sampled every " << number(outcome.sample_time_s) << " s, " << fit.rows << " rows, condition "
            << number(fit.condition, 3) << '\n';
  TextTable table{{{"coefficient", Align::left}, {"value", Align::right}, {"standard deviation", Align::right}}, {}};
  for (const Coefficient& one : outcome.coefficients) {
    table.rows.push_back({one.name, number(one.value, 8), number(one.standard_deviation, 3)});
  }
  print(std::cout, table);
  for (const std::complex<double>& pole : poles(fit)) std::cout << "pole " << root_text(pole) << " rad/s\n";
  std::cout << "one step ahead: IQ " << number(fit.squared_error) << ", IV " << number(fit.absolute_error) << '\n';
  std::cout << "train " << metrics_text(outcome.train, command.data.output_unit) << '\n';
  if (outcome.test) std::cout << "test  " << metrics_text(*outcome.test, command.data.output_unit) << '\n';
}

Json result_json(const CtCommand& command, const CtOutcome& outcome) {
  const TrendFit& fit = outcome.fit;
  Json result = {{"format", "blockid-ct"},       {"version", BLOCKID_VERSION},
                 {"method", command.method},     {"order", fit.structure.order},
                 {"delay", fit.structure.delay}, {"sample_time_s", outcome.sample_time_s}};
  result["numerator"] = std::vector<double>(fit.b.data(), fit.b.data() + fit.b.size());
  result["denominator"] = std::vector<double>(fit.a.data(), fit.a.data() + fit.a.size());
  result["coefficients"] = Json::array();
  for (const Coefficient& one : outcome.coefficients) {
    result["coefficients"].push_back({{"name", one.name},
                                      {"value", finite_or_null(one.value)},
                                      {"standard_deviation", finite_or_null(one.standard_deviation)}});
  }
  result["poles"] = Json::array();
  for (const std::complex<double>& pole : poles(fit)) result["poles"].push_back({pole.real(), pole.imag()});
  result["stable"] = is_stable(fit);
  result["rank"] = fit.rank;
  result["condition"] = finite_or_null(fit.condition);
  result["rows"] = fit.rows;
  result["squared_error"] = fit.squared_error;
  result["absolute_error"] = fit.absolute_error;
  result["train"] = metrics_json(outcome.train);
  if (outcome.test) result["test"] = metrics_json(*outcome.test);
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace

int run_ct(const CtCommand& command) {
  check_outputs({command.json});
  const CtOutcome outcome = outcome_of(command);
  for (const std::string& warning : outcome.warnings) std::cerr << "blockid: warning: " << warning << '\n';
  if (!command.quiet) print_outcome(command, outcome);
  if (!command.json.empty()) write_output(command.json, json_text(result_json(command, outcome)));
  return outcome.finite ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
