// The table of problems by estimators: what is computed, what is taken from an earlier run.
#include "data/message.hpp"
#include "support/temp_dir.hpp"

#include <blockid/blocks/text.hpp>
#include <blockid/cli/leaderboard.hpp>
#include <blockid/data/atomic_file.hpp>
#include <blockid/data/error.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace blockid::cli {
namespace {

using ::testing::HasSubstr;

/// y = 2 u, recorded twice to test.
problems::Problem gain(const std::string& name) {
  Record record;
  record.u = Eigen::VectorXd::LinSpaced(200, -1.0, 1.0);
  record.y = 2.0 * record.u;
  Record other = record;
  record.name = "rising";
  other.name = "shifted";
  other.y.array() += 0.5;
  return {.name = name,
          .description = "",
          .train = record,
          .test = std::vector<Record>{record, other},
          .truth = make_model(parse("G=gain")),
          .unit = "V",
          .published = {{"guess", 0.25, "V", "nobody 1900"}}};
}

/// y = 2 u without looking; counts its calls.
Contender doubling(int& calls) {
  return {"doubling", [&calls](const DataSet&, const FitOptions&) {
            ++calls;
            Model model = make_model(parse("G=gain"));
            model.parameters[0] = 2.0;
            return FitResult{.model = model, .report = {.model = model, .status = FitStatus::converged}};
          }};
}

Contender refusing() {
  return {"refusing", [](const DataSet&, const FitOptions&) -> FitResult { fail("not today"); }};
}

std::vector<problems::CatalogueEntry> entries() {
  return {{"one", "", [] { return gain("one"); }}, {"two", "", [] { return gain("two"); }}};
}

TEST(Leaderboard, ScoresAllRecordsAndEach) {
  int calls = 0;
  const Leaderboard board = run_leaderboard(entries(), {doubling(calls), refusing()});
  ASSERT_EQ(board.rows.size(), 4U);
  const LeaderboardRow& row = board.rows[0];
  EXPECT_EQ(row.problem, "one");
  EXPECT_DOUBLE_EQ(row.of_records[0].second, 0.0);
  EXPECT_DOUBLE_EQ(row.of_records[1].second, 0.5);
  EXPECT_DOUBLE_EQ(row.test_rmse, 0.5 / std::sqrt(2.0));
  EXPECT_EQ(board.rows[1].error, "not today");
  const std::string text = markdown(board);
  EXPECT_THAT(text, HasSubstr("| one | doubling | 0.3536 V (rising 0, shifted 0.5) | 0 | 0 |"));
  EXPECT_THAT(text, HasSubstr("| one | refusing | - | - | - |"));
  EXPECT_THAT(text, HasSubstr("| two | published: guess (nobody 1900) | 0.25 V | | |"));
}

TEST(Leaderboard, GoesOnWhereItWas) {
  const testing::TempDir folder;
  const std::string file = (folder / "rows.jsonl").string();
  int calls = 0;
  LeaderboardOptions options;
  options.results = file;
  const Leaderboard first = run_leaderboard({entries()[0]}, {doubling(calls), refusing()}, options);
  EXPECT_EQ(calls, 1);
  const Leaderboard second = run_leaderboard(entries(), {doubling(calls), refusing()}, options);
  EXPECT_EQ(calls, 2) << "only the second problem is new";
  EXPECT_EQ(second.rows.size(), 4U);
  EXPECT_EQ(to_json(second)[0], to_json(first)[0]);
  options.again = true;
  run_leaderboard(entries(), {doubling(calls)}, options);
  EXPECT_EQ(calls, 4);
  const std::string lines = read_file(file);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 4) << "a row again replaces the old one";
}

TEST(Leaderboard, RefusesAFileThatIsNone) {
  const testing::TempDir folder;
  const std::string file = (folder / "rows.jsonl").string();
  write_file_atomically(file, "{\"problem\":\"one\",\"estimator\":\"x\",\"error\":\"e\"}\nnonsense\n");
  LeaderboardOptions options;
  options.results = file;
  EXPECT_THAT(BLOCKID_MESSAGE(run_leaderboard({}, {}, options)), HasSubstr("line 2 is not a row"));
}

TEST(Leaderboard, MissingRecordsAreSkippedByName) {
  const problems::CatalogueEntry missing{"far", "", []() -> problems::Problem { fail("record far is not here"); },
                                         true};
  const Leaderboard board = run_leaderboard({missing}, {});
  ASSERT_EQ(board.skipped.size(), 1U);
  EXPECT_EQ(board.skipped[0].first, "far");
  EXPECT_EQ(to_json(board)[0]["skipped"], "record far is not here");
}

TEST(Leaderboard, PeriodicRecordsStartInTheirSteadyState) {
  problems::Problem problem = gain("one");
  EXPECT_EQ(prediction_of(problem).initial_state, InitialState::zero);
  problem.truth.reset();
  EXPECT_EQ(prediction_of(problem).initial_state, InitialState::estimated);
  for (DataSet* data : {&problem.train, &problem.test}) {
    for (Record& record : data->records) record.period = 100;
  }
  EXPECT_EQ(prediction_of(problem).initial_state, InitialState::periodic);
}

}  // namespace
}  // namespace blockid::cli
