// Ctrl-C leaves the best model so far.
#include "cli/program.hpp"
#include "support/temp_dir.hpp"

#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace {

using blockid::testing::json_file;
using blockid::testing::ProgramRun;
using blockid::testing::run_program;
using blockid::testing::RunningProgram;
using blockid::testing::TempDir;
using blockid::testing::write_synthetic_csv;
using ::testing::HasSubstr;

TEST(Interrupt, LeavesTheBestModelSoFar) {
  const TempDir folder;
  write_synthetic_csv(folder / "data.csv", 40000);
  // Far more to do than the test waits for.
  RunningProgram program(
      {"fit",    "data.csv",   "--input",
       "u",      "--output",   "y",
       "--rate", "1000",       "--warmup",
       "100",    "--model",    "G1=rational(nb=5,na=5) | f=spline(knots=60) | G2=rational(nb=5,na=5)",
       "--best", "200",        "--max-iterations",
       "100000", "-o",         "model.json",
       "--json", "result.json"},
      folder.path());
  ASSERT_TRUE(program.wait_for_message(120.0));
  program.send(SIGINT);
  const ProgramRun run = program.wait();
  EXPECT_EQ(run.code, 130) << run.err;
  EXPECT_THAT(run.out, HasSubstr("interrupted"));
  EXPECT_EQ(json_file(folder / "result.json")["status"], "cancelled");
  const ProgramRun simulation =
      run_program({"simulate", "model.json", "data.csv", "--input", "u", "--output", "y"}, folder.path());
  EXPECT_EQ(simulation.code, 0) << simulation.err;
}

}  // namespace
