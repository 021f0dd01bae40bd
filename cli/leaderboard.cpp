#include <blockid/cli/leaderboard.hpp>

#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/interrupt.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/text.hpp>
#include <blockid/data/atomic_file.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <ostream>
#include <sstream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Below so many training samples the state at the start of a measured record counts.
constexpr Index kShort = 10000;

Json json_of(const LeaderboardRow& row) {
  Json json = {{"problem", row.problem}, {"estimator", row.contender}};
  if (!row.error.empty()) {
    json["error"] = row.error;
    return json;
  }
  json["test_rmse"] = row.test_rmse;
  for (const auto& [name, rmse] : row.of_records) json["test_rmse_of"][name] = rmse;
  json["train_rmse"] = row.train_rmse;
  json["parameters"] = row.parameters;
  json["seconds"] = row.seconds;
  json["status"] = row.status;
  return json;
}

LeaderboardRow row_of(const Json& json) {
  LeaderboardRow row{json.at("problem").get<std::string>(), json.at("estimator").get<std::string>()};
  row.error = json.value("error", "");
  if (!row.error.empty()) return row;
  // What was not finite was written as null.
  const auto real = [](const Json& value) { return value.is_null() ? std::nan("") : value.get<double>(); };
  row.test_rmse = real(json.at("test_rmse"));
  if (json.contains("test_rmse_of")) {
    for (const auto& [name, rmse] : json.at("test_rmse_of").items()) row.of_records.emplace_back(name, real(rmse));
  }
  row.train_rmse = real(json.at("train_rmse"));
  row.parameters = json.at("parameters").get<Index>();
  row.seconds = json.at("seconds").get<double>();
  row.status = json.at("status").get<std::string>();
  return row;
}

/// The rows of earlier runs.
class Results {
 public:
  explicit Results(std::string file) : file_(std::move(file)) {
    if (file_.empty()) return;
    check_outputs({file_});
    if (!std::filesystem::exists(file_)) return;
    std::istringstream lines(read_file(file_));
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
      try {
        rows_.push_back(row_of(Json::parse(line)));
      } catch (const nlohmann::json::exception& error) {
        fail(file_, ": line ", number, " is not a row of a leaderboard: ", error.what());
      }
    }
  }

  const LeaderboardRow* find(const std::string& problem, const std::string& contender) const {
    const auto found = std::find_if(rows_.begin(), rows_.end(), [&](const LeaderboardRow& row) {
      return row.problem == problem && row.contender == contender;
    });
    return found == rows_.end() ? nullptr : &*found;
  }

  /// Replaces an older row of the same pair; the file is whole at any time.
  void add(const LeaderboardRow& row) {
    std::erase_if(
        rows_, [&](const LeaderboardRow& old) { return old.problem == row.problem && old.contender == row.contender; });
    rows_.push_back(row);
    if (file_.empty()) return;
    std::string text;
    for (const LeaderboardRow& one : rows_) text += json_of(one).dump() + "\n";
    write_output(file_, text);
  }

 private:
  std::string file_;
  std::vector<LeaderboardRow> rows_;
};

/// Nothing when it was interrupted; a contender that refuses the problem has a reason instead of figures.
std::optional<LeaderboardRow> compute(const problems::Problem& problem, const Contender& contender, int threads) {
  LeaderboardRow row{problem.name, contender.name};
  FitOptions options;
  options.refit.prediction = prediction_of(problem);
  options.refit.covariance = false;
  options.threads = threads;
  options.progress = [](const Progress&) { return !interrupted(); };
  try {
    const FitResult fit = contender.identify(problem.train, options);
    if (interrupted()) return std::nullopt;
    const Evaluation test = evaluate(fit.model, problem.test, options.refit.prediction);
    row.test_rmse = test.total.rmse;
    if (test.records.size() > 1) {
      for (const ScoredRecord& scored : test.records) {
        row.of_records.emplace_back(scored.record.name, scored.metrics.rmse);
      }
    }
    row.train_rmse = fit.report.rmse;
    row.parameters = fit.report.free_parameters;
    row.seconds = fit.wall_seconds;
    row.status = blockid::to_text(fit.report.status);
  } catch (const Error& error) {
    row.error = error.what();
  }
  return row;
}

std::optional<problems::Problem> loaded(const problems::CatalogueEntry& entry, Leaderboard& board) {
  try {
    return entry.load();
  } catch (const Error& error) {
    if (!entry.measured) throw;
    board.skipped.emplace_back(entry.name, error.what());
    return std::nullopt;
  }
}

std::string rmse_text(const LeaderboardRow& row, const std::string& unit) {
  if (!row.error.empty()) return "-";
  std::string text = with_unit(number(row.test_rmse, 4), unit);
  for (std::size_t k = 0; k < row.of_records.size(); ++k) {
    text += (k == 0 ? " (" : ", ") + row.of_records[k].first + " " + number(row.of_records[k].second, 4);
  }
  return text + (row.of_records.empty() ? "" : ")");
}

}  // namespace

Contender chain_contender(std::string name, std::string chain, Initialiser initialiser) {
  return {std::move(name), [chain = std::move(chain), initialiser = std::move(initialiser)](const DataSet& train,
                                                                                            const FitOptions& options) {
            return fit(parse(chain), train, initialiser, options);
          }};
}

PredictionOptions prediction_of(const problems::Problem& problem) {
  const auto all_periodic = [](const DataSet& data) {
    return std::all_of(data.records.begin(), data.records.end(),
                       [](const Record& record) { return record.period > 0; });
  };
  if (all_periodic(problem.train) && all_periodic(problem.test)) return {InitialState::periodic, problem.warmup, 1};
  const bool estimated = !problem.truth && total_samples(problem.train) < kShort;
  return {estimated ? InitialState::estimated : InitialState::zero, problem.warmup, 1};
}

Leaderboard run_leaderboard(const std::vector<problems::CatalogueEntry>& entries,
                            const std::vector<Contender>& contenders, const LeaderboardOptions& options) {
  Results results(options.results);
  Leaderboard board;
  const std::size_t count = entries.size() * contenders.size();
  std::size_t place = 0;
  for (const problems::CatalogueEntry& entry : entries) {
    std::optional<problems::Problem> problem = loaded(entry, board);
    if (!problem) {
      place += contenders.size();
      if (options.log != nullptr)
        *options.log << entry.name << " skipped: " << board.skipped.back().second << std::endl;
      continue;
    }
    for (const Contender& contender : contenders) {
      ++place;
      const LeaderboardRow* known = options.again ? nullptr : results.find(problem->name, contender.name);
      if (options.log != nullptr) {
        *options.log << place << " of " << count << "  " << problem->name << ": " << contender.name
                     << (known != nullptr ? " is there" : "") << std::endl;
      }
      if (known == nullptr) {
        const std::optional<LeaderboardRow> row = compute(*problem, contender, options.threads);
        if (!row) {
          board.interrupted = true;
          break;
        }
        results.add(*row);
        known = results.find(problem->name, contender.name);
        if (options.log != nullptr && !row->error.empty()) *options.log << "  gives up: " << row->error << std::endl;
      }
      board.rows.push_back(*known);
    }
    problem->train = {};
    problem->test = {};
    board.problems.push_back(std::move(*problem));
    if (board.interrupted) break;
  }
  return board;
}

std::string markdown(const Leaderboard& board) {
  std::string text = "| problem | estimator | test RMSE | parameters | s |\n|---|---|---|---|---|\n";
  for (const problems::Problem& problem : board.problems) {
    for (const LeaderboardRow& row : board.rows) {
      if (row.problem != problem.name) continue;
      const bool known = row.error.empty();
      text += "| " + row.problem + " | " + row.contender + " | " + rmse_text(row, problem.unit) + " | " +
              (known ? std::to_string(row.parameters) : "-") + " | " + (known ? number(row.seconds, 3) : "-") + " |\n";
    }
    for (const problems::PublishedFigure& figure : problem.published) {
      text += "| " + problem.name + " | published: " + figure.method + " (" + figure.source + ") | " +
              with_unit(number(figure.value, 4), figure.unit) + " | | |\n";
    }
    if (problem.noise_std > 0.0) {
      text += "| " + problem.name + " | deviation of the noise | " +
              with_unit(number(problem.noise_std, 4), problem.unit) + " | | |\n";
    }
  }
  return text;
}

Json to_json(const Leaderboard& board) {
  Json all = Json::array();
  for (const problems::Problem& problem : board.problems) {
    Json one = {{"problem", problem.name}, {"unit", problem.unit}};
    if (problem.noise_std > 0.0) one["noise"] = problem.noise_std;
    one["entries"] = Json::array();
    for (const LeaderboardRow& row : board.rows) {
      if (row.problem != problem.name) continue;
      Json entry = json_of(row);
      entry.erase("problem");
      one["entries"].push_back(std::move(entry));
    }
    one["published"] = Json::array();
    for (const problems::PublishedFigure& figure : problem.published) {
      one["published"].push_back(
          {{"method", figure.method}, {"value", figure.value}, {"unit", figure.unit}, {"source", figure.source}});
    }
    all.push_back(std::move(one));
  }
  for (const auto& [name, reason] : board.skipped) all.push_back({{"problem", name}, {"skipped", reason}});
  return all;
}

}  // namespace blockid::cli
