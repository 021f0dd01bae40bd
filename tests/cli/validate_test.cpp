// Residual tests on the command line.
#include "cli/program.hpp"
#include "support/signals.hpp"
#include "support/temp_dir.hpp"

#include <blockid/data/atomic_file.hpp>
#include <blockid/data/csv.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::json_file;
using testing::ProgramRun;
using testing::run_program;
using testing::TempDir;

constexpr Index kSamples = 3000;

/// y_t = 1.2 y_{t-1} - 0.5 y_{t-2} + x_t + 0.4 x_{t-1} + noise, x = u + square u^2.
void write_record(const std::filesystem::path& path, const VectorXd& u, double square, double deviation) {
  testing::Noise noise(2);
  const VectorXd x = u.array() + square * u.array().square();
  Table table;
  table.has_header = true;
  table.names = {"u", "y"};
  table.values = Eigen::MatrixXd::Zero(u.size(), 2);
  table.values.col(0) = u;
  for (Index t = 0; t < u.size(); ++t) {
    table.values(t, 1) = x[t];
    if (t > 0) table.values(t, 1) += 1.2 * table.values(t - 1, 1) + 0.4 * x[t - 1];
    if (t > 1) table.values(t, 1) -= 0.5 * table.values(t - 2, 1);
  }
  table.values.col(1) += noise.white(u.size(), deviation);
  write_file_atomically(path, to_csv(table));
}

class ValidateCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    testing::Noise noise(1);
    const VectorXd u = noise.coloured(kSamples, 0.5, 1.0);
    write_record(folder_ / "linear.csv", u, 0.0, 0.3);
    write_record(folder_ / "square.csv", u, 0.1, 0.3);
    VectorXd periodic(kSamples);
    for (Index t = 0; t < kSamples; ++t) periodic[t] = u[t % 300];
    write_record(folder_ / "periodic.csv", periodic, 0.1, 0.3);
  }

  ProgramRun run(const std::vector<std::string>& arguments) const { return run_program(arguments, folder_.path()); }

  void fit(const std::string& file, const std::string& model = "G=rational(nb=1,na=2)") const {
    const ProgramRun result = run({"fit", file, "--input", "u", "--output", "y", "--rate", "1", "--train", "0:2000",
                                   "--model", model, "--init", "none", "--quiet", "-o", "model.json"});
    ASSERT_EQ(result.code, 0) << result.err;
  }

  ProgramRun validate(const std::string& file, const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {"validate", "model.json", file, "--input", "u", "--output", "y"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }

  TempDir folder_;
};

TEST_F(ValidateCommand, RightModelPassesOnItsDataAndOnOthers) {
  fit("linear.csv");
  const ProgramRun here = validate("linear.csv", {"--train", "0:2000", "--json", "v.json"});
  EXPECT_EQ(here.code, 0) << here.out << here.err;
  EXPECT_THAT(here.out, AllOf(HasSubstr("all tests of the model passed"), HasSubstr("cubed output")));
  const json training = json_file(folder_ / "v.json");
  EXPECT_EQ(training["set"], "training");
  EXPECT_TRUE(training["passed"].get<bool>());
  EXPECT_EQ(training["tests"].size(), 8U);
  EXPECT_LT(training["distance_from_minimum"].get<double>(), 0.01);
  EXPECT_EQ(training["tests"][2]["lags"].size(), 26U);

  const ProgramRun there = validate("linear.csv", {"--train", "0:2000", "--range", "2000:3000", "--warmup", "50",
                                                   "--noise", "0.3", "--lags", "10", "--json", "v.json", "--quiet"});
  EXPECT_EQ(there.code, 0) << there.err;
  EXPECT_TRUE(there.out.empty());
  const json test = json_file(folder_ / "v.json");
  EXPECT_EQ(test["set"], "test");
  EXPECT_EQ(test["samples"], 950);
  EXPECT_EQ(test["judged"], "2000:3000");
  // 950 samples: a deviation of a deviation of 2.3 %.
  EXPECT_NEAR(test["noise_level"]["ratio"].get<double>(), 1.0, 0.09);
  EXPECT_NEAR(test["test_over_training"]["ratio"].get<double>(), 1.0, 0.12);
}

TEST_F(ValidateCommand, ResultOfAFitHasTheTests) {
  const std::vector<std::string> common = {"fit", "linear.csv", "--input", "u",      "--output", "y",        "--rate",
                                           "1",   "--train",    "0:2000",  "--test", "2000:",    "--warmup", "50"};
  const auto tests_of = [&](const std::string& model) {
    std::vector<std::string> arguments = common;
    for (const std::string& more : {std::string("--model"), model, std::string("--init"), std::string("none"),
                                    std::string("--quiet"), std::string("--json"), std::string("result.json")}) {
      arguments.push_back(more);
    }
    const ProgramRun result = run(arguments);
    EXPECT_EQ(result.code, 0) << result.err;
    return json_file(folder_ / "result.json")["residual_tests"];
  };
  const json right = tests_of("G=rational(nb=1,na=2)");
  EXPECT_TRUE(right["passed"].get<bool>());
  EXPECT_EQ(right["set"], "test");
  EXPECT_TRUE(right["over_fit"].empty()) << right["over_fit"];
  ASSERT_EQ(right["tests"].size(), 8U);
  for (const json& test : right["tests"]) {
    EXPECT_EQ(test["passed"].get<bool>(), test["statistic"].get<double>() <= test["limit"].get<double>());
    EXPECT_FALSE(test.contains("lags"));
  }
  // An excess pole, which the standard deviations of the coefficients alone need not show.
  const std::string large = tests_of("G=rational(nb=3,na=4)")["over_fit"].dump();
  EXPECT_THAT(large, HasSubstr("may do"));
  EXPECT_THAT(tests_of("G=rational(nb=0,na=1)")["under_fit"].dump(), HasSubstr("input"));
}

TEST_F(ValidateCommand, MissingNonlinearityIsFoundAndSaid) {
  fit("square.csv");
  const ProgramRun result = validate("square.csv", {"--train", "0:2000", "--json", "v.json"});
  EXPECT_EQ(result.code, 5);
  EXPECT_THAT(result.out, AllOf(HasSubstr("the records contradict the model"), HasSubstr("squared input"),
                                HasSubstr("an even nonlinearity is missing")));
  EXPECT_FALSE(json_file(folder_ / "v.json")["passed"].get<bool>());
  EXPECT_FALSE(json_file(folder_ / "v.json")["under_fit"].empty());
}

TEST_F(ValidateCommand, PeriodicDataShowTheErrorBesideTheNoise) {
  fit("periodic.csv");
  const ProgramRun result = validate("periodic.csv", {"--range", "300:", "--period", "300", "--warmup", "100", "--json",
                                                      "v.json", "--report", "v.html"});
  EXPECT_EQ(result.code, 5);
  const json outcome = json_file(folder_ / "v.json");
  EXPECT_EQ(outcome["set"], "given");
  EXPECT_EQ(outcome["error_spectrum"]["periods"], 8);
  EXPECT_FALSE(outcome["error_spectrum"]["passed"].get<bool>());
  const std::string page = read_file(folder_ / "v.html");
  for (const char* id :
       {"residual-cross-correlation", "residual-nonlinear", "residual-autocorrelation", "periodic-error"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\">"));
  }
  if (result.err.find("gnuplot is not installed") == std::string::npos) {
    EXPECT_EQ(testing::occurrences(page, "<svg"), 4);
  }
}

/// Noise of another seed under the name of the output, `names` of its two columns.
void write_noise(const std::filesystem::path& path, const std::vector<std::string>& names, Index samples,
                 double deviation, std::uint64_t seed) {
  testing::Noise noise(seed);
  Table table;
  table.has_header = true;
  table.names = names;
  table.values.resize(samples, 2);
  table.values.col(0) = noise.white(samples, 1.0);
  table.values.col(1) = noise.white(samples, deviation).array() + 0.7;
  write_file_atomically(path, to_csv(table));
}

TEST_F(ValidateCommand, RecordOfNoiseIsComparedWithTheResidual) {
  fit("linear.csv");
  write_noise(folder_ / "noise.csv", {"other", "y"}, 1500, 0.3, 5);
  write_noise(folder_ / "still.csv", {"other", "y"}, 1500, 0.2, 6);
  const ProgramRun right = validate(
      "linear.csv", {"--train", "0:2000", "--noise-record", "noise.csv", "--json", "v.json", "--report", "v.html"});
  EXPECT_EQ(right.code, 0) << right.out << right.err;
  EXPECT_THAT(right.out, HasSubstr("noise spectrum"));
  const json spectrum = json_file(folder_ / "v.json")["noise_spectrum"];
  EXPECT_TRUE(spectrum["passed"].get<bool>());
  EXPECT_EQ(spectrum["segment"], 128);
  EXPECT_EQ(spectrum["noise_segments"], 11);
  EXPECT_EQ(spectrum["frequency_hz"].size(), 16U);
  EXPECT_GE(spectrum["p_value"].get<double>(), 0.01);
  EXPECT_THAT(read_file(folder_ / "v.html"), HasSubstr("<figure id=\"noise-spectrum\">"));
  // Said to be less than it is: the rest counts as the model's.
  const ProgramRun less =
      validate("linear.csv", {"--train", "0:2000", "--noise-record", "still.csv", "--json", "v.json"});
  EXPECT_EQ(less.code, 5) << less.out;
  EXPECT_THAT(less.out, AllOf(HasSubstr("contradict the model: noise spectrum"), HasSubstr("times the power")));
  EXPECT_FALSE(json_file(folder_ / "v.json")["noise_spectrum"]["passed"].get<bool>());
}

// A record whose input rests for its first 600 samples; the model lacks the square that the rest shows.
TEST_F(ValidateCommand, NoiseIsRecordedWhereTheInputRests) {
  testing::Noise noise(7);
  VectorXd u = noise.coloured(kSamples, 0.5, 1.0);
  u.head(600).setZero();
  write_record(folder_ / "resting.csv", u, 0.1, 0.3);
  fit("square.csv");
  const ProgramRun result =
      validate("resting.csv", {"--range", "700:", "--warmup", "50", "--noise-record", "0:600", "--json", "v.json"});
  EXPECT_EQ(result.code, 5) << result.err;
  const json spectrum = json_file(folder_ / "v.json")["noise_spectrum"];
  EXPECT_FALSE(spectrum["passed"].get<bool>());
  EXPECT_EQ(spectrum["noise_segments"], 9);
  const auto error = [&](const std::string& record) {
    const ProgramRun refused = validate("resting.csv", {"--range", "700:", "--noise-record", record});
    EXPECT_EQ(refused.code, 1) << refused.out;
    return refused.err;
  };
  EXPECT_THAT(error("0:700"), HasSubstr("--noise-record 0:700: expected samples where the input rests"));
  EXPECT_THAT(error("0:100"), HasSubstr("8 segments of 16 samples without a gap in the residual and in the noise"));
  EXPECT_THAT(error("0:9999"), HasSubstr("--noise-record 0:9999"));
  EXPECT_THAT(error("absent.csv"), HasSubstr("absent.csv"));
  write_noise(folder_ / "nameless.csv", {"a", "b"}, 500, 0.3, 8);
  EXPECT_THAT(error("nameless.csv"), HasSubstr("nameless.csv"));
  write_noise(folder_ / "timed.csv", {"t", "y"}, 500, 0.3, 9);
  const ProgramRun rate = validate("linear.csv", {"--noise-record", "timed.csv", "--rate", "2"});
  EXPECT_THAT(rate.err, HasSubstr("sampled every 0.5 s, but the model every 1 s"));
}

// Time stamps of the noise that are not those of the model.
TEST_F(ValidateCommand, NoiseOfAnotherSampleTimeIsRefused) {
  fit("linear.csv");
  const auto write_timed = [&](const std::string& name, double sample_time_s) {
    testing::Noise noise(10);
    Table table;
    table.has_header = true;
    table.names = {"s", "u", "y"};
    table.values.resize(1000, 3);
    table.values.col(0) = sample_time_s * VectorXd::LinSpaced(1000, 0.0, 999.0);
    table.values.col(1) = noise.white(1000, 1.0);
    table.values.col(2) = noise.white(1000, 0.3);
    write_file_atomically(folder_ / name, to_csv(table));
  };
  write_timed("data.csv", 1.0);
  write_timed("slow.csv", 2.0);
  const ProgramRun result = validate("data.csv", {"--time", "s", "--noise-record", "slow.csv"});
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.err, AllOf(HasSubstr("slow.csv"), HasSubstr("2 s"), HasSubstr("1 s")));
}

// An unstable model leaves a residual that an autoregression describes, so that no test of its lags fails.
TEST_F(ValidateCommand, UnstableModelIsContradicted) {
  fit("linear.csv");
  json model = json_file(folder_ / "model.json");
  const std::string text = model.dump();
  ASSERT_EQ(model["parameters"].size(), 4U) << text;
  // Poles 1.01 and 0.5.
  model["parameters"][2]["value"] = -1.51;
  model["parameters"][3]["value"] = 0.505;
  write_file_atomically(folder_ / "model.json", model.dump());
  const ProgramRun result = validate("linear.csv", {"--json", "v.json"});
  EXPECT_EQ(result.code, 5) << result.out << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("contradict the model"), HasSubstr("size"), HasSubstr("explains nothing")));
  EXPECT_GT(json_file(folder_ / "v.json")["residual_over_output"].get<double>(), 1e6);
}

TEST_F(ValidateCommand, ModelOfOtherDataIsFarFromTheMinimum) {
  fit("linear.csv");
  const ProgramRun result = validate("square.csv", {"--train", "0:2000"});
  EXPECT_THAT(result.err, HasSubstr("standard deviations from the best ones for these records"));
}

TEST_F(ValidateCommand, EverySecondSampleIsARecordOfItsOwnRate) {
  const ProgramRun result =
      run({"fit", "linear.csv", "--input", "u", "--output", "y", "--rate", "10", "--every", "2", "--model",
           "G=rational(nb=2,na=2)", "--init", "none", "--quiet", "-o", "model.json", "--json", "r.json"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(json_file(folder_ / "r.json")["train"]["samples"], kSamples / 2);
  EXPECT_DOUBLE_EQ(json_file(folder_ / "model.json")["sample_time_s"].get<double>(), 0.2);
  EXPECT_NE(validate("linear.csv", {"--every", "2", "--rate", "10"}).code, 1);
  EXPECT_NE(validate("linear.csv", {"--every", "2"}).code, 1);
  EXPECT_THAT(validate("linear.csv", {"--rate", "10"}).err, HasSubstr("sampled every 0.1 s, but the model every 0.2"));
}

TEST_F(ValidateCommand, BadInputIsRefused) {
  fit("linear.csv");
  EXPECT_THAT(validate("linear.csv", {"--range", "0:50"}).err, HasSubstr("expected at least 104 scored samples"));
  EXPECT_EQ(validate("linear.csv", {"--range", "0:50"}).code, 1);
  EXPECT_THAT(validate("linear.csv", {"--range", "5000:"}).err, HasSubstr("5000"));
  EXPECT_THAT(validate("linear.csv", {"--significance", "2"}).err, HasSubstr("significance in (0, 1), got 2"));
  EXPECT_EQ(validate("linear.csv", {"--noise", "-1"}).code, 1);
  EXPECT_EQ(validate("linear.csv", {"--rate", "2"}).code, 1) << "another sample time than the model's";
  EXPECT_EQ(validate("absent.csv", {}).code, 1);
  EXPECT_EQ(validate("linear.csv", {"--json", "absent/v.json"}).code, 3);
  const ProgramRun overlap = validate("linear.csv", {"--train", "0:2000", "--range", "1000:3000"});
  EXPECT_THAT(overlap.err, HasSubstr("overlap"));
}

}  // namespace
}  // namespace blockid
