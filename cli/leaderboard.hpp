// Problems by estimators: test RMSE, parameters and time, beside published figures.
#pragma once

#include <blockid/estimators/fit.hpp>
#include <blockid/problems/catalogue.hpp>
#include <blockid/problems/problem.hpp>

#include <nlohmann/json.hpp>

#include <functional>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

namespace blockid::cli {

/// A way from training data to a model. It may look at `train` only; `options` carry prediction, threads and progress.
struct Contender {
  std::string name;
  std::function<FitResult(const DataSet& train, const FitOptions& options)> identify;
};

/// The chain's text, started by `initialiser`.
Contender chain_contender(std::string name, std::string chain, Initialiser initialiser);

/// One contender on one problem.
struct LeaderboardRow {
  std::string problem;
  std::string contender;
  /// Root mean square error of simulation, in the problem's unit: of all test records together, of each by name, and of
  /// the training data.
  double test_rmse = 0.0;
  std::vector<std::pair<std::string, double>> of_records = {};
  double train_rmse = 0.0;
  Index parameters = 0;
  double seconds = 0.0;
  std::string status = {};
  /// Why there are no figures; empty when there are.
  std::string error = {};
};

struct LeaderboardOptions {
  int threads = 1;
  /// JSON lines, one a row: read first, rewritten whole after every row; empty: none.
  std::string results = {};
  /// Also rows that `results` has.
  bool again = false;
  /// Told what is being done; may be null.
  std::ostream* log = nullptr;
};

struct Leaderboard {
  /// Those that could be loaded, without their data.
  std::vector<problems::Problem> problems;
  /// Problem after problem, contender after contender.
  std::vector<LeaderboardRow> rows;
  /// Measured records that are not here: name and reason.
  std::vector<std::pair<std::string, std::string>> skipped;
  /// Ended by Ctrl-C (see InterruptGuard): the row that was being computed is not there.
  bool interrupted = false;
};

/// How models are started on a problem: periodic steady state where all records are periodic; estimated states where a
/// measured record is short; otherwise rest.
PredictionOptions prediction_of(const problems::Problem& problem);

/// Every contender on every problem. Throws Error for a results file that is none.
Leaderboard run_leaderboard(const std::vector<problems::CatalogueEntry>& entries,
                            const std::vector<Contender>& contenders, const LeaderboardOptions& options = {});

/// A Markdown table with the published figures of each problem and their sources beneath its rows.
std::string markdown(const Leaderboard& board);

/// The same as JSON: one object a problem.
nlohmann::ordered_json to_json(const Leaderboard& board);

}  // namespace blockid::cli
