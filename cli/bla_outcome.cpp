#include <blockid/cli/bla_outcome.hpp>

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/json_lists.hpp>
#include <blockid/cli/metrics_table.hpp>
#include <blockid/cli/text_table.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

bool same(const BlaOrders& a, const BlaOrders& b) { return a.nb == b.nb && a.na == b.na && a.nk == b.nk; }

Json orders_json(const BlaOrders& orders) { return {{"nb", orders.nb}, {"na", orders.na}, {"nk", orders.nk}}; }

/// Position of the smallest number; the size of the table when there is none.
std::size_t smallest(const std::vector<BlaScore>& table, double BlaScore::*figure) {
  std::size_t best = table.size();
  for (std::size_t k = 0; k < table.size(); ++k) {
    if (std::isnan(table[k].*figure)) continue;
    if (best == table.size() || table[k].*figure < table[best].*figure) best = k;
  }
  return best;
}

}  // namespace

const BlaScore& best_score(const std::vector<BlaScore>& table) {
  const bool validated = std::isfinite(table.front().validation_rmse);
  const auto key = [&](const BlaScore& score) {
    const double value = validated ? score.validation_rmse : score.bic;
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
  };
  return *std::min_element(table.begin(), table.end(),
                           [&](const BlaScore& a, const BlaScore& b) { return key(a) < key(b); });
}

std::string marks(const BlaOutcome& outcome, std::size_t k) {
  const BlaScore& score = outcome.table[k];
  std::string text = same(score.orders, outcome.orders) ? "chosen" : "";
  const auto add = [&](double BlaScore::*figure, const char* mark) {
    if (k == smallest(outcome.table, figure)) text += (text.empty() ? "" : ", ") + std::string(mark);
  };
  add(&BlaScore::aic, "best AIC");
  add(&BlaScore::bic, "best BIC");
  add(&BlaScore::validation_rmse, "best test");
  return text;
}

DataSet deviations(const DataSet& data, const BestLinearApproximation& bla) {
  DataSet result = data;
  for (Record& record : result.records) {
    record.u.array() -= bla.input_mean;
    record.y.array() -= bla.output_mean;
  }
  return result;
}

LinearRoots bla_roots(const BlaOutcome& outcome) {
  const LeafBlock leaf = leaf_blocks(outcome.bla.model).front();
  return linear_roots(leaf.block, leaf.parameters).value_or(LinearRoots{});
}

std::string to_text(const BlaOrders& orders) {
  return "nb=" + std::to_string(orders.nb) + ", na=" + std::to_string(orders.na) + ", nk=" + std::to_string(orders.nk);
}

void print_bla(std::ostream& stream, const BlaOutcome& outcome) {
  const Model& model = outcome.bla.model;
  stream << outcome.source << ": " << model.input_name << " -> " << model.output_name << ", sampled every "
         << number(model.sample_time_s) << " s (" << number(1.0 / model.sample_time_s) << " Hz)\n";
  if (!outcome.table.empty()) {
    stream << "\norders\n";
    TextTable table{{{"nb", Align::right},
                     {"na", Align::right},
                     {"nk", Align::right},
                     {"RMSE", Align::right},
                     {"AIC", Align::right},
                     {"BIC", Align::right},
                     {"test RMSE", Align::right},
                     {"", Align::left}},
                    {}};
    for (std::size_t k = 0; k < outcome.table.size(); ++k) {
      const BlaScore& score = outcome.table[k];
      table.rows.push_back(
          {std::to_string(score.orders.nb), std::to_string(score.orders.na), std::to_string(score.orders.nk),
           number(score.rmse), number(score.aic, 8), number(score.bic, 8),
           std::isnan(score.validation_rmse) ? "-" : number(score.validation_rmse), marks(outcome, k)});
    }
    print(stream, table);
  }
  stream << "\nbest linear approximation  " << to_text(outcome.orders) << " (" << outcome.choice << ")\n";
  TextTable metrics{{{"", Align::left},
                     {"RMSE", Align::right},
                     {"NRMSE", Align::right},
                     {"fit %", Align::right},
                     {"R2", Align::right},
                     {"samples", Align::right}},
                    {short_metrics_row("train", outcome.train.total)}};
  if (outcome.test) metrics.rows.push_back(short_metrics_row("test", outcome.test->total));
  print(stream, metrics);
  const LeafBlock leaf = leaf_blocks(model).front();
  stream << "  DC gain " << number(dc_gain(leaf.block, leaf.parameters).value_or(std::nan(""))) << ", input mean "
         << with_unit(number(outcome.bla.input_mean), outcome.input_unit) << ", output mean "
         << with_unit(number(outcome.bla.output_mean), outcome.output_unit) << "\n  noise and nonlinear distortion "
         << with_unit(number(outcome.bla.rmse), outcome.output_unit) << '\n';
  if (outcome.measured) {
    stream << "  measured: " << method_text(*outcome.measured) << '\n';
    for (const std::string& text : verdict_texts(*outcome.measured)) stream << "  " << text << '\n';
  }
  TextTable table{
      {{"", Align::left}, {"root", Align::right}, {"modulus", Align::right}, {"natural frequency Hz", Align::right}},
      {}};
  const LinearRoots roots = bla_roots(outcome);
  const auto add = [&](const char* what, const std::vector<std::complex<double>>& list) {
    for (const std::complex<double>& root : list) {
      table.rows.push_back(
          {what, to_text(root), number(std::abs(root)), number(natural_frequency_hz(root, model.sample_time_s))});
    }
  };
  add("pole", roots.poles);
  add("zero", roots.zeros);
  if (!table.rows.empty()) print(stream, table);
  for (const std::string& warning : outcome.warnings) stream << "warning: " << warning << '\n';
}

Json bla_json(const BlaOutcome& outcome) {
  const Model& model = outcome.bla.model;
  Json table = Json::array();
  for (const BlaScore& score : outcome.table) {
    Json entry = orders_json(score.orders);
    entry["rmse"] = finite_or_null(score.rmse);
    entry["aic"] = finite_or_null(score.aic);
    entry["bic"] = finite_or_null(score.bic);
    entry["validation_rmse"] = finite_or_null(score.validation_rmse);
    table.push_back(std::move(entry));
  }
  Json parameters = Json::array();
  const std::vector<std::string> names = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    const bool known = outcome.covariance.size() > 0;
    parameters.push_back(
        {{"name", names[static_cast<std::size_t>(k)]},
         {"value", finite_or_null(model.parameters[k])},
         {"standard_deviation", known ? finite_or_null(std::sqrt(outcome.covariance(k, k))) : Json()}});
  }
  const LeafBlock leaf = leaf_blocks(model).front();
  const LinearRoots roots = bla_roots(outcome);
  Json result = {{"format", "blockid-bla"}, {"version", BLOCKID_VERSION}};
  result["order_table"] = table;
  const auto add_best = [&](const char* name, double BlaScore::*figure) {
    const std::size_t k = smallest(outcome.table, figure);
    if (k < outcome.table.size()) result["best_orders"][name] = orders_json(outcome.table[k].orders);
  };
  add_best("aic", &BlaScore::aic);
  add_best("bic", &BlaScore::bic);
  add_best("validation_rmse", &BlaScore::validation_rmse);
  result["orders"] = orders_json(outcome.orders);
  result["choice"] = outcome.choice;
  result["start"] = outcome.bla.how;
  result["status"] = blockid::to_text(outcome.bla.refit.status);
  result["parameter_table"] = parameters;
  result["dc_gain"] = finite_or_null(dc_gain(leaf.block, leaf.parameters).value_or(std::nan("")));
  result["input_mean"] = outcome.bla.input_mean;
  result["output_mean"] = outcome.bla.output_mean;
  result["poles"] = roots_json(roots.poles, model.sample_time_s);
  result["zeros"] = roots_json(roots.zeros, model.sample_time_s);
  result["train"] = metrics_json(outcome.train.total);
  if (outcome.test) result["test"] = metrics_json(outcome.test->total);
  if (outcome.measured) result["frequency_response"] = measured_json(*outcome.measured);
  result["data"] = {{"source", outcome.source},
                    {"input", model.input_name},
                    {"output", model.output_name},
                    {"sample_time_s", model.sample_time_s}};
  result["units"] = {{"input", outcome.input_unit}, {"output", outcome.output_unit}};
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace blockid::cli
