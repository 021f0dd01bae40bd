#include <blockid/cli/commands.hpp>
#include <blockid/cli/crowder_callafon.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/garnier2004.hpp>
#include <blockid/cli/giordano2015.hpp>
#include <blockid/cli/janiszowski1999.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/welsh2003.hpp>
#include <blockid/data/error.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

namespace blockid::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A publication whose figures can be computed anew.
struct Publication {
  std::string name;
  std::string title;
  Reproduction (*run)(std::uint64_t seed);
};

/// A new publication is one more entry.
const std::vector<Publication>& publications() {
  static const std::vector<Publication> kAll = {
      {"garnier2004", "Garnier, Goodwin, Welsh 2004, section 5: an eighth-order system over four decades", garnier2004},
      {"garnier2004-robot-arm", "Garnier, Goodwin, Welsh 2004, section 6: a measured robot arm", garnier2004_robot_arm},
      {"giordano2015", "Giordano and Sjoberg 2015, section 5: the fractional approach on a simulated system",
       giordano2015},
      {"janiszowski1999-table1", "Janiszowski 1999, table 1: errors of discrete-time trends under disturbances",
       janiszowski1999_table1},
      {"janiszowski1999-table2", "Janiszowski 1999, table 2: coefficients of five structures", janiszowski1999_table2},
      {"welsh2003", "Welsh and Goodwin 2003, table 1: five bases over nine decades", welsh2003},
      {"welsh2003-theorem1", "Welsh and Goodwin 2003, theorem 1: condition numbers without end of the band",
       welsh2003_theorem1},
      {"crowder-callafon",
       "Crowder and de Callafon, section V: coprime factor uncertainty of an integrator under PI control",
       crowder_callafon}};
  return kAll;
}

const Publication& publication(const std::string& name) {
  std::string known;
  for (const Publication& one : publications()) {
    if (one.name == name) return one;
    known += (known.empty() ? "" : ", ") + one.name;
  }
  fail("there is nothing to reproduce under the name '", name, "'; expected ", known);
}

void print_list() {
  TextTable table{{{"name", Align::left}, {"publication", Align::left}}, {}};
  for (const Publication& one : publications()) table.rows.push_back({one.name, one.title});
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

/// Files of the pictures in the folder.
std::vector<std::string> picture_files(const std::vector<Picture>& pictures, const fs::path& folder) {
  std::vector<std::string> files;
  for (const Picture& picture : pictures) files.push_back((folder / (picture.stem + ".svg")).string());
  return files;
}

/// All are drawn before the first is written.
void write_pictures(const std::vector<Picture>& pictures, const fs::path& folder) {
  std::vector<std::string> drawn;
  for (const Picture& picture : pictures) {
    drawn.push_back(gnuplot_document(picture.script, picture.title, picture.width, picture.height));
  }
  const std::vector<std::string> files = picture_files(pictures, folder);
  check_outputs(files);
  for (std::size_t k = 0; k < files.size(); ++k) write_output(files[k], drawn[k]);
}

/// Whether the pictures that were asked for can be drawn; says so on stderr when they cannot.
bool can_draw(const std::string& folder) {
  if (folder.empty()) return false;
  if (gnuplot_is_there()) return true;
  std::cerr << "blockid: gnuplot is not installed (or not on the PATH), so no pictures are written; on Debian: apt "
               "install gnuplot-nox\n";
  return false;
}

void print_notes(const std::vector<std::string>& notes) {
  if (notes.empty()) return;
  std::cout << "notes on the print\n";
  for (const std::string& note : notes) std::cout << "  - " << note << '\n';
}

Json json_of(const Publication& publication, const Reproduction& result, bool pass,
             const std::vector<std::string>& files) {
  Json json = {{"name", publication.name}, {"rows", Json::array()}};
  for (const ReproducedFigure& figure : result.figures) json["rows"].push_back(json_of(figure));
  json["notes"] = result.notes;
  json["pictures"] = files;
  json["pass"] = pass;
  return json;
}

}  // namespace

int run_reproduce(const ReproduceCommand& command) {
  if (command.list) {
    print_list();
    return kSuccess;
  }
  if (command.name.empty()) fail("reproduce: expected a name; 'blockid reproduce --list' shows them");
  const Publication& chosen = publication(command.name);
  check_outputs({command.json});
  if (!command.folder.empty()) make_folder(command.folder);
  const bool draws = can_draw(command.folder);
  const Reproduction result = chosen.run(command.seed);
  const bool pass = std::all_of(result.figures.begin(), result.figures.end(),
                                [](const ReproducedFigure& figure) { return figure.pass; });
  std::vector<std::string> files;
  if (!command.quiet) {
    std::cout << chosen.title << '\n';
    print_figures(result.figures);
    print_notes(result.notes);
    std::cout << (pass ? "all figures reproduced\n" : "not all figures reproduced\n") << std::flush;
  }
  if (draws) {
    write_pictures(result.pictures, command.folder);
    files = picture_files(result.pictures, command.folder);
    if (!command.quiet) std::cout << files.size() << " pictures in " << command.folder << '\n';
  }
  if (!command.json.empty()) write_output(command.json, json_text(json_of(chosen, result, pass, files)));
  return pass ? kSuccess : kNumericalFailure;
}

}  // namespace blockid::cli
