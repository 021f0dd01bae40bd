// Discrete-time linear models with a model of the noise.
#include "cli/program.hpp"
#include "estimators/polynomial_systems.hpp"
#include "support/temp_dir.hpp"

#include <blockid/data/atomic_file.hpp>
#include <blockid/data/csv.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace blockid {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::json_file;
using ::testing::Not;
using testing::ProgramRun;
using testing::run_program;
using testing::TempDir;

class LinearCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    PolynomialModel model = testing::box_jenkins_system();
    model.u_mean = 2.0;
    model.y_mean = -1.0;
    write("bj.csv", testing::simulated(model, 3000, 1, 200).record);
  }

  void write(const std::string& name, const Record& record) const {
    Table table;
    table.has_header = true;
    table.names = {"u", "y"};
    table.values.resize(record.u.size(), 2);
    table.values << record.u, record.y;
    write_file_atomically(folder_ / name, to_csv(table));
  }

  ProgramRun linear(const std::vector<std::string>& more, const std::string& file = "bj.csv") const {
    std::vector<std::string> arguments = {"linear", file, "--input", "u", "--output", "y", "--sample-time", "0.1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments, folder_.path());
  }

  TempDir folder_;
};

TEST_F(LinearCommand, IdentifiesBoxJenkins) {
  const ProgramRun run = linear({"--structure", "bj", "--orders", "nb=3,nf=2,nc=1,nd=2,nk=1", "--train", "0:2000",
                                 "--test", "2000:3000", "--ahead", "3", "--json", "linear.json", "-o", "path.json"});
  ASSERT_EQ(run.code, 0) << run.err;
  const json result = json_file(folder_ / "linear.json");
  EXPECT_EQ(result["structure"], "bj");
  EXPECT_EQ(result["status"], "converged");
  EXPECT_EQ(result["orders"]["nd"], 2);
  EXPECT_EQ(result["samples"], 2000);
  EXPECT_EQ(result["unknowns"], 9 + 6);
  EXPECT_TRUE(result["stable"] && result["stationary_noise"] && result["stable_predictor"]);
  const PolynomialModel truth = testing::box_jenkins_system();
  ASSERT_EQ(result["coefficients"].size(), 9U);
  for (Index k = 0; k < 9; ++k) {
    const json& one = result["coefficients"][static_cast<std::size_t>(k)];
    // Outside 4.5 deviations lies 7e-6 of a normal distribution.
    EXPECT_NEAR(one["value"].get<double>(), truth.theta[k], 4.5 * one["standard_deviation"].get<double>())
        << one["name"];
  }
  EXPECT_EQ(result["polynomials"]["b"][0], 0.0);
  EXPECT_EQ(result["polynomials"]["f"].size(), 3U);
  // The input mean scatters by 1 / sqrt(2000).
  EXPECT_NEAR(result["input_mean"].get<double>(), 2.0, 4.5 / std::sqrt(2000.0));
  ASSERT_EQ(result["scores"].size(), 3U);
  EXPECT_EQ(result["scores"][1]["prediction"], "3 steps ahead");
  // The error one step ahead is e, deviation 0.5; 1000 samples tell it to 2 %.
  EXPECT_NEAR(result["scores"][0]["test"]["rmse"].get<double>(), 0.5, 0.05);
  EXPECT_GT(result["scores"][1]["test"]["rmse"], result["scores"][0]["test"]["rmse"]);
  EXPECT_GT(result["scores"][2]["test"]["rmse"], result["scores"][1]["test"]["rmse"]);
  EXPECT_GE(result["candidates"].size(), 2U);
  EXPECT_THAT(run.out, HasSubstr("test, simulation"));
  EXPECT_THAT(run.out, HasSubstr("Steiglitz-McBride"));

  const ProgramRun simulated = run_program({"simulate", "path.json", "bj.csv", "--input", "u", "--output", "y",
                                            "--warmup", "100", "--json", "simulated.json"},
                                           folder_.path());
  ASSERT_EQ(simulated.code, 0) << simulated.err;
  const double rmse = json_file(folder_ / "simulated.json")["metrics"]["rmse"].get<double>();
  // From rest or from the estimated past makes no difference after 100 samples; other records, 3 % each.
  EXPECT_NEAR(rmse / result["scores"][2]["train"]["rmse"].get<double>(), 1.0, 0.15);
}

TEST_F(LinearCommand, TheReportShowsResponsesAndResidualTests) {
  const ProgramRun run = linear({"--structure", "bj", "--orders", "nb=3,nf=2,nc=1,nd=2,nk=1", "--train", "0:2000",
                                 "--test", "2000:3000", "--report", "l.html", "--json", "l.json"});
  ASSERT_EQ(run.code, 0) << run.err;
  const std::string page = read_file(folder_ / "l.html");
  for (const char* id : {"measured-zoom", "measured-whole", "bode-G", "bode-H", "pole-zero-G",
                         "residual-cross-correlation", "residual-autocorrelation"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\"")) << id;
  }
  const json tests = json_file(folder_ / "l.json")["residual_tests"];
  EXPECT_TRUE(tests["passed"].get<bool>()) << tests["verdict"];
  EXPECT_EQ(tests["set"], "test");
}

TEST_F(LinearCommand, ResidualTestsTellOfANoiseModelThatIsTooSmall) {
  // The path is there, the noise is taken for white: coloured errors, in which nothing of the input is left.
  ASSERT_EQ(linear({"--structure", "oe", "--orders", "nb=3,nf=2,nk=1", "--json", "l.json"}).code, 0);
  const json tests = json_file(folder_ / "l.json")["residual_tests"];
  for (const json& test : tests["tests"]) {
    if (test["test"] != "whiteness" && test["test"] != "input") continue;
    EXPECT_EQ(test["passed"].get<bool>(), test["test"] == "input") << test["test"];
  }
  // One pole too few.
  ASSERT_EQ(linear({"--structure", "bj", "--orders", "nb=0,nf=1,nc=1,nd=2,nk=1", "--json", "l.json"}).code, 0);
  EXPECT_FALSE(json_file(folder_ / "l.json")["residual_tests"]["passed"].get<bool>());
}

TEST_F(LinearCommand, EveryStructureHasItsOrders) {
  const std::vector<std::vector<std::string>> calls = {
      {"arx", "na=4,nb=4,nk=1"}, {"armax", "na=2,nb=2,nc=2,nk=1"}, {"oe", "nb=3,nf=2,nk=1"}};
  for (const std::vector<std::string>& call : calls) {
    const ProgramRun run =
        linear({"--structure", call[0], "--orders", call[1], "--initial-state", "zero", "--json", "l.json"});
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(json_file(folder_ / "l.json")["structure"], call[0]);
    EXPECT_THAT(run.out, HasSubstr(call[0] + " n"));
  }
}

TEST_F(LinearCommand, MissingOutputsAreLeftOut) {
  Record record = testing::simulated(testing::arx_system(), 600, 2).record;
  record.y[100] = std::nan("");
  write("gap.csv", record);
  const std::vector<std::string> arx = {"--structure", "arx", "--orders", "na=2,nb=1,nk=1", "--json", "l.json"};
  EXPECT_EQ(linear(arx, "gap.csv").code, 1);
  std::vector<std::string> allowed = arx;
  allowed.emplace_back("--allow-missing");
  const ProgramRun run = linear(allowed, "gap.csv");
  ASSERT_EQ(run.code, 0) << run.err;
  // Sample 100 and the two that take it.
  EXPECT_EQ(json_file(folder_ / "l.json")["samples"], 597);
  EXPECT_EQ(json_file(folder_ / "l.json")["scores"][0]["train"]["samples"], 597);
  const ProgramRun refused =
      linear({"--structure", "armax", "--orders", "na=2,nb=1,nc=1,nk=1", "--allow-missing"}, "gap.csv");
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.err, HasSubstr("sample 100 is missing"));
}

TEST_F(LinearCommand, WarnsOfWhatIsNotDetermined) {
  const ProgramRun run = linear({"--structure", "arx", "--orders", "na=2,nb=3,nk=1", "--json", "l.json"}, [this] {
    Record record = testing::simulated(testing::arx_system(), 400, 3).record;
    // A sine excites two directions; the past inputs alone are four.
    for (Index t = 0; t < 400; ++t) record.u[t] = std::sin(0.3 * static_cast<double>(t));
    record.y = simulate(testing::arx_system(), record.u);
    write("sine.csv", record);
    return std::string("sine.csv");
  }());
  EXPECT_THAT(run.err, HasSubstr("the data do not determine"));
}

/// (1 - 1.05 q^-1) (1 - 0.7 q^-1) y = (0.5 q^-1 + 0.3 q^-2) u + e in the loop u = r - 0.3 y, from rest.
Record unstable_in_closed_loop(Index samples) {
  testing::Noise numbers(5);
  const Eigen::VectorXd reference = numbers.white(samples);
  const Eigen::VectorXd e = numbers.white(samples, 0.1);
  Record record;
  record.u = reference;
  record.y = e;
  const auto past = [](const Eigen::VectorXd& x, Index t) { return t < 0 ? 0.0 : x[t]; };
  for (Index t = 0; t < samples; ++t) {
    record.y[t] += 1.75 * past(record.y, t - 1) - 0.735 * past(record.y, t - 2) + 0.5 * past(record.u, t - 1) +
                   0.3 * past(record.u, t - 2);
    record.u[t] -= 0.3 * record.y[t];
  }
  return record;
}

TEST_F(LinearCommand, LeastSquaresFindAnUnstableSystemInItsClosedLoop) {
  write("loop.csv", unstable_in_closed_loop(2000));
  const std::vector<double> truth = {-1.75, 0.735, 0.5, 0.3};
  for (const std::vector<std::string>& call :
       {std::vector<std::string>{"arx", "na=2,nb=1,nk=1"}, {"armax", "na=2,nb=1,nc=1,nk=1"}}) {
    const ProgramRun run = linear({"--structure", call[0], "--orders", call[1], "--json", "l.json"}, "loop.csv");
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr("not stable"));
    EXPECT_THAT(run.err, HasSubstr("its simulation diverges"));
    EXPECT_THAT(run.err, Not(HasSubstr("seems to be unstable")));
    const json result = json_file(folder_ / "l.json");
    EXPECT_FALSE(result["stable"].get<bool>());
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const json& one = result["coefficients"][k];
      // Outside 4.5 deviations lies 7e-6 of a normal distribution.
      EXPECT_NEAR(one["value"].get<double>(), truth[k], 4.5 * one["standard_deviation"].get<double>()) << one["name"];
    }
    // e has a deviation of 0.1, which 2000 samples tell to 1.6 %.
    EXPECT_NEAR(result["scores"][0]["train"]["rmse"].get<double>(), 0.1, 0.008);
  }
}

TEST_F(LinearCommand, SimulationsThatOverflowAreANumericalFailure) {
  // 1.05^20000 is 1e424.
  write("loop.csv", unstable_in_closed_loop(20000));
  const ProgramRun run = linear({"--structure", "arx", "--orders", "na=2,nb=1,nk=1", "--json", "l.json"}, "loop.csv");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("its simulation diverges"));
  const json result = json_file(folder_ / "l.json");
  EXPECT_NEAR(result["coefficients"][0]["value"].get<double>(), -1.75, 0.01);
  EXPECT_TRUE(result["scores"][1]["train"]["rmse"].is_null());
}

TEST_F(LinearCommand, OutputErrorOfAnUnstableSystemIsNotSilent) {
  write("loop.csv", unstable_in_closed_loop(2000));
  for (const std::vector<std::string>& call :
       {std::vector<std::string>{"oe", "nb=1,nf=2,nk=1"}, {"bj", "nb=1,nf=2,nc=1,nd=1,nk=1"}}) {
    const ProgramRun run = linear({"--structure", call[0], "--orders", call[1], "--json", "l.json"}, "loop.csv");
    EXPECT_THAT(run.err, HasSubstr("the system seems to be unstable"));
    EXPECT_THAT(run.err, HasSubstr("pole of modulus 1.0"));
    const json result = json_file(folder_ / "l.json");
    EXPECT_THAT(result["warnings"].dump(), HasSubstr("seems to be unstable"));
    EXPECT_FALSE(result["residual_tests"]["passed"].get<bool>());
  }
  // A stable system is none.
  const ProgramRun stable = linear({"--structure", "bj", "--orders", "nb=3,nf=2,nc=1,nd=2,nk=1"});
  EXPECT_THAT(stable.err, Not(HasSubstr("unstable")));
}

TEST_F(LinearCommand, CountsTheFrequenciesOfTheInput) {
  // Noise fills the numerical rank.
  Record record = testing::simulated(testing::output_error_system(), 1000, 4).record;
  for (Index t = 0; t < 1000; ++t) record.u[t] = std::sin(0.3 * static_cast<double>(t));
  record.y = simulate(testing::output_error_system(), record.u) + testing::Noise(5).white(1000, 0.5);
  write("sine.csv", record);
  const std::string lack = "the input excites 1 frequency: 2 equations for ";
  EXPECT_THAT(linear({"--structure", "oe", "--orders", "nb=1,nf=2,nk=2"}, "sine.csv").err, HasSubstr(lack + "4"));
  EXPECT_THAT(linear({"--structure", "arx", "--orders", "na=2,nb=2,nk=2"}, "sine.csv").err, HasSubstr(lack + "3"));
  EXPECT_THAT(linear({"--structure", "arx", "--orders", "na=2,nb=1,nk=2"}, "sine.csv").err, Not(HasSubstr("excites")));
  EXPECT_THAT(linear({"--structure", "bj", "--orders", "nb=3,nf=2,nc=1,nd=2,nk=1"}).err, Not(HasSubstr("excites")));
}

TEST_F(LinearCommand, RefusesBadOptions) {
  const auto refused = [&](const std::vector<std::string>& more, const std::string& words) {
    const ProgramRun run = linear(more);
    EXPECT_EQ(run.code, 1) << run.err;
    EXPECT_THAT(run.err, HasSubstr(words));
  };
  refused({"--structure", "oe", "--orders", "na=2"}, "--orders na=2: expected KEY=N with a key of oe: nb, nf, nk");
  refused({"--structure", "oe", "--orders", "2"}, "expected KEY=N");
  refused({"--structure", "oe", "--orders", "nf=2,nf=3"}, "nf is there twice");
  refused({"--structure", "oe", "--orders", "nf=-1"}, "a whole number from 0");
  refused({"--structure", "oe", "--orders", "nf=2x"}, "a whole number from 0");
  refused({"--structure", "magic", "--orders", "nf=2"}, "armax");
  refused({"--structure", "oe"}, "--orders");
  refused({"--orders", "nf=2"}, "--structure");
  refused({"--structure", "oe", "--orders", "nf=2", "--ahead", "1"}, "--ahead");
  refused({"--structure", "oe", "--orders", "nf=2", "--initial-state", "periodic"}, "--initial-state");
  refused({"--structure", "oe", "--orders", "nf=2", "--warmup", "3000"}, "warm-up");
}

}  // namespace
}  // namespace blockid
