#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/giordano2015.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;
using Align = TextTable::Align;

/// A publication whose figures can be computed anew.
struct Reproduction {
  std::string name;
  std::string title;
  std::vector<ReproducedFigure> (*run)(std::uint64_t seed);
};

const std::vector<Reproduction>& reproductions() {
  static const std::vector<Reproduction> all = {
      {"giordano2015", "Giordano and Sjoberg 2015, section 5: the fractional approach on a simulated system",
       giordano2015}};
  return all;
}

const Reproduction& reproduction(const std::string& name) {
  std::string known;
  for (const Reproduction& one : reproductions()) {
    if (one.name == name) return one;
    known += (known.empty() ? "" : ", ") + one.name;
  }
  fail("there is nothing to reproduce under the name '", name, "'; expected ", known);
}

void print_list() {
  TextTable table{{{"name", Align::left}, {"publication", Align::left}}, {}};
  for (const Reproduction& one : reproductions()) table.rows.push_back({one.name, one.title});
  print(std::cout, table);
}

std::string published_text(const ReproducedFigure& figure) {
  return figure.published ? number(*figure.published, 4) : "-";
}

void print_figures(const std::vector<ReproducedFigure>& figures) {
  TextTable table{{{"quantity", Align::left},
                   {"published", Align::right},
                   {"reproduced", Align::right},
                   {"has to be", Align::left},
                   {"", Align::left}},
                  {}};
  for (const ReproducedFigure& figure : figures) {
    table.rows.push_back({figure.quantity, published_text(figure), number(figure.reproduced, 4), figure.tolerance,
                          figure.pass ? "pass" : "FAIL"});
  }
  print(std::cout, table);
}

Json json_of(const ReproducedFigure& figure) {
  Json row = {{"quantity", figure.quantity}};
  row["published"] = figure.published ? Json(*figure.published) : Json(nullptr);
  row["reproduced"] = figure.reproduced;
  row["tolerance"] = figure.tolerance;
  row["pass"] = figure.pass;
  return row;
}

}  // namespace

int run_reproduce(const ReproduceCommand& command) {
  if (command.list) {
    print_list();
    return kSuccess;
  }
  if (command.name.empty()) fail("reproduce: expected a name; 'blockid reproduce --list' shows them");
  const Reproduction& chosen = reproduction(command.name);
  check_outputs({command.json});
  const std::vector<ReproducedFigure> figures = chosen.run(command.seed);
  const bool pass =
      std::all_of(figures.begin(), figures.end(), [](const ReproducedFigure& figure) { return figure.pass; });
  if (!command.quiet) {
    std::cout << chosen.title << '\n';
    print_figures(figures);
    std::cout << (pass ? "all figures reproduced\n" : "not all figures reproduced\n");
  }
  if (!command.json.empty()) {
    Json result = {{"name", chosen.name}, {"rows", Json::array()}};
    for (const ReproducedFigure& figure : figures) result["rows"].push_back(json_of(figure));
    result["pass"] = pass;
    write_output(command.json, json_text(result));
  }
  return pass ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
