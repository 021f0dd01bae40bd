// The program's commands on small files, checked by values.
#include "cli/program.hpp"
#include "support/signals.hpp"
#include "support/temp_dir.hpp"

#include <blockid/data/atomic_file.hpp>
#include <blockid/data/csv.hpp>
#include <blockid/data/metrics.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

namespace {

using blockid::testing::json_file;
using blockid::testing::kSyntheticChain;
using blockid::testing::occurrences;
using blockid::testing::ProgramRun;
using blockid::testing::run_program;
using blockid::testing::TempDir;
using blockid::testing::write_synthetic_csv;
using nlohmann::json;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

using Arguments = std::vector<std::string>;

/// A synthetic record, and the fit of it that most tests look at.
class Program : public ::testing::Test {
 protected:
  static constexpr long kSamples = 6000;

  void SetUp() override { noise_ = write_synthetic_csv(folder_ / "data.csv", kSamples); }

  ProgramRun run(const Arguments& arguments, const Arguments& environment = {}) const {
    return run_program(arguments, folder_.path(), environment);
  }

  static Arguments fit_arguments(const Arguments& more = {}) {
    Arguments arguments = {"fit",        "data.csv",      "--input",   "u",      "--output", "y",          "--rate",
                           "1000",       "--train",       "0:4000",    "--test", "4000:",    "--warmup",   "100",
                           "--model",    kSyntheticChain, "--threads", "1",      "-o",       "model.json", "--json",
                           "result.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  json result(const std::string& name = "result.json") const { return json_file(folder_ / name); }

  TempDir folder_;
  double noise_ = 0.0;
};

TEST_F(Program, FitRecoversTheSyntheticSystem) {
  const ProgramRun fit = run(fit_arguments());
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.out, HasSubstr("candidates"));
  EXPECT_THAT(fit.out, HasSubstr("standard deviation"));

  const json r = result();
  EXPECT_EQ(r["status"], "converged");
  EXPECT_EQ(r["parameters"], 18);
  EXPECT_EQ(r["parameters_total"], 20);
  EXPECT_EQ(r["requested_model"], kSyntheticChain);
  EXPECT_THAT(r["model"].get<std::string>(), HasSubstr("polynomial(degree=5,range="));
  EXPECT_GT(r["iterations"].get<int>(), 0);
  EXPECT_GT(r["wall_seconds"].get<double>(), 0.0);
  EXPECT_EQ(r["seed"], 1);
  EXPECT_EQ(r["threads"], 1);
  EXPECT_EQ(r["version"].get<std::string>().find("0."), 0u);
  // Noise at 40 dB leaves a fit of 99 %; the RMSE is the noise's.
  EXPECT_NEAR(r["test"]["fit_percent"].get<double>(), 99.0, 0.05);
  EXPECT_NEAR(r["test"]["rmse"].get<double>(), noise_, 0.04 * noise_);
  EXPECT_NEAR(r["train"]["rmse"].get<double>(), noise_, 0.04 * noise_);
  EXPECT_NEAR(r["noise_standard_deviation"].get<double>(), noise_, 0.04 * noise_);
  EXPECT_EQ(r["train"]["samples"], 3900);
  EXPECT_EQ(r["test"]["samples"], 1900);
  EXPECT_EQ(r["test"]["ranges"], json::array({"4000:6000"}));

  std::map<std::string, json> parameters;
  for (const json& entry : r["parameter_table"]) parameters[entry["name"]] = entry;
  // The truth: G1 has the poles 0.7 and 0.5 +- 0.6i, G2 0.8 and 0.6 +- 0.3i.
  const std::map<std::string, double> truth = {{"G1.a1", -1.7}, {"G1.a2", 1.31}, {"G1.a3", -0.427},
                                               {"G2.a1", -2.0}, {"G2.a2", 1.41}, {"G2.a3", -0.36}};
  for (const auto& [name, value] : truth) {
    const double deviation = parameters.at(name)["standard_deviation"];
    EXPECT_NEAR(parameters.at(name)["value"].get<double>(), value, 4.5 * deviation) << name;
    EXPECT_LT(deviation, 0.02) << name;
    EXPECT_FALSE(parameters.at(name)["held"]) << name;
  }
  EXPECT_EQ(parameters.at("G1.b0")["value"], 1.0);
  EXPECT_TRUE(parameters.at("G1.b0")["held"]);
  EXPECT_TRUE(parameters.at("G1.b0")["standard_deviation"].is_null());

  ASSERT_GE(r["candidates"].size(), 2u);
  const json& best = r["candidates"][0];
  EXPECT_TRUE(best["refitted"]);
  EXPECT_THAT(best["how"].get<std::string>(), AnyOf(HasSubstr("release"), HasSubstr("classified")));
  // The initialiser has refitted its candidates on these samples: the fit may find nothing to mend. Equal to rounding
  // is no loss to fit().
  EXPECT_LE(best["final_rmse"].get<double>(), best["rmse"].get<double>() * (1.0 + 1e-9));
}

TEST_F(Program, SameArgumentsGiveTheSameModel) {
  ASSERT_EQ(run(fit_arguments({"--threads", "1"})).code, 1);  // given twice
  ASSERT_EQ(run(fit_arguments()).code, 0);
  const std::string first = blockid::read_file(folder_ / "model.json");
  ASSERT_EQ(run(fit_arguments()).code, 0);
  EXPECT_EQ(blockid::read_file(folder_ / "model.json"), first);
}

TEST_F(Program, SimulationOfTheSavedModelHasTheFitsMetricsBitForBit) {
  ASSERT_EQ(run(fit_arguments()).code, 0);
  const ProgramRun simulation = run({"simulate", "model.json", "data.csv", "--input", "u", "--output", "y", "--range",
                                     "4000:", "--warmup", "100", "-o", "yhat.csv", "--json", "simulation.json"});
  ASSERT_EQ(simulation.code, 0) << simulation.err;
  const json metrics = result("simulation.json")["metrics"];
  const json test = result()["test"];
  for (const char* name : {"rmse", "nrmse", "fit_percent", "r2", "vaf", "mae", "samples", "warmup"}) {
    EXPECT_EQ(metrics[name], test[name]) << name;
  }
  const blockid::Table table = blockid::read_csv(folder_ / "yhat.csv");
  EXPECT_EQ(table.names, (Arguments{"t_s", "u", "y", "yhat", "error"}));
  ASSERT_EQ(table.values.rows(), 2000);
  EXPECT_EQ(table.values(0, 0), 4.0);
  EXPECT_EQ(table.values(1, 0), 4.001);
  EXPECT_EQ(table.values.col(4), table.values.col(2) - table.values.col(3));
  EXPECT_EQ(blockid::rmse(table.values.col(2), table.values.col(3), 100), test["rmse"].get<double>());
}

TEST_F(Program, SimulationWithoutOutputNeedsNone) {
  ASSERT_EQ(run(fit_arguments()).code, 0);
  const ProgramRun simulation = run({"simulate", "model.json", "data.csv", "--input", "u", "-o", "yhat.csv"});
  ASSERT_EQ(simulation.code, 0) << simulation.err;
  EXPECT_THAT(simulation.out, Not(HasSubstr("RMSE")));
  const blockid::Table table = blockid::read_csv(folder_ / "yhat.csv");
  EXPECT_EQ(table.names, (Arguments{"t_s", "u", "yhat"}));
  EXPECT_EQ(table.values.rows(), kSamples);
}

TEST_F(Program, NoTestRangeNoTestBlock) {
  Arguments arguments = fit_arguments();
  const auto at = std::find(arguments.begin(), arguments.end(), "--test");
  arguments.erase(at, at + 2);
  const ProgramRun fit = run(arguments);
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_FALSE(result().contains("test"));
  EXPECT_THAT(fit.out, Not(HasSubstr("\n  test ")));
}

TEST_F(Program, SeveralRangesAreRecordsOfTheirOwn) {
  const ProgramRun fit = run({"fit",           "data.csv",      "--input", "1",          "--output", "2",
                              "--sample-time", "1e-3",          "--train", "0:2000",     "--train",  "2000:4000",
                              "--test",        "4000:5000",     "--test",  "5000:6000",  "--warmup", "100",
                              "--model",       kSyntheticChain, "--json",  "result.json"});
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_EQ(result()["train"]["samples"], 3800);
  EXPECT_EQ(result()["train"]["ranges"], json::array({"0:2000", "2000:4000"}));
  EXPECT_EQ(result()["test"]["samples"], 1800);
  EXPECT_GT(result()["test"]["fit_percent"].get<double>(), 98.5);
  EXPECT_EQ(result()["warnings"], json::array());
}

TEST_F(Program, OverlapOfTrainingAndTestIsSaid) {
  const ProgramRun fit = run({"fit", "data.csv", "--input", "u", "--output", "y", "--rate", "1000", "--test",
                              "4000:", "--warmup", "100", "--model", kSyntheticChain, "--json", "result.json"});
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.out, HasSubstr("overlap"));
  EXPECT_THAT(result()["warnings"].dump(), HasSubstr("overlap"));
}

TEST_F(Program, FitGoesOnFromASavedModel) {
  ASSERT_EQ(run(fit_arguments()).code, 0);
  const double before = result()["train"]["rmse"];
  const ProgramRun again = run({"fit", "data.csv", "--input", "u", "--output", "y", "--rate", "1000", "--train",
                                "0:4000", "--warmup", "100", "--init", "model.json", "--json", "again.json"});
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_NEAR(result("again.json")["train"]["rmse"].get<double>(), before, 1e-6 * before);
  EXPECT_EQ(result("again.json")["candidates"].size(), 1u);
  EXPECT_EQ(result("again.json")["model"], result()["model"]);
}

TEST_F(Program, NoInitialiserStartsAtTheBlocksOwnParameters) {
  const ProgramRun fit = run({"fit", "data.csv", "--input", "u", "--output", "y", "--rate", "1000", "--model",
                              "f=polynomial(degree=3)", "--init", "none", "--json", "result.json"});
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_EQ(result()["candidates"].size(), 1u);
  EXPECT_EQ(result()["init"], "none");
  EXPECT_EQ(result()["parameters"], 4);
}

TEST_F(Program, EstimatedInitialStateIsSaidAndHelps) {
  // Without a warm-up the start in mid-record costs a model at rest more than one whose state is estimated.
  const Arguments common = {"fit",  "data.csv", "--input",   "u",      "--output",  "y",       "--rate",
                            "1000", "--train",  "1000:3000", "--test", "3000:3200", "--model", kSyntheticChain};
  Arguments rest = common;
  rest.insert(rest.end(), {"--json", "rest.json"});
  Arguments estimated = common;
  estimated.insert(estimated.end(), {"--initial-state", "estimated", "--json", "estimated.json", "-o", "model.json"});
  ASSERT_EQ(run(rest).code, 0);
  const ProgramRun fit = run(estimated);
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.out, HasSubstr("initial state of each test record was estimated"));
  EXPECT_LT(result("estimated.json")["test"]["rmse"].get<double>(),
            0.7 * result("rest.json")["test"]["rmse"].get<double>());

  // The saved state belongs to the beginning of the training record.
  const ProgramRun simulation = run({"simulate", "model.json", "data.csv", "--input", "u", "--output", "y", "--range",
                                     "1000:3000", "--initial-state", "model", "--json", "simulation.json"});
  ASSERT_EQ(simulation.code, 0) << simulation.err;
  EXPECT_EQ(result("simulation.json")["metrics"]["rmse"], result("estimated.json")["train"]["rmse"]);
}

TEST_F(Program, FrozenParametersKeepTheirValues) {
  ASSERT_EQ(run(fit_arguments()).code, 0);
  json model = json_file(folder_ / "model.json");
  double frozen = 0.0;
  for (json& entry : model["parameters"]) {
    if (entry["name"] != "G2.a1") continue;
    entry["value"] = entry["value"].get<double>() * 1.001;
    frozen = entry["value"];
  }
  blockid::write_file_atomically(folder_ / "moved.json", model.dump());
  const ProgramRun fit =
      run({"fit", "data.csv", "--input", "u", "--output", "y", "--rate", "1000", "--warmup", "100", "--init",
           "moved.json", "--freeze", "G2.a1,G2.a2", "--freeze", "G2.a3", "--json", "result.json"});
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_EQ(result()["parameters"], 15);
  for (const json& entry : result()["parameter_table"]) {
    if (entry["name"] != "G2.a1") continue;
    EXPECT_EQ(entry["value"].get<double>(), frozen);
    EXPECT_TRUE(entry["held"]);
  }
}

TEST_F(Program, OrdersAutoChoosesTheFiltersAndKeepsTheStaticBlock) {
  const std::string family = "G1=rational(nb=1,na=1) | f=polynomial(degree=5) | G2=rational(nb=1,na=1)";
  Arguments arguments = fit_arguments({"--orders", "auto"});
  std::replace(arguments.begin(), arguments.end(), std::string(kSyntheticChain), family);
  const ProgramRun fit = run(arguments);
  ASSERT_EQ(fit.code, 0) << fit.err;
  const json r = result();
  EXPECT_THAT(r["model"].get<std::string>(), HasSubstr("f=polynomial(degree=5"));
  EXPECT_EQ(r["init"], "structures by validation");
  ASSERT_GE(r["structures"].size(), 3u);
  // The system has filters of degree 3: one of degree 1 each is not enough, and with enough of them only the noise is
  // left.
  EXPECT_GT(r["structures"][0]["validation_rmse"].get<double>(), 1.5 * noise_);
  EXPECT_LT(r["test"]["rmse"].get<double>(), 1.1 * noise_);
}

TEST_F(Program, OrdersAutoRefusesWhatItWouldReplace) {
  EXPECT_THAT(run(fit_arguments({"--orders", "auto", "--freeze", "G2.b0"})).err,
              HasSubstr("--freeze: --orders auto chooses the chain itself"));
  Arguments whole = fit_arguments({"--orders", "auto"});
  std::replace(whole.begin(), whole.end(), std::string(kSyntheticChain), std::string("wh"));
  EXPECT_THAT(run(whole).err, HasSubstr("--model wh chooses the orders anyway"));
  Arguments nothing = fit_arguments({"--orders", "auto"});
  std::replace(nothing.begin(), nothing.end(), std::string(kSyntheticChain), std::string("f=polynomial(degree=3)"));
  const ProgramRun fit = run(nothing);
  EXPECT_NE(fit.code, 0);
  EXPECT_THAT(fit.err, HasSubstr("rational"));
}

TEST_F(Program, RobustDeviationsAgreeWithThePlainOnesWhenResidualsAreWhite) {
  ASSERT_EQ(run(fit_arguments()).code, 0);
  const json plain = result();
  const ProgramRun fit = run(fit_arguments({"--robust-covariance"}));
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.out, HasSubstr("standard deviation (robust)"));
  const json robust = result();
  EXPECT_EQ(plain["covariance"]["kind"], "white");
  EXPECT_EQ(robust["covariance"]["kind"], "robust");
  ASSERT_EQ(plain["parameter_table"].size(), robust["parameter_table"].size());
  // 200 batches: a deviation is itself known to 1 / sqrt(2 * 200) = 5 %; four of these.
  constexpr double kTolerance = 0.2;
  int free = 0;
  int different = 0;
  for (std::size_t k = 0; k < plain["parameter_table"].size(); ++k) {
    const json& before = plain["parameter_table"][k]["standard_deviation"];
    const json& after = robust["parameter_table"][k]["standard_deviation"];
    ASSERT_EQ(before.is_number(), after.is_number()) << k;
    if (!before.is_number() || before.get<double>() == 0.0) continue;
    ++free;
    different += before.get<double>() != after.get<double>();
    EXPECT_NEAR(after.get<double>() / before.get<double>(), 1.0, kTolerance) << plain["parameter_table"][k];
  }
  EXPECT_EQ(free, 18);
  EXPECT_EQ(different, free);
}

TEST_F(Program, FractionalExponentsAreInTheResultAndTheReport) {
  const ProgramRun fit = run(fit_arguments({"--init", "classify", "--report", "report.html"}));
  ASSERT_EQ(fit.code, 0) << fit.err;
  const json r = result();
  std::size_t with_shares = 0;
  for (const json& candidate : r["candidates"]) {
    if (!candidate.contains("root_shares")) continue;
    ++with_shares;
    std::size_t poles = 0;
    for (const json& share : candidate["root_shares"]) {
      poles += share["kind"] == "pole" ? (share["imaginary"].get<double>() != 0.0 ? 2 : 1) : 0;
      EXPECT_TRUE(share["exponent"].is_number()) << share;
    }
    EXPECT_EQ(poles, 6u);  // two filters of degree 3
  }
  EXPECT_GT(with_shares, 0u);
  if (fit.err.find("gnuplot is not installed") != std::string::npos) GTEST_SKIP() << "gnuplot is not here";
  EXPECT_THAT(blockid::read_file(folder_ / "report.html"), HasSubstr("id=\"root-shares\""));
}

TEST_F(Program, MissingOutputsAreAllowedOnRequest) {
  blockid::Table table = blockid::read_csv(folder_ / "data.csv");
  std::string text = "u,y\n";
  for (Eigen::Index t = 0; t < 2000; ++t) {
    text += std::to_string(table.values(t, 0)) + "," + (t % 50 == 7 ? "" : std::to_string(table.values(t, 1))) + "\n";
  }
  blockid::write_file_atomically(folder_ / "gaps.csv", text);
  Arguments arguments = {"fit",      "gaps.csv",    "--input",  "u",          "--output", "y",
                         "--rate",   "1000",        "--warmup", "100",        "--model",  kSyntheticChain,
                         "--report", "report.html", "--json",   "result.json"};
  const ProgramRun refused = run(arguments);
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.err, HasSubstr("gaps.csv:9"));
  arguments.emplace_back("--allow-missing");
  const ProgramRun fit = run(arguments);
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_EQ(result()["train"]["samples"], 1900 - 38);
  EXPECT_GT(result()["train"]["fit_percent"].get<double>(), 98.5);
}

TEST_F(Program, QuietSaysNothing) {
  const ProgramRun fit = run(fit_arguments({"--quiet"}));
  EXPECT_EQ(fit.code, 0);
  EXPECT_EQ(fit.out, "");
  EXPECT_EQ(fit.err, "");
  EXPECT_EQ(result()["status"], "converged");
  const ProgramRun bla =
      run({"bla", "data.csv", "--input", "u", "--output", "y", "--rate", "1000", "--max-order", "2", "--quiet"});
  EXPECT_EQ(bla.code, 0);
  EXPECT_EQ(bla.out + bla.err, "");
}

TEST_F(Program, ProgressGoesToStderrWithoutControlCharacters) {
  const ProgramRun fit = run(fit_arguments());
  EXPECT_THAT(fit.err, HasSubstr(" s  "));
  EXPECT_THAT(fit.err, HasSubstr("RMSE"));
  EXPECT_EQ(fit.err.find('\r'), std::string::npos);
  EXPECT_EQ(fit.err.find('\x1b'), std::string::npos);
}

TEST_F(Program, ReportHoldsEveryPicture) {
  if (run({"demo", "--help"}).code != 0) FAIL();
  const ProgramRun fit = run(fit_arguments({"--report", "report.html", "--output-unit", "V"}));
  ASSERT_EQ(fit.code, 0) << fit.err;
  const std::string page = blockid::read_file(folder_ / "report.html");
  if (fit.err.find("gnuplot is not installed") != std::string::npos) GTEST_SKIP() << "gnuplot is not here";
  for (const char* id :
       {"measured-zoom", "measured-whole", "bode-G1", "pole-zero-G1", "bode-G2", "pole-zero-G2", "static-f",
        "residual-cross-correlation", "residual-nonlinear", "residual-autocorrelation", "error-spectrum"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\">"));
  }
  EXPECT_EQ(occurrences(page, "<svg"), 11);
  EXPECT_EQ(occurrences(page, "</svg>"), 11);
  EXPECT_EQ(occurrences(page, "<figure "), 11);
  for (const char* title : {"Bode picture of G1", "Poles and zeros of G2", "Static block f over the histogram",
                            "Cross-correlation of input and residual", "Spectrum of the error"}) {
    EXPECT_THAT(page, HasSubstr(title));
  }
  EXPECT_THAT(page, HasSubstr("RMSE [V]"));
  EXPECT_THAT(page, HasSubstr("G1.a3"));
  EXPECT_THAT(page, HasSubstr("release "));
  EXPECT_EQ(page.find("http"), std::string::npos) << "no address of anything outside the file";
  EXPECT_EQ(page.find("src="), std::string::npos);
  EXPECT_EQ(page.find("@import"), std::string::npos);
  EXPECT_LT(page.size(), 2'000'000u);
  // No id twice: each picture's begin with its name.
  std::set<std::string> ids;
  for (std::size_t at = page.find(" id="); at != std::string::npos; at = page.find(" id=", at + 1)) {
    const std::string id = page.substr(at + 5, page.find(page[at + 4], at + 5) - at - 5);
    EXPECT_TRUE(ids.insert(id).second) << id;
  }
}

TEST_F(Program, WithoutGnuplotTheReportSaysSo) {
  const ProgramRun fit = run(fit_arguments({"--report", "report.html"}), {"PATH=/nonexistent"});
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.err, HasSubstr("gnuplot is not installed"));
  const std::string page = blockid::read_file(folder_ / "report.html");
  EXPECT_EQ(occurrences(page, "<svg"), 0);
  EXPECT_THAT(page, HasSubstr("gnuplot is not installed"));
  EXPECT_THAT(page, HasSubstr("99."));
}

TEST_F(Program, AGnuplotThatFailsCostsAPictureOnly) {
  std::filesystem::create_directory(folder_ / "bin");
  blockid::write_file_atomically(folder_ / "bin/gnuplot",
                                 "#!/bin/sh\ncase \"$*\" in *--version*) exit 0;; esac\necho 'out of ink'\nexit 3\n");
  std::filesystem::permissions(folder_ / "bin/gnuplot", std::filesystem::perms::owner_all);
  const ProgramRun fit = run(fit_arguments({"--report", "report.html"}), {"PATH=" + (folder_ / "bin").string()});
  ASSERT_EQ(fit.code, 0) << fit.err;
  EXPECT_THAT(fit.err, HasSubstr("exit code 3: out of ink"));
  EXPECT_THAT(blockid::read_file(folder_ / "report.html"), HasSubstr("out of ink"));
}

TEST_F(Program, BlaFindsALinearSystem) {
  // y_t = 0.5 u_{t-1} + 1.2 y_{t-1} - 0.45 y_{t-2} + 3: poles 0.6 +- 0.3i.
  const blockid::Table source = blockid::read_csv(folder_ / "data.csv");
  blockid::Table table = source;
  double y1 = 0.0;
  double y2 = 0.0;
  for (Eigen::Index t = 0; t < table.values.rows(); ++t) {
    const double y = (t > 0 ? 0.5 * source.values(t - 1, 0) : 0.0) + 1.2 * y1 - 0.45 * y2;
    table.values(t, 1) = y + 3.0 + 0.01 * source.values((t * 7 + 13) % table.values.rows(), 1);
    y2 = y1;
    y1 = y;
  }
  blockid::write_csv(folder_ / "linear.csv", table);
  const ProgramRun bla =
      run({"bla",    "linear.csv", "--input",  "u",  "--output", "y",   "--rate", "1000",     "--train",  "0:4000",
           "--test", "4000:",      "--warmup", "50", "--orders", "1,2", "--json", "bla.json", "--report", "bla.html"});
  ASSERT_EQ(bla.code, 0) << bla.err;
  const json r = result("bla.json");
  ASSERT_EQ(r["poles"].size(), 2u);
  EXPECT_NEAR(r["poles"][0]["real"].get<double>(), 0.6, 1e-3);
  EXPECT_NEAR(std::abs(r["poles"][0]["imaginary"].get<double>()), 0.3, 1e-3);
  EXPECT_NEAR(r["poles"][0]["modulus"].get<double>(), std::hypot(0.6, 0.3), 1e-3);
  EXPECT_NEAR(r["dc_gain"].get<double>(), 2.0, 2e-3);
  EXPECT_NEAR(r["output_mean"].get<double>(), 3.0, 0.2);
  EXPECT_GT(r["test"]["fit_percent"].get<double>(), 99.0);
  EXPECT_EQ(r["order_table"].size(), 0u);
  EXPECT_EQ(r["choice"], "as given");
  const std::string page = blockid::read_file(folder_ / "bla.html");
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_THAT(page, HasSubstr("<figure id=\"bode-G\">"));
}

TEST_F(Program, BlaChoosesFromTheOrderTable) {
  const Arguments common = {"bla",      "data.csv", "--input",     "u", "--output",    "y", "--rate", "1000",
                            "--warmup", "50",       "--max-order", "3", "--max-delay", "1", "--json", "bla.json"};
  const ProgramRun bic = run(common);
  ASSERT_EQ(bic.code, 0) << bic.err;
  json r = result("bla.json");
  ASSERT_EQ(r["order_table"].size(), 6u);
  EXPECT_EQ(r["choice"], "smallest BIC");
  EXPECT_TRUE(r["order_table"][0]["validation_rmse"].is_null());
  double smallest = r["order_table"][0]["bic"];
  for (const json& entry : r["order_table"]) smallest = std::min(smallest, entry["bic"].get<double>());
  for (const json& entry : r["order_table"]) {
    const bool chosen = entry["nb"] == r["orders"]["nb"] && entry["nk"] == r["orders"]["nk"];
    EXPECT_EQ(entry["bic"].get<double>() == smallest, chosen);
  }
  Arguments validated = common;
  validated.insert(validated.end(), {"--train", "0:4000", "--test", "4000:"});
  const ProgramRun test = run(validated);
  ASSERT_EQ(test.code, 0) << test.err;
  r = result("bla.json");
  EXPECT_EQ(r["choice"], "smallest test RMSE");
  EXPECT_TRUE(r["order_table"][0]["validation_rmse"].is_number());
  EXPECT_THAT(test.out, HasSubstr("chosen"));
}

/// Realisations of 3 periods of 200 samples of a random-phase multisine, one after another; y by `system` from v, the
/// input behind v_t = u_t + 0.5 v_{t-1}, and noise. The first period is transient.
template <class System>
void write_realisations(const std::filesystem::path& file, int realisations, double noise, const System& system) {
  constexpr int kPeriod = 200;
  constexpr int kLines = 60;
  blockid::testing::Noise numbers(5);
  std::string text = "u,y\n";
  for (int m = 0; m < realisations; ++m) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(kPeriod);
    for (int k = 1; k <= kLines; ++k) {
      const double phase = 2.0 * std::numbers::pi * numbers.uniform();
      for (int t = 0; t < kPeriod; ++t) u[t] += 0.2 * std::cos(2.0 * std::numbers::pi * k * t / kPeriod + phase);
    }
    double v = 0.0;
    for (int t = 0; t < 3 * kPeriod; ++t) {
      v = u[t % kPeriod] + 0.5 * v;
      text += std::to_string(u[t % kPeriod]) + "," + std::to_string(system(v) + noise * numbers.normal()) + "\n";
    }
  }
  blockid::write_file_atomically(file, text);
}

Arguments periodic_bla_arguments(const std::string& file) {
  Arguments arguments = {"bla",
                         file,
                         "--input",
                         "u",
                         "--output",
                         "y",
                         "--rate",
                         "1000",
                         "--orders",
                         "0,1",
                         "--period",
                         "200",
                         "--transient-periods",
                         "1",
                         "--json",
                         "bla.json",
                         "--warmup",
                         "20"};
  for (int m = 0; m < 5; ++m) {
    arguments.insert(arguments.end(), {"--train", std::to_string(600 * m) + ":" + std::to_string(600 * (m + 1))});
  }
  return arguments;
}

TEST_F(Program, BlaTellsNoiseFromDistortion) {
  write_realisations(folder_ / "cubic.csv", 5, 0.05, [](double v) { return v + 0.05 * v * v * v; });
  Arguments arguments = periodic_bla_arguments("cubic.csv");
  arguments.insert(arguments.end(), {"--report", "bla.html"});
  const ProgramRun cubic = run(arguments);
  ASSERT_EQ(cubic.code, 0) << cubic.err;
  EXPECT_THAT(cubic.out, HasSubstr("robust method, 5 realisations of 2 periods, 60 lines"));
  EXPECT_THAT(cubic.out, HasSubstr("Nonlinear distortion is "));
  const json r = result("bla.json")["frequency_response"];
  EXPECT_EQ(r["noise_degrees_of_freedom"], 5);
  EXPECT_EQ(r["total_degrees_of_freedom"], 4);
  ASSERT_EQ(r["frequency_hz"].size(), 60u);
  EXPECT_NEAR(r["frequency_hz"][1].get<double>(), 10.0, 1e-9);
  EXPECT_EQ(r["distortion_variance"].size(), 60u);
  EXPECT_GT(r["distortion"]["distortion_db"].get<double>(), r["distortion"]["noise_db"].get<double>());
  // White noise in 60 of the 100 lines; 300 degrees of freedom, so that 0.3 is five deviations.
  EXPECT_NEAR(r["distortion"]["noise_power"].get<double>(), 0.6 * 0.0025, 0.3 * 0.6 * 0.0025);
  EXPECT_FALSE(r["vanishing"]["vanishes"]);
  const std::string page = blockid::read_file(folder_ / "bla.html");
  EXPECT_THAT(page, HasSubstr("<figure id=\"bla-lines\">"));
  EXPECT_THAT(page, HasSubstr("Nonlinear distortion is "));

  write_realisations(folder_ / "linear.csv", 5, 0.05, [](double v) { return v; });
  const ProgramRun linear = run(periodic_bla_arguments("linear.csv"));
  ASSERT_EQ(linear.code, 0) << linear.err;
  EXPECT_THAT(linear.out, HasSubstr("No nonlinear distortion above the noise"));
  EXPECT_EQ(result("bla.json")["frequency_response"]["distortion"]["kind"], "none");
}

TEST_F(Program, BlaSaysWhenItVanishes) {
  write_realisations(folder_ / "even.csv", 5, 0.05, [](double v) { return v * v; });
  const ProgramRun even = run(periodic_bla_arguments("even.csv"));
  ASSERT_EQ(even.code, 0) << even.err;
  EXPECT_THAT(even.out, HasSubstr("The linear approximation vanishes"));
  EXPECT_TRUE(result("bla.json")["frequency_response"]["vanishing"]["vanishes"]);
}

TEST_F(Program, BlaOfAnyInputHasNoiseAndDistortionTogether) {
  const ProgramRun bla = run(
      {"bla", "data.csv", "--input", "u", "--output", "y", "--rate", "1000", "--max-order", "3", "--json", "bla.json"});
  ASSERT_EQ(bla.code, 0) << bla.err;
  EXPECT_THAT(bla.out, HasSubstr("local polynomial method"));
  EXPECT_THAT(bla.out, HasSubstr("Noise and nonlinear distortion together"));
  EXPECT_THAT(bla.out, HasSubstr("best AIC"));
  EXPECT_THAT(bla.out, HasSubstr("best BIC"));
  EXPECT_EQ(bla.out.find("best test"), std::string::npos);
  const json r = result("bla.json");
  EXPECT_EQ(r["frequency_response"]["distortion"]["kind"], "unknown");
  EXPECT_EQ(r["best_orders"]["bic"], r["orders"]);
  const ProgramRun wrong =
      run({"bla", "data.csv", "--input", "u", "--output", "y", "--rate", "1000", "--transient-periods", "1"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_THAT(wrong.err, HasSubstr("--period"));
}

TEST_F(Program, InfoOfDataAndModel) {
  const ProgramRun data = run({"info", "data.csv", "--json", "info.json"});
  ASSERT_EQ(data.code, 0) << data.err;
  EXPECT_THAT(data.out, HasSubstr("2 columns"));
  const json columns = result("info.json")["columns"];
  ASSERT_EQ(columns.size(), 2u);
  EXPECT_EQ(columns[0]["name"], "u");
  EXPECT_EQ(columns[0]["rows"], kSamples);
  EXPECT_NEAR(columns[0]["std"].get<double>(), 1.0, 0.05);
  EXPECT_EQ(columns[0]["non_finite"], 0);

  ASSERT_EQ(run(fit_arguments()).code, 0);
  const ProgramRun model = run({"info", "model.json", "--json", "info.json"});
  ASSERT_EQ(model.code, 0) << model.err;
  EXPECT_THAT(model.out, HasSubstr("DC gain"));
  EXPECT_THAT(model.out, HasSubstr("natural frequency Hz"));
  const json filters = result("info.json")["filters"];
  ASSERT_EQ(filters.size(), 2u);
  EXPECT_EQ(filters[0]["block"], "G1");
  ASSERT_EQ(filters[1]["poles"].size(), 3u);
  for (const json& pole : filters[1]["poles"]) {
    const std::complex<double> z(pole["real"], pole["imaginary"]);
    EXPECT_NEAR(pole["modulus"].get<double>(), std::abs(z), 1e-12);
    EXPECT_NEAR(pole["natural_frequency_hz"].get<double>(), std::abs(std::log(z)) / (2.0 * std::numbers::pi * 1e-3),
                1e-9);
  }
}

TEST_F(Program, DemoWritesItsResults) {
  const ProgramRun demo = run({"demo", "--output-dir", "results/demo"});
  ASSERT_EQ(demo.code, 0) << demo.err;
  EXPECT_THAT(demo.out, HasSubstr("truth"));
  EXPECT_THAT(demo.out, HasSubstr("noise in the data"));
  const json r = result("results/demo/result.json");
  EXPECT_NEAR(r["test"]["rmse"].get<double>() / r["true_noise_standard_deviation"].get<double>(), 1.0, 0.03);
  double chi2 = 0.0;
  int count = 0;
  for (const json& entry : r["parameter_table"]) {
    if (entry["held"]) {
      EXPECT_NEAR(entry["value"].get<double>(), entry["truth"].get<double>(), 1e-9);
      continue;
    }
    const double error = entry["value"].get<double>() - entry["truth"].get<double>();
    chi2 += std::pow(error / entry["standard_deviation"].get<double>(), 2);
    ++count;
  }
  EXPECT_EQ(count, 18);
  EXPECT_LT(chi2 / count, 3.0) << "errors beyond what the standard deviations promise";
  EXPECT_TRUE(std::filesystem::exists(folder_ / "results/demo/model.json"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "results/demo/report.html"));
}

TEST_F(Program, HelpNamesUnitsDefaultsAndExitCodes) {
  for (const char* command : {"fit", "simulate", "bla", "ct", "info", "demo"}) {
    const ProgramRun help = run({command, "--help"});
    EXPECT_EQ(help.code, 0);
    EXPECT_THAT(help.out, HasSubstr("Exit codes"));
  }
  const ProgramRun help = run({"fit", "--help"});
  EXPECT_THAT(help.out, HasSubstr("sampling frequency in Hz"));
  EXPECT_THAT(help.out, HasSubstr("sample time in seconds"));
  EXPECT_THAT(help.out, HasSubstr("(default: fractional)"));
  const ProgramRun version = run({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_THAT(version.out, HasSubstr("blockid "));
}

}  // namespace
