// The program on measured records.
#include "cli/program.hpp"
#include "support/data_dir.hpp"
#include "support/temp_dir.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

namespace {

using blockid::testing::json_file;
using blockid::testing::ProgramRun;
using blockid::testing::run_program;
using blockid::testing::TempDir;
using nlohmann::json;

TEST(Measured, WienerHammersteinBenchmarkReachesTheBar) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "wh2009/WienerHammerBenchMark.mat");
  const TempDir folder;
  const ProgramRun run = run_program(
      {"fit",      file.string(), "--input",     "uBenchMark",
       "--output", "yBenchMark",  "--rate-from", "fs",
       "--train",  "5200:105200", "--test",      "105200:184000",
       "--warmup", "50",          "--model",     "G1=rational(nb=3,na=3) | f=spline(knots=20) | G2=rational(nb=3,na=3)",
       "--init",   "split",       "-o",          "model.json",
       "--json",   "result.json", "--report",    "report.html"},
      folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  const json result = json_file(folder / "result.json");
  EXPECT_LE(result["test"]["rmse"].get<double>(), 0.35e-3);
  EXPECT_EQ(result["test"]["samples"], 78750);
  EXPECT_LT(std::filesystem::file_size(folder / "report.html"), 2'000'000u);
}

TEST(Measured, HeatExchangerAsHammersteinBeatsItsLinearApproximation) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "daisy/exchanger.dat");
  const TempDir folder;
  const std::vector<std::string> data = {file.string(),   "--input",    "2",       "--output",        "3",
                                         "--sample-time", "1",          "--train", "0:3000",          "--test",
                                         "3000:",         "--warmup",   "50",      "--initial-state", "estimated",
                                         "--json",        "result.json"};
  std::vector<std::string> bla = {"bla"};
  bla.insert(bla.end(), data.begin(), data.end());
  bla.insert(bla.end(), {"--orders", "2,2"});
  ASSERT_EQ(run_program(bla, folder.path()).code, 0);
  const json linear = json_file(folder / "result.json");

  std::vector<std::string> fit = {"fit"};
  fit.insert(fit.end(), data.begin(), data.end());
  fit.insert(fit.end(), {"--model", "f=polynomial(degree=4) | G=rational(nb=2,na=2)"});
  const ProgramRun run = run_program(fit, folder.path());
  ASSERT_EQ(run.code, 0) << run.err;
  const json nonlinear = json_file(folder / "result.json");
  EXPECT_LT(nonlinear["train"]["rmse"].get<double>(), linear["train"]["rmse"].get<double>());
  EXPECT_LT(nonlinear["test"]["rmse"].get<double>(), linear["test"]["rmse"].get<double>());
  for (const char* name : {"nrmse", "fit_percent", "r2", "vaf", "mae"}) {
    EXPECT_TRUE(nonlinear["test"][name].is_number()) << name;
  }
}

}  // namespace
