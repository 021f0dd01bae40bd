#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/cli/json_lists.hpp>
#include <blockid/data/atomic_file.hpp>
#include <blockid/data/load.hpp>

#include <cmath>
#include <iostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Model files are JSON objects; no data file begins with a brace.
bool looks_like_model(const std::string& file) {
  if (detect_file_kind(file) == FileKind::mat) return false;
  const std::string text = read_file(file);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '{';
}

Json json_of(const FileInfo& info) {
  Json columns = Json::array();
  for (const ColumnInfo& column : info.columns) {
    columns.push_back({{"name", column.name},
                       {"rows", column.rows},
                       {"cols", column.cols},
                       {"type", column.type},
                       {"min", finite_or_null(column.min)},
                       {"max", finite_or_null(column.max)},
                       {"mean", finite_or_null(column.mean)},
                       {"std", finite_or_null(column.std)},
                       {"non_finite", column.non_finite}});
  }
  return {{"format", "blockid-info"}, {"version", BLOCKID_VERSION}, {"kind", "data"}, {"columns", columns}};
}

void print_data(const FileInfo& info) {
  std::cout << info.path.string() << ": " << (info.kind == FileKind::mat ? "MAT file" : "CSV file") << ", "
            << info.columns.size() << (info.kind == FileKind::mat ? " variables\n" : " columns\n");
  TextTable table{{{"#", Align::right},
                   {"name", Align::left},
                   {"size", Align::right},
                   {"type", Align::left},
                   {"min", Align::right},
                   {"max", Align::right},
                   {"mean", Align::right},
                   {"std", Align::right},
                   {"non-finite", Align::right}},
                  {}};
  const auto cell = [](double value) { return std::isnan(value) ? std::string("-") : number(value); };
  for (std::size_t k = 0; k < info.columns.size(); ++k) {
    const ColumnInfo& column = info.columns[k];
    table.rows.push_back({std::to_string(k + 1), column.name,
                          std::to_string(column.rows) + " x " + std::to_string(column.cols), column.type,
                          cell(column.min), cell(column.max), cell(column.mean), cell(column.std),
                          std::to_string(column.non_finite)});
  }
  print(std::cout, table);
}

Json json_of(const Model& model) {
  Json parameters = Json::array();
  const std::vector<std::string> names = model.chain.parameter_names();
  const bool known = model.standard_deviations.size() > 0;
  for (Index k = 0; k < model.parameters.size(); ++k) {
    parameters.push_back({{"name", names[static_cast<std::size_t>(k)]},
                          {"value", model.parameters[k]},
                          {"standard_deviation", known ? Json(model.standard_deviations[k]) : Json()}});
  }
  Json filters = Json::array();
  for (const LeafBlock& leaf : leaf_blocks(model)) {
    const std::optional<double> gain = dc_gain(leaf.block, leaf.parameters);
    if (!gain) continue;
    Json filter = {{"block", leaf.path}, {"dc_gain", finite_or_null(*gain)}};
    if (const std::optional<LinearRoots> roots = linear_roots(leaf.block, leaf.parameters)) {
      filter["zeros"] = roots_json(roots->zeros, model.sample_time_s);
      filter["poles"] = roots_json(roots->poles, model.sample_time_s);
    }
    filters.push_back(std::move(filter));
  }
  return {{"format", "blockid-info"},
          {"version", BLOCKID_VERSION},
          {"kind", "model"},
          {"model", blockid::to_text(model.chain)},
          {"sample_time_s", model.sample_time_s},
          {"parameter_table", parameters},
          {"filters", filters}};
}

void print_filter(const LeafBlock& leaf, double sample_time_s) {
  const std::optional<double> gain = dc_gain(leaf.block, leaf.parameters);
  if (!gain) return;
  std::cout << "\n" << leaf.path << "  DC gain " << number(*gain) << '\n';
  const std::optional<LinearRoots> roots = linear_roots(leaf.block, leaf.parameters);
  if (!roots) return;
  TextTable table{
      {{"", Align::left}, {"root", Align::right}, {"modulus", Align::right}, {"natural frequency Hz", Align::right}},
      {}};
  const auto add = [&](const char* what, const std::vector<std::complex<double>>& list) {
    for (const std::complex<double>& root : list) {
      table.rows.push_back(
          {what, to_text(root), number(std::abs(root)), number(natural_frequency_hz(root, sample_time_s))});
    }
  };
  add("pole", roots->poles);
  add("zero", roots->zeros);
  if (!table.rows.empty()) print(std::cout, table);
}

void print_model(const std::string& file, const Model& model) {
  std::cout << file << ": model " << model.input_name << (model.input_unit.empty() ? "" : " [" + model.input_unit + "]")
            << " -> " << model.output_name << (model.output_unit.empty() ? "" : " [" + model.output_unit + "]")
            << ", sampled every " << number(model.sample_time_s) << " s (" << number(1.0 / model.sample_time_s)
            << " Hz)\n"
            << "chain  " << blockid::to_text(model.chain) << '\n'
            << "start  " << (model.initial_state.size() > 0 ? "from a stored state" : "rest") << "\n\nparameters  "
            << model.parameters.size() << '\n';
  TextTable table{{{"name", Align::left}, {"value", Align::right}, {"standard deviation", Align::right}}, {}};
  const std::vector<std::string> names = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    const bool known = model.standard_deviations.size() > 0;
    table.rows.push_back({names[static_cast<std::size_t>(k)], number(model.parameters[k], 8),
                          known ? number(model.standard_deviations[k], 3) : "-"});
  }
  print(std::cout, table);
  for (const LeafBlock& leaf : leaf_blocks(model)) print_filter(leaf, model.sample_time_s);
}

}  // namespace

int run_info(const InfoCommand& command) {
  check_outputs({command.json});
  Json result;
  if (looks_like_model(command.file)) {
    const Model model = load_model(command.file);
    print_model(command.file, model);
    result = json_of(model);
  } else {
    const FileInfo info = describe_file(command.file);
    print_data(info);
    result = json_of(info);
  }
  if (!command.json.empty()) write_output(command.json, json_text(result));
  return kSuccess;
}

}  // namespace blockid::cli
