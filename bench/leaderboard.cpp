// Problems of the catalogue by estimators, beside published figures.

#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/interrupt.hpp>
#include <blockid/cli/leaderboard.hpp>
#include <blockid/cli/outputs.hpp>

#include <blockid/data/error.hpp>
#include <blockid/init/automatic.hpp>
#include <blockid/init/combined.hpp>
#include <blockid/init/split.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using namespace blockid;
using cli::chain_contender;
using cli::Contender;

struct Settings {
  std::vector<std::string> problems;
  std::vector<std::string> estimators;
  cli::LeaderboardOptions run;
  std::string json;
};

/// All of them. A new estimator is one more entry.
std::vector<Contender> contenders() {
  const std::string filter = "rational(nb=3,na=3)";
  const std::string curve = "spline(knots=20)";
  const std::string both = "G1=" + filter + " | f=" + curve + " | G2=" + filter;
  return {
      chain_contender("linear", "G=" + filter + " | f=polynomial(degree=1)", exhaustive_split()),
      chain_contender("wiener", "G=" + filter + " | f=" + curve, exhaustive_split()),
      chain_contender("hammerstein", "f=" + curve + " | G=" + filter, exhaustive_split()),
      chain_contender("wiener_hammerstein_split", both, exhaustive_split()),
      chain_contender("wiener_hammerstein_fractional", both, fractional()),
      {"wiener_hammerstein_chosen",
       [](const DataSet& train, const FitOptions& options) {
         return fit_wiener_hammerstein(train, {.fit = options}).fit;
       }},
  };
}

Contender contender_by_name(const std::string& name) {
  std::string known;
  for (Contender& contender : contenders()) {
    if (contender.name == name) return std::move(contender);
    known += (known.empty() ? "" : ", ") + contender.name;
  }
  fail("--estimators: there is no estimator '", name, "'; expected ", known);
}

int run(Settings settings) {
  cli::check_outputs({settings.json, settings.run.results});
  std::vector<Contender> chosen;
  for (const std::string& name : settings.estimators) chosen.push_back(contender_by_name(name));
  std::vector<problems::CatalogueEntry> entries;
  for (const std::string& name : settings.problems) entries.push_back(problems::catalogue_entry(name));
  settings.run.log = &std::cerr;
  const cli::InterruptGuard guard;
  const cli::Leaderboard board = run_leaderboard(entries, chosen, settings.run);
  std::cout << markdown(board) << std::flush;
  if (!settings.json.empty()) cli::write_output(settings.json, cli::json_text(to_json(board)));
  return board.interrupted ? cli::kInterrupted : EXIT_SUCCESS;
}

void add_options(CLI::App& app, Settings& settings) {
  app.add_option("--problems", settings.problems, "problems of the catalogue")->delimiter(',')->capture_default_str();
  app.add_option("--estimators", settings.estimators, "contenders")->delimiter(',')->capture_default_str();
  app.add_option("--threads", settings.run.threads, "threads of each fit")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--results", settings.run.results,
                 "rows as JSON lines, kept up to date: a run that was stopped goes on where it was")
      ->type_name("FILE");
  app.add_flag("--again", settings.run.again, "compute rows anew that --results has");
  app.add_option("--json", settings.json, "file for the whole table, written at the end")->type_name("FILE");
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  settings.run.threads = std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
  for (const problems::CatalogueEntry& entry : problems::catalogue()) settings.problems.push_back(entry.name);
  for (const Contender& contender : contenders()) settings.estimators.push_back(contender.name);
  CLI::App app(
      "Problems by estimators: test RMSE, parameters and time beside published figures; Markdown on stdout, progress "
      "on "
      "stderr. Ctrl-C ends it after what is finished (exit code 130).");
  add_options(app, settings);
  CLI11_PARSE(app, argc, argv);
  try {
    return run(std::move(settings));
  } catch (const std::exception& error) {
    std::cerr << "leaderboard: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
}
