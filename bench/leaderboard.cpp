// Problems by estimators: RMSE of simulation on test data, parameters and time, beside published figures.

#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/fit.hpp>
#include <blockid/init/combined.hpp>
#include <blockid/init/split.hpp>
#include <blockid/problems/catalogue.hpp>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using namespace blockid;
using Json = nlohmann::ordered_json;

/// The training data of a problem in, a fitted model out.
struct Estimator {
  std::string name;
  std::function<FitResult(const problems::Problem&)> identify;
};

struct Settings {
  std::vector<std::string> problems;
  std::vector<std::string> estimators;
  int threads = 1;
  std::string json;
};

/// Below so many training samples the state at the start of a measured record counts.
constexpr Index kShort = 10000;

/// From rest; states of short measured records are estimated.
PredictionOptions prediction_of(const problems::Problem& problem) {
  const bool estimated = !problem.truth && total_samples(problem.train) < kShort;
  return {estimated ? InitialState::estimated : InitialState::zero, problem.warmup, 1};
}

Estimator chain_estimator(std::string name, const std::string& chain, const Initialiser& initialiser, int threads) {
  return {std::move(name), [chain, initialiser, threads](const problems::Problem& problem) {
            FitOptions options;
            options.refit.prediction = prediction_of(problem);
            options.refit.covariance = false;
            options.threads = threads;
            return fit(parse(chain), problem.train, initialiser, options);
          }};
}

/// All of them. A new estimator is one more entry.
std::vector<Estimator> estimators(int threads) {
  const std::string filter = "rational(nb=3,na=3)";
  const std::string curve = "spline(knots=20)";
  const std::string both = "G1=" + filter + " | f=" + curve + " | G2=" + filter;
  return {
      chain_estimator("linear", "G=" + filter + " | f=polynomial(degree=1)", exhaustive_split(), threads),
      chain_estimator("wiener", "G=" + filter + " | f=" + curve, exhaustive_split(), threads),
      chain_estimator("hammerstein", "f=" + curve + " | G=" + filter, exhaustive_split(), threads),
      chain_estimator("wiener_hammerstein_split", both, exhaustive_split(), threads),
      chain_estimator("wiener_hammerstein_fractional", both, fractional(), threads),
  };
}

Estimator estimator_by_name(const std::string& name, int threads) {
  std::string known;
  for (Estimator& estimator : estimators(threads)) {
    if (estimator.name == name) return std::move(estimator);
    known += (known.empty() ? "" : ", ") + estimator.name;
  }
  fail("--estimators: there is no estimator '", name, "'; expected ", known);
}

void print_row(const std::string& problem, const std::string& who, const std::string& rmse,
               const std::string& parameters, const std::string& seconds) {
  std::cout << "| " << problem << " | " << who << " | " << rmse << " | " << parameters << " | " << seconds << " |\n";
  std::cout.flush();
}

/// One estimator on one problem, printed; an estimator that refuses the problem has no figures but a reason.
Json entry_of(const problems::Problem& problem, const Estimator& estimator) {
  std::cerr << problem.name << ": " << estimator.name << '\n';
  try {
    const FitResult fit = estimator.identify(problem);
    const double rmse = cli::evaluate(fit.model, problem.test, prediction_of(problem)).total.rmse;
    const Index parameters = fit.report.free_parameters;
    print_row(problem.name, estimator.name, cli::with_unit(cli::number(rmse, 4), problem.unit),
              std::to_string(parameters), cli::number(fit.wall_seconds, 3));
    return {{"estimator", estimator.name}, {"test_rmse", rmse},           {"train_rmse", fit.report.rmse},
            {"parameters", parameters},    {"seconds", fit.wall_seconds}, {"status", to_text(fit.report.status)}};
  } catch (const Error& error) {
    std::cerr << problem.name << ": " << estimator.name << " gives up: " << error.what() << '\n';
    print_row(problem.name, estimator.name, "-", "-", "-");
    return {{"estimator", estimator.name}, {"error", error.what()}};
  }
}

Json published_of(const problems::Problem& problem) {
  Json result = Json::array();
  for (const problems::PublishedFigure& figure : problem.published) {
    const std::string rmse = cli::with_unit(cli::number(figure.value, 4), figure.unit);
    print_row(problem.name, "published: " + figure.method + " (" + figure.source + ")", rmse, "", "");
    result.push_back(
        {{"method", figure.method}, {"value", figure.value}, {"unit", figure.unit}, {"source", figure.source}});
  }
  return result;
}

/// A measured record that is not here is skipped by name.
Json problem_json(const problems::CatalogueEntry& entry, const std::vector<Estimator>& contenders) {
  try {
    const problems::Problem problem = entry.load();
    Json result = {{"problem", problem.name}, {"unit", problem.unit}};
    if (problem.truth) result["noise"] = problem.noise_std;
    for (const Estimator& estimator : contenders) result["entries"].push_back(entry_of(problem, estimator));
    result["published"] = published_of(problem);
    return result;
  } catch (const Error& error) {
    if (!entry.measured) throw;
    std::cerr << entry.name << " skipped: " << error.what() << '\n';
    return {{"problem", entry.name}, {"skipped", error.what()}};
  }
}

/// Written after every problem, so that an interrupted run leaves the problems before.
void run(const Settings& settings) {
  cli::check_outputs({settings.json});
  std::vector<Estimator> contenders;
  for (const std::string& name : settings.estimators) contenders.push_back(estimator_by_name(name, settings.threads));
  std::vector<problems::CatalogueEntry> entries;
  for (const std::string& name : settings.problems) entries.push_back(problems::catalogue_entry(name));
  std::cout << "| problem | estimator | test RMSE | parameters | s |\n|---|---|---|---|---|\n";
  Json result = Json::array();
  for (const problems::CatalogueEntry& entry : entries) {
    result.push_back(problem_json(entry, contenders));
    if (!settings.json.empty()) cli::write_output(settings.json, cli::json_text(result));
  }
}

void add_options(CLI::App& app, Settings& settings) {
  app.add_option("--problems", settings.problems, "problems of the catalogue")->delimiter(',')->capture_default_str();
  app.add_option("--estimators", settings.estimators, "contenders")->delimiter(',')->capture_default_str();
  app.add_option("--threads", settings.threads, "threads of each fit")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", settings.json, "file for all results, written after every problem")->type_name("FILE");
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  settings.threads = std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
  for (const problems::CatalogueEntry& entry : problems::catalogue()) settings.problems.push_back(entry.name);
  for (const Estimator& estimator : estimators(1)) settings.estimators.push_back(estimator.name);
  CLI::App app("Problems by estimators: test RMSE, parameters and time beside published figures; Markdown on stdout.");
  add_options(app, settings);
  CLI11_PARSE(app, argc, argv);
  try {
    run(settings);
  } catch (const std::exception& error) {
    std::cerr << "leaderboard: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
