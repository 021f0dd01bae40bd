// Initialisers on random Wiener-Hammerstein systems: how often the fit ends where a fit from the truth ends, and what
// it costs.
//
// A cell is one order, one static block and one signal to noise ratio; every initialiser sees the same systems. --short
// runs the suite of short noise-free records instead, which is scored by the RMSE of simulation.

#include <blockid/cli/initialisers.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/metrics.hpp>
#include <blockid/estimators/detail/parallel_for.hpp>
#include <blockid/estimators/fit.hpp>
#include <blockid/problems/random_wh.hpp>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <iostream>
#include <limits>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace blockid;
using Json = nlohmann::ordered_json;

/// A fit succeeds when its RMSE is at most this times that of the refit from the truth.
constexpr double kSuccess = 1.05;

struct Settings {
  std::vector<Index> orders = {2, 3, 4};
  std::vector<std::string> kinds;
  std::vector<double> snr_db = {40.0, 20.0};
  std::vector<std::string> initialisers;
  int systems = 20;
  Index samples = 5000;
  int best = 8;
  std::uint64_t seed = 1;
  int threads = 1;
  /// Systems of the short suite; 0: the cells.
  int short_systems = 0;
  std::string json;
};

struct Cell {
  Index order = 0;
  problems::StaticKind kind = problems::StaticKind::polynomial;
  double snr_db = 0.0;
};

/// One fit of one system.
struct Outcome {
  double rmse = std::numeric_limits<double>::infinity();
  /// Of simulation on the test records, from rest.
  double test_rmse = std::numeric_limits<double>::infinity();
  double seconds = 0.0;
  /// Set when the initialiser refused the data.
  std::string error = {};
};

/// One system: the refit from the truth, then one outcome for each initialiser.
struct SystemOutcome {
  std::uint64_t seed = 0;
  double truth_rmse = 0.0;
  std::vector<Outcome> fits = {};
};

bool succeeded(const Outcome& outcome, const SystemOutcome& system) {
  return outcome.rmse <= kSuccess * system.truth_rmse;
}

/// Processor time of this thread: a fit on one thread, whatever else the machine does.
double thread_seconds() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

problems::StaticKind kind_of(const std::string& name) {
  std::string known;
  for (const problems::StaticKind kind : problems::static_kinds()) {
    if (problems::to_text(kind) == name) return kind;
    known += (known.empty() ? "" : ", ") + problems::to_text(kind);
  }
  fail("--kinds: there is no static block '", name, "'; expected ", known);
}

std::vector<Cell> cells_of(const Settings& settings) {
  std::vector<Cell> cells;
  for (const double snr_db : settings.snr_db) {
    for (const std::string& kind : settings.kinds) {
      for (const Index order : settings.orders) cells.push_back({order, kind_of(kind), snr_db});
    }
  }
  return cells;
}

problems::Problem problem_of(const Cell& cell, const Settings& settings, std::uint64_t seed) {
  problems::RandomWienerHammersteinOptions options;
  options.order = cell.order;
  options.static_kind = cell.kind;
  options.samples = settings.samples;
  options.test_samples = 1;  // not used here
  options.snr_db = cell.snr_db;
  options.seed = seed;
  return problems::random_wiener_hammerstein(options);
}

FitOptions fit_options(const Settings& settings, std::uint64_t seed) {
  FitOptions options;
  options.refit.prediction = {InitialState::zero, 0, 1};  // records start from rest
  options.refit.covariance = false;
  options.best = settings.best;
  options.seed = seed;
  return options;
}

Outcome fitted(const problems::Problem& problem, const std::string& initialiser, const FitOptions& options) {
  Outcome outcome;
  const double began = thread_seconds();
  try {
    const RefitReport report =
        fit(problems::true_structure(problem), problem.train, cli::initialiser_by_name(initialiser), options).report;
    outcome.rmse = report.rmse;
    const Record& test = problem.test.records.front();
    outcome.test_rmse = rmse(test.y, simulate(report.model, test.u));
  } catch (const Error& error) {
    outcome.error = error.what();
  }
  if (std::isnan(outcome.rmse)) outcome.rmse = std::numeric_limits<double>::infinity();
  outcome.seconds = thread_seconds() - began;
  return outcome;
}

SystemOutcome system_outcome(const Cell& cell, const Settings& settings, std::uint64_t seed) {
  const problems::Problem problem = problem_of(cell, settings, seed);
  const FitOptions options = fit_options(settings, seed);
  SystemOutcome system{.seed = seed, .truth_rmse = refit(*problem.truth, problem.train, options.refit).rmse};
  for (const std::string& name : settings.initialisers) system.fits.push_back(fitted(problem, name, options));
  return system;
}

/// What one initialiser did in one cell.
struct Summary {
  int successes = 0;
  int refusals = 0;
  double median_s = 0.0;
  double mean_s = 0.0;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

Summary summary_of(const std::vector<SystemOutcome>& systems, std::size_t initialiser) {
  Summary summary;
  std::vector<double> seconds;
  for (const SystemOutcome& system : systems) {
    const Outcome& outcome = system.fits[initialiser];
    summary.successes += succeeded(outcome, system) ? 1 : 0;
    summary.refusals += outcome.error.empty() ? 0 : 1;
    seconds.push_back(outcome.seconds);
  }
  summary.median_s = median(seconds);
  summary.mean_s = std::accumulate(seconds.begin(), seconds.end(), 0.0) / static_cast<double>(seconds.size());
  return summary;
}

void print_cell(const Cell& cell, const std::vector<SystemOutcome>& systems, const Settings& settings) {
  for (std::size_t k = 0; k < settings.initialisers.size(); ++k) {
    const Summary summary = summary_of(systems, k);
    std::cout << "| " << cell.order << " | " << problems::to_text(cell.kind) << " | " << cli::number(cell.snr_db)
              << " | " << settings.initialisers[k] << " | " << summary.successes << " / " << systems.size() << " | "
              << cli::number(summary.median_s, 3) << " | " << cli::number(summary.mean_s, 3) << " |\n";
  }
  std::cout.flush();
}

Json system_json(const SystemOutcome& system, const Settings& settings) {
  Json fits = Json::object();
  for (std::size_t k = 0; k < system.fits.size(); ++k) {
    const Outcome& outcome = system.fits[k];
    Json& entry = fits[settings.initialisers[k]];
    entry = {{"success", succeeded(outcome, system)}, {"rmse", outcome.rmse}, {"seconds", outcome.seconds}};
    if (!outcome.error.empty()) entry["error"] = outcome.error;
  }
  return {{"seed", system.seed}, {"rmse_from_truth", system.truth_rmse}, {"fits", fits}};
}

Json cell_json(const Cell& cell, const std::vector<SystemOutcome>& systems, const Settings& settings) {
  Json result = {{"order", cell.order}, {"kind", problems::to_text(cell.kind)}, {"snr_db", cell.snr_db}};
  for (std::size_t k = 0; k < settings.initialisers.size(); ++k) {
    const Summary summary = summary_of(systems, k);
    result["initialisers"][settings.initialisers[k]] = {
        {"share", static_cast<double>(summary.successes) / static_cast<double>(systems.size())},
        {"refusals", summary.refusals},
        {"median_seconds", summary.median_s},
        {"mean_seconds", summary.mean_s}};
  }
  for (const SystemOutcome& system : systems) result["systems"].push_back(system_json(system, settings));
  return result;
}

/// All systems of a cell, spread over the threads, with a line on stderr for each.
std::vector<SystemOutcome> run_cell(const Cell& cell, const Settings& settings) {
  std::vector<SystemOutcome> systems(static_cast<std::size_t>(settings.systems));
  std::mutex mutex;
  int done = 0;
  detail::parallel_for(systems.size(), settings.threads, [&](std::size_t k) {
    systems[k] = system_outcome(cell, settings, settings.seed + k);
    const std::lock_guard lock(mutex);
    std::cerr << "order " << cell.order << ", " << problems::to_text(cell.kind) << ", " << cell.snr_db
              << " dB: " << ++done << " of " << systems.size() << " systems\n";
  });
  return systems;
}

/// Distribution of the test RMSE of one initialiser over the short suite.
struct ShortSummary {
  double mean = 0.0;
  double median = 0.0;
  double worst = 0.0;
  /// Share of systems below 1e-3.
  double solved = 0.0;
  double median_s = 0.0;
  double longest_s = 0.0;
};

constexpr double kSolved = 1e-3;

ShortSummary short_summary_of(const std::vector<Outcome>& outcomes) {
  std::vector<double> errors;
  std::vector<double> seconds;
  ShortSummary summary;
  for (const Outcome& outcome : outcomes) {
    errors.push_back(outcome.test_rmse);
    seconds.push_back(outcome.seconds);
    summary.solved += outcome.test_rmse < kSolved ? 1.0 : 0.0;
  }
  const double count = static_cast<double>(outcomes.size());
  summary.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / count;
  summary.median = median(errors);
  summary.worst = *std::max_element(errors.begin(), errors.end());
  summary.solved /= count;
  summary.median_s = median(seconds);
  summary.longest_s = *std::max_element(seconds.begin(), seconds.end());
  return summary;
}

Json short_json(const std::vector<Outcome>& outcomes) {
  Json list = Json::array();
  for (const Outcome& outcome : outcomes) {
    list.push_back({{"rmse", outcome.rmse}, {"test_rmse", outcome.test_rmse}, {"seconds", outcome.seconds}});
    if (!outcome.error.empty()) list.back()["error"] = outcome.error;
  }
  return list;
}

/// Systems 0 .. N-1 of the short suite, structure known.
void run_short(const Settings& settings) {
  Json result = {{"short_systems", settings.short_systems}};
  std::cout << "| initialiser | systems | mean test RMSE | median | worst | below 1e-3 | median s | longest s |\n"
               "|---|---|---|---|---|---|---|---|\n";
  for (const std::string& name : settings.initialisers) {
    std::vector<Outcome> outcomes(static_cast<std::size_t>(settings.short_systems));
    detail::parallel_for(outcomes.size(), settings.threads, [&](std::size_t k) {
      outcomes[k] = fitted(problems::short_wiener_hammerstein(k), name, fit_options(settings, settings.seed));
    });
    const ShortSummary summary = short_summary_of(outcomes);
    std::cout << "| " << name << " | " << outcomes.size() << " | " << cli::number(summary.mean, 3) << " | "
              << cli::number(summary.median, 3) << " | " << cli::number(summary.worst, 3) << " | "
              << cli::number(100.0 * summary.solved, 3) << " % | " << cli::number(summary.median_s, 3) << " | "
              << cli::number(summary.longest_s, 3) << " |" << std::endl;
    result["initialisers"][name] = short_json(outcomes);
    if (!settings.json.empty()) cli::write_output(settings.json, cli::json_text(result));
  }
}

/// Written after every cell, so that an interrupted run leaves the cells before.
void run(const Settings& settings) {
  cli::check_outputs({settings.json});
  for (const std::string& name : settings.initialisers) static_cast<void>(cli::initialiser_by_name(name));
  if (settings.short_systems > 0) return run_short(settings);
  Json result = {{"success_factor", kSuccess},
                 {"samples", settings.samples},
                 {"first_seed", settings.seed},
                 {"cells", Json::array()}};
  const std::vector<Cell> cells = cells_of(settings);
  std::cout << "| order | static block | dB | initialiser | success | median s | mean s |\n"
               "|---|---|---|---|---|---|---|\n";
  for (const Cell& cell : cells) {
    const std::vector<SystemOutcome> systems = run_cell(cell, settings);
    print_cell(cell, systems, settings);
    result["cells"].push_back(cell_json(cell, systems, settings));
    if (!settings.json.empty()) cli::write_output(settings.json, cli::json_text(result));
  }
}

void add_options(CLI::App& app, Settings& settings) {
  app.add_option("--orders", settings.orders, "poles and zeros of each filter")
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--kinds", settings.kinds, "static blocks")->delimiter(',')->capture_default_str();
  app.add_option("--snr", settings.snr_db, "signal to noise ratios in dB")->delimiter(',')->capture_default_str();
  app.add_option("--init", settings.initialisers, "initialisers")->delimiter(',')->capture_default_str();
  app.add_option("--systems", settings.systems, "systems in each cell")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--short", settings.short_systems,
                 "so many systems of the short noise-free suite (256 in all) instead of the cells")
      ->check(CLI::Range(1, 256));
  app.add_option("--samples", settings.samples, "samples of a record")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--best", settings.best, "candidates that are refitted")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", settings.seed, "seed of the first system of each cell")->capture_default_str();
  app.add_option("--threads", settings.threads, "systems at a time; each fit has one thread")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", settings.json, "file for all results, written after every cell")->type_name("FILE");
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  settings.threads = std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
  for (const problems::StaticKind kind : problems::static_kinds()) settings.kinds.push_back(problems::to_text(kind));
  for (const cli::NamedInitialiser& entry : cli::initialisers()) {
    if (entry.name != "none") settings.initialisers.push_back(entry.name);
  }
  CLI::App app("Initialisers on random Wiener-Hammerstein systems: share of successes and time; Markdown on stdout.");
  add_options(app, settings);
  CLI11_PARSE(app, argc, argv);
  try {
    run(settings);
  } catch (const std::exception& error) {
    std::cerr << "wh_suite: " << error.what() << '\n';
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
