// Continuous-time models from sampled data.
#include "cli/program.hpp"
#include "support/signals.hpp"
#include "support/temp_dir.hpp"

#include <blockid/data/atomic_file.hpp>
#include <blockid/data/csv.hpp>
#include <blockid/problems/gaussian.hpp>
#include <blockid/problems/janiszowski.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace blockid {
namespace {

using nlohmann::json;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using testing::json_file;
using ::testing::Not;
using testing::ProgramRun;
using testing::run_program;
using testing::TempDir;

constexpr double kSampleTime = 1e-3;

class CtCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
    write("servo.csv", u, problems::servo_response(u, kSampleTime).velocity_mm_s);
  }

  void write(const std::string& name, const Eigen::VectorXd& u, const Eigen::VectorXd& y) const {
    Table table;
    table.has_header = true;
    table.names = {"u", "v"};
    table.values.resize(u.size(), 2);
    table.values << u, y;
    write_file_atomically(folder_ / name, to_csv(table));
  }

  ProgramRun ct(const std::vector<std::string>& more, const std::string& file = "servo.csv") const {
    std::vector<std::string> arguments = {"ct", file, "--input", "u", "--output", "v", "--sample-time", "0.001"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    if (std::find(more.begin(), more.end(), "--method") == more.end()) {
      arguments.insert(arguments.end(), {"--method", "tustin"});
    }
    return run_program(arguments, folder_.path());
  }

  TempDir folder_;
};

TEST_F(CtCommand, FindsTheExactDeltaFormByGoodwin) {
  const ProgramRun run = ct({"--method", "goodwin", "--orders", "1,2", "--json", "ct.json"});
  ASSERT_EQ(run.code, 0) << run.err;
  const json result = json_file(folder_ / "ct.json");
  EXPECT_EQ(result["method"], "goodwin");
  EXPECT_NEAR(result["denominator"][1].get<double>(), 20.19734, 1e-4);
  EXPECT_NEAR(result["denominator"][0].get<double>(), 396.01333, 1e-3);
  EXPECT_NEAR(result["numerator"][0].get<double>(), 990033.33, 2.0);
  EXPECT_TRUE(result["stable"].get<bool>());
  EXPECT_EQ(result["rank"], 4);
  EXPECT_EQ(result["coefficients"].size(), 4U);
  EXPECT_THAT(run.out, HasSubstr("20.197"));
}

TEST_F(CtCommand, LeavesOutCoefficientsAndScoresTheSimulation) {
  const ProgramRun run = ct({"--orders", "1,2", "--without", "b1", "--train", "0:1000", "--test", "1000:2000",
                             "--warmup", "500", "--json", "ct.json"});
  ASSERT_EQ(run.code, 0) << run.err;
  const json result = json_file(folder_ / "ct.json");
  EXPECT_EQ(result["method"], "tustin");
  EXPECT_EQ(result["coefficients"].size(), 3U);
  EXPECT_EQ(result["numerator"].size(), 1U);
  // Discretisation error of Tustin at 1 ms: 0.02 % of the damping.
  EXPECT_NEAR(result["denominator"][1].get<double>(), 20.0, 0.01);
  // The test record does not start from rest; after 0.5 s what is left of that is e^-5.
  EXPECT_LT(result["train"]["nrmse"].get<double>(), 2e-3);
  EXPECT_LT(result["test"]["nrmse"].get<double>(), 2e-2);
}

TEST_F(CtCommand, SearchesTheDelay) {
  const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(2000);
  y.tail(1995) = problems::servo_response(u, kSampleTime).velocity_mm_s.head(1995);
  write("late.csv", u, y);
  const ProgramRun run =
      ct({"--method", "goodwin", "--orders", "1,2", "--max-delay", "8", "--json", "ct.json"}, "late.csv");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(json_file(folder_ / "ct.json")["delay"], 5);
}

TEST_F(CtCommand, WarnsOfTooManyCoefficientsAndOfInstability) {
  // Settled under two tones, the input excites four directions.
  const ProgramRun many = ct({"--orders", "4,5", "--train", "1500:2000", "--quiet", "--json", "ct.json"});
  EXPECT_THAT(many.err, HasSubstr("the data determine "));
  EXPECT_LT(json_file(folder_ / "ct.json")["rank"].get<int>(), 10);
  const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
  write("position.csv", u, problems::servo_response(u, kSampleTime).position_mm);
  const ProgramRun integrator = ct({"--orders", "0,3", "--without", "a0"}, "position.csv");
  EXPECT_EQ(integrator.code, 0) << integrator.err;
  EXPECT_THAT(integrator.err, HasSubstr("the model is not stable"));
  EXPECT_THAT(integrator.out, ContainsRegex("pole +0 "));
}

TEST_F(CtCommand, CountsTheFrequenciesOfTheInput) {
  // One tone and its response, which starts from rest: transients and noise fill the numerical rank.
  testing::Noise numbers(3);
  Eigen::VectorXd u(2000);
  for (Eigen::Index t = 0; t < u.size(); ++t) u[t] = std::sin(25.0 * kSampleTime * static_cast<double>(t));
  const Eigen::VectorXd y = problems::servo_response(u, kSampleTime).velocity_mm_s + numbers.white(2000, 0.1);
  write("one.csv", u, y);
  const std::string lack = "the input excites 1 frequency: 2 equations for 6 coefficients";
  for (const std::vector<std::string>& method :
       {std::vector<std::string>{"srivc"}, {"flbf"}, {"flbf", "--iv"}, {"svf"}, {"goodwin"}, {"tustin"}}) {
    std::vector<std::string> arguments = {"--orders", "2,3", "--json", "ct.json", "--method"};
    arguments.insert(arguments.end(), method.begin(), method.end());
    const ProgramRun run = ct(arguments, "one.csv");
    EXPECT_THAT(run.err, HasSubstr(lack)) << method[0];
    const json result = json_file(folder_ / "ct.json");
    EXPECT_THAT(result["warnings"].dump(), HasSubstr(lack));
    EXPECT_EQ(result["excitation"]["frequencies"], 1);
    EXPECT_FALSE(result["excitation"]["enough"].get<bool>());
    // Two coefficients are enough of a tone, four of the two of servo.csv.
    EXPECT_THAT(ct({"--orders", "0,1", "--method", method[0]}, "one.csv").err, Not(HasSubstr("excites")));
    EXPECT_THAT(ct({"--orders", "1,2", "--method", method[0]}).err, Not(HasSubstr("excites")));
    EXPECT_THAT(ct({"--orders", "2,3", "--method", method[0]}).err, HasSubstr("2 frequencies: 4 equations for 6"));
  }
}

TEST_F(CtCommand, TheSavedModelSimulatesWhatWasScored) {
  // Five samples late, to be found by the model file, too.
  const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(2000);
  y.tail(1995) = problems::servo_response(u, kSampleTime).velocity_mm_s.head(1995);
  write("late.csv", u, y);
  const ProgramRun run = ct({"--orders", "1,2", "--delay", "5", "--train", "0:1500", "--test", "1500:2000", "--warmup",
                             "400", "-o", "model.json", "--json", "ct.json"},
                            "late.csv");
  ASSERT_EQ(run.code, 0) << run.err;
  const json result = json_file(folder_ / "ct.json");
  EXPECT_THAT(result["model"].get<std::string>(), HasSubstr("delay(samples=5) | G=continuous_rational(nb=1,na=2"));
  EXPECT_EQ(result["test"]["ranges"], json::array({"1500:2000"}));
  EXPECT_EQ(result["data"]["initial_state"], "rest");
  const ProgramRun simulation = run_program({"simulate", "model.json", "late.csv", "--input", "u", "--output", "v",
                                             "--range", "1500:2000", "--warmup", "400", "--json", "simulation.json"},
                                            folder_.path());
  ASSERT_EQ(simulation.code, 0) << simulation.err;
  EXPECT_EQ(json_file(folder_ / "simulation.json")["metrics"]["rmse"], result["test"]["rmse"]);
}

TEST_F(CtCommand, PolesHaveFrequencyAndDamping) {
  ASSERT_EQ(ct({"--orders", "1,2", "--json", "ct.json"}).code, 0);
  const json poles = json_file(folder_ / "ct.json")["poles"];
  ASSERT_EQ(poles.size(), 2U);
  // s^2 + 20 s + 400, discretised by Tustin at 1 ms: a relative error of 2e-4.
  EXPECT_NEAR(poles[0]["natural_frequency_hz"].get<double>(), 20.0 / (2.0 * std::numbers::pi), 1e-3);
  EXPECT_NEAR(poles[0]["damping"].get<double>(), 0.5, 2e-4);
}

TEST_F(CtCommand, TheReportShowsSimulationResponseAndResiduals) {
  const ProgramRun run = ct({"--orders", "1,2", "--report", "ct.html", "--quiet"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  const std::string page = read_file(folder_ / "ct.html");
  for (const char* id : {"measured-zoom", "measured-whole", "bode-G", "pole-zero-G", "residual-cross-correlation",
                         "residual-autocorrelation", "error-spectrum"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\"")) << id;
  }
  EXPECT_THAT(page, HasSubstr("In the s plane"));
  EXPECT_EQ(ct({"--orders", "1,2", "--report", "/nowhere/ct.html"}).code, 3);
}

TEST_F(CtCommand, RefusesBadOptions) {
  const auto refused = [&](const std::vector<std::string>& more, const std::string& words) {
    const ProgramRun run = ct(more);
    EXPECT_EQ(run.code, 1) << run.err;
    EXPECT_THAT(run.err, HasSubstr(words));
  };
  refused({"--orders", "2,2"}, "expected NB,NA with 0 <= NB < NA");
  refused({"--orders", "1,2", "--without", "b7"}, "--without b7: expected one of a1, a0, b1, b0");
  refused({"--orders", "0,2", "--without", "b0"}, "at least one coefficient of the numerator");
  refused({"--orders", "1,2", "--method", "magic"}, "goodwin");
  refused({"--orders", "1,2", "--warmup", "5000"}, "no more than the warm-up of 5000");
  refused({}, "--orders");
}

// ------------------------------------------------------------------------------------------- filters, not trends

/// v'' + 20 v' + 400 v = 1e6 u: natural frequency 20 rad/s, damping ratio 0.5.
class CtFilters : public CtCommand {
 protected:
  void expect_servo(double tolerance) const {
    const json result = json_file(folder_ / "ct.json");
    ASSERT_EQ(result["poles"].size(), 2U);
    EXPECT_NEAR(2.0 * std::numbers::pi * result["poles"][0]["natural_frequency_hz"].get<double>(), 20.0,
                20.0 * tolerance);
    EXPECT_NEAR(result["poles"][0]["damping"].get<double>(), 0.5, 0.5 * tolerance);
    EXPECT_NEAR(result["dc_gain"].get<double>(), 2500.0, 2500.0 * tolerance);
    EXPECT_TRUE(result["stable"].get<bool>());
    EXPECT_TRUE(result["warnings"].empty());
  }

  ProgramRun filters(const std::string& method, const std::vector<std::string>& more,
                     const std::string& file = "servo.csv") const {
    std::vector<std::string> arguments = {"--method", method, "--orders", "0,2", "--hold", "zoh", "--json", "ct.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return ct(arguments, file);
  }
};

TEST_F(CtFilters, EveryMethodFindsTheServo) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> methods = {
      {"flbf", {}}, {"svf", {}}, {"flbf", {"--iv"}}, {"svf", {"--iv"}}, {"srivc", {}}};
  for (const auto& [method, more] : methods) {
    const ProgramRun run = filters(method, more);
    ASSERT_EQ(run.code, 0) << run.err;
    // A held input leaves corners in the second derivative of the output, which a spline rounds off: about (w h)^2 at
    // the highest tone, 0.075^2.
    expect_servo(6e-3);
    const json result = json_file(folder_ / "ct.json");
    EXPECT_EQ(result["method"], method);
    EXPECT_EQ(result["hold"], "zoh");
    EXPECT_EQ(result["data"]["initial_state"], "estimated from each record");
    EXPECT_GT(result["rows"].get<int>(), 1900);
  }
}

TEST_F(CtFilters, TheRefitIsExact) {
  const ProgramRun run = filters("flbf", {"--refit", "-o", "model.json"});
  ASSERT_EQ(run.code, 0) << run.err;
  // Without noise the cost goes down to rounding; the search ends when it changes by less than 1e-10 of itself.
  expect_servo(1e-5);
  EXPECT_EQ(json_file(folder_ / "ct.json")["refit"]["status"], "converged");
  const ProgramRun simulation = run_program({"simulate", "model.json", "servo.csv", "--input", "u", "--output", "v",
                                             "--initial-state", "estimated", "--json", "simulation.json"},
                                            folder_.path());
  ASSERT_EQ(simulation.code, 0) << simulation.err;
  EXPECT_LT(json_file(folder_ / "simulation.json")["metrics"]["nrmse"].get<double>(), 1e-5);
}

TEST_F(CtFilters, DeviationsAreThoseOfTheNoise) {
  const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
  const Eigen::VectorXd v = problems::servo_response(u, kSampleTime).velocity_mm_s;
  write("noisy.csv", u, v + 20.0 * problems::Gaussian(7).vector(v.size()));
  ASSERT_EQ(filters("srivc", {"--train", "0:1500", "--test", "1500:"}, "noisy.csv").code, 0);
  const json result = json_file(folder_ / "ct.json");
  for (const json& one : result["coefficients"]) {
    const std::string name = one["name"];
    const double truth = name == "a1" ? 20.0 : name == "a0" ? 400.0 : 1e6;
    const double deviation = one["standard_deviation"];
    EXPECT_GT(deviation, 1e-5 * truth) << name;
    EXPECT_LT(deviation, 0.05 * truth) << name;
    // Four and a half deviations, and the error of the spline.
    EXPECT_NEAR(one["value"].get<double>(), truth, 4.5 * deviation + 6e-3 * truth) << name;
  }
  // A mean of 500 squares scatters by 6 %, its root by 3 %.
  EXPECT_NEAR(result["test"]["rmse"].get<double>(), 20.0, 0.15 * 20.0);
}

TEST_F(CtFilters, ADelayIsTakenOut) {
  const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(2000);
  y.tail(1990) = problems::servo_response(u, kSampleTime).velocity_mm_s.head(1990);
  write("late.csv", u, y);
  const ProgramRun run = filters("srivc", {"--delay", "10"}, "late.csv");
  ASSERT_EQ(run.code, 0) << run.err;
  expect_servo(6e-3);
  EXPECT_LT(json_file(folder_ / "ct.json")["train"]["nrmse"].get<double>(), 1e-2);
  const ProgramRun longer = filters("srivc", {"--delay", "2000"}, "late.csv");
  EXPECT_EQ(longer.code, 1);
  EXPECT_THAT(longer.err, HasSubstr("--delay 2000"));
}

TEST_F(CtFilters, TheReportHasItsPictures) {
  ASSERT_EQ(filters("srivc", {"--report", "ct.html", "--quiet"}).code, 0);
  const std::string page = read_file(folder_ / "ct.html");
  for (const char* id : {"measured-zoom", "bode-G", "pole-zero-G", "residual-cross-correlation"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\"")) << id;
  }
}

TEST_F(CtFilters, TellsOfBreakPointsAndRank) {
  // Above the lowest frequency that two seconds show, pi rad/s, up to beyond the Nyquist frequency, 3142 rad/s.
  const ProgramRun outside = filters("flbf", {"--break-points", "10:10000"});
  EXPECT_EQ(outside.code, 0) << outside.err;
  EXPECT_TRUE(json_file(folder_ / "ct.json")["flags"]["break_points_outside_band"].get<bool>());
  EXPECT_THAT(outside.err, HasSubstr("break point"));
  const ProgramRun beyond = filters("flbf", {"--break-points", "10000:20000"});
  EXPECT_EQ(beyond.code, 1);
  EXPECT_THAT(beyond.err, HasSubstr("outside the band of the data"));
}

TEST_F(CtFilters, RefinedInstrumentalVariablesAreTheDefault) {
  const ProgramRun run = run_program({"ct", "servo.csv", "--input", "u", "--output", "v", "--sample-time", "0.001",
                                      "--orders", "0,2", "--hold", "zoh", "--json", "ct.json"},
                                     folder_.path());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(json_file(folder_ / "ct.json")["method"], "srivc");
  expect_servo(6e-3);
}

TEST_F(CtFilters, SearchTheDelay) {
  const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(2000);
  y.tail(1995) = problems::servo_response(u, kSampleTime).velocity_mm_s.head(1995);
  write("late.csv", u, y);
  for (const char* method : {"flbf", "svf", "srivc"}) {
    const ProgramRun run = filters(method, {"--max-delay", "8", "--refit"}, "late.csv");
    ASSERT_EQ(run.code, 0) << run.err;
    const json result = json_file(folder_ / "ct.json");
    EXPECT_EQ(result["delay"], 5) << method;
    ASSERT_EQ(result["delays"].size(), 9U);
    // Less than one sample of delay is what a held input lets the model make up for.
    EXPECT_LT(result["delays"][5]["squared_error"], result["delays"][4]["squared_error"]) << method;
    EXPECT_LT(result["delays"][5]["squared_error"], result["delays"][6]["squared_error"]) << method;
  }
}

TEST_F(CtFilters, TrendsAreRefittedToo) {
  // Two tones, no noise: Tustin's error of 2e-4 goes down to that of the search.
  ASSERT_EQ(ct({"--orders", "0,2", "--refit", "--json", "ct.json"}).code, 0);
  expect_servo(1e-5);
  EXPECT_EQ(json_file(folder_ / "ct.json")["refit"]["status"], "converged");
}

TEST_F(CtFilters, BreakPointsMoveToThePoles) {
  // 20 rad/s twice beside 1000 and 3000 rad/s: |A/E| drifts by 7500.
  ASSERT_EQ(filters("flbf", {"--break-points", "1000:3000", "--no-relocate"}).code, 0);
  const json kept = json_file(folder_ / "ct.json");
  EXPECT_FALSE(kept["flags"]["relocated"].get<bool>());
  EXPECT_TRUE(kept["flags"]["drift"].get<bool>());
  const ProgramRun run = filters("flbf", {"--break-points", "1000:3000"});
  ASSERT_EQ(run.code, 0) << run.err;
  const json moved = json_file(folder_ / "ct.json");
  EXPECT_TRUE(moved["flags"]["relocated"].get<bool>());
  EXPECT_LT(moved["drift"].get<double>(), 10.0);
  EXPECT_LE(moved["train"]["rmse"], kept["train"]["rmse"]);
  EXPECT_THAT(run.err, HasSubstr("break points were relocated"));
}

TEST_F(CtFilters, RefusesAColumnOfTimesForASampleTime) {
  // Uniform or not: a record has one sample time.
  Table table;
  table.has_header = true;
  table.names = {"t", "u", "v"};
  table.values.resize(200, 3);
  const Eigen::VectorXd u = problems::two_tones(200, kSampleTime);
  table.values << kSampleTime * Eigen::VectorXd::LinSpaced(200, 0.0, 199.0), u, u;
  table.values(100, 0) += 0.5 * kSampleTime;
  write_file_atomically(folder_ / "uneven.csv", to_csv(table));
  for (const char* command : {"ct", "linear"}) {
    std::vector<std::string> arguments = {command, "uneven.csv",         "--input", "u", "--output",
                                          "v",     "--sample-time-from", "t"};
    const std::vector<std::string> more = command == std::string("ct")
                                              ? std::vector<std::string>{"--orders", "0,2"}
                                              : std::vector<std::string>{"--structure", "arx", "--orders", "na=1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramRun run = run_program(arguments, folder_.path());
    EXPECT_EQ(run.code, 1) << command;
    EXPECT_THAT(run.err, HasSubstr("column 't' varies from 0 to 0.199, expected one number")) << command;
  }
}

TEST_F(CtFilters, EveryHoldIsTaken) {
  // Two tones below 2 % of the sampling frequency, held: a spline through them is late by half a sample, which is 2 %
  // of the time constants.
  for (const char* hold : {"zoh", "foh", "spline3", "spline5", "spline7", "band_limited"}) {
    const ProgramRun run = ct({"--orders", "1,2", "--method", "srivc", "--hold", hold, "--json", "ct.json"});
    ASSERT_EQ(run.code, 0) << run.err;
    const json result = json_file(folder_ / "ct.json");
    EXPECT_EQ(result["hold"], hold);
    EXPECT_NEAR(result["denominator"][0].get<double>(), 400.0, 12.0) << hold;
  }
}

TEST_F(CtFilters, ResidualTestsTellOfAnOrderThatIsTooLow) {
  testing::Noise numbers(8);
  const Eigen::VectorXd u = numbers.white(2000);
  Eigen::VectorXd y = problems::servo_response(u, kSampleTime).velocity_mm_s;
  y += 0.05 * std::sqrt(y.squaredNorm() / 2000.0) * numbers.white(2000);
  write("noisy.csv", u, y);
  for (const char* orders : {"0,2", "0,1"}) {
    const ProgramRun run = ct({"--orders", orders, "--method", "srivc", "--hold", "zoh", "--train", "0:1500", "--test",
                               "1500:2000", "--json", "ct.json"},
                              "noisy.csv");
    ASSERT_EQ(run.code, 0) << run.err;
    const json tests = json_file(folder_ / "ct.json")["residual_tests"];
    EXPECT_EQ(tests["set"], "test");
    EXPECT_EQ(tests["passed"].get<bool>(), orders == std::string("0,2")) << tests["verdict"];
    EXPECT_FALSE(tests["tests"][0].contains("correlations"));
    EXPECT_THAT(run.out, HasSubstr("residual tests on the test data: "));
  }
}

TEST_F(CtFilters, LeaveOutCoefficientsToo) {
  // The position of the servo: an integrator behind v.
  const Eigen::VectorXd u = problems::two_tones(2000, kSampleTime);
  write("position.csv", u, problems::servo_response(u, kSampleTime).position_mm);
  for (const char* method : {"srivc", "flbf", "svf"}) {
    SCOPED_TRACE(method);
    const ProgramRun run = ct({"--orders", "1,3", "--hold", "zoh", "--method", method, "--without", "a0", "--without",
                               "b1", "--json", "ct.json", "-o", "model.json"},
                              "position.csv");
    ASSERT_EQ(run.code, 0) << run.err;
    const json result = json_file(folder_ / "ct.json");
    ASSERT_EQ(result["coefficients"].size(), 3U);
    EXPECT_EQ(result["numerator"].size(), 1U);
    EXPECT_EQ(result["denominator"][0], 0.0);
    EXPECT_EQ(result["poles"][0]["real"], 0.0);
    EXPECT_TRUE(result["dc_gain"].is_null());
    EXPECT_FALSE(result["stable"].get<bool>());
    EXPECT_TRUE(result["excitation"]["enough"].get<bool>());
    // srivc is exact; of the others the output's hold is an error, of two tones below 2 % of the sampling frequency.
    EXPECT_NEAR(result["denominator"][1].get<double>(), 400.0, method == std::string("srivc") ? 1e-3 : 2.0);
    EXPECT_NEAR(result["denominator"][2].get<double>(), 20.0, method == std::string("srivc") ? 1e-4 : 0.1);
    EXPECT_LT(result["train"]["nrmse"].get<double>(), 1e-2);
    const ProgramRun simulation = run_program({"simulate", "model.json", "position.csv", "--input", "u", "--output",
                                               "v", "--initial-state", "estimated", "--json", "simulation.json"},
                                              folder_.path());
    ASSERT_EQ(simulation.code, 0) << simulation.err;
    EXPECT_LT(json_file(folder_ / "simulation.json")["metrics"]["nrmse"].get<double>(), 1e-2);
  }
}

TEST_F(CtFilters, RefusesOptionsOfOtherMethods) {
  const auto refused = [&](const std::vector<std::string>& more, const std::string& words) {
    const ProgramRun run = ct(more);
    EXPECT_EQ(run.code, 1) << run.err;
    EXPECT_THAT(run.err, HasSubstr(words));
  };
  const std::string filters_only = "does not belong to --method tustin";
  refused({"--orders", "1,2", "--hold", "foh"}, "--hold: " + filters_only);
  refused({"--orders", "1,2", "--break-points", "1:2"}, "--break-points: " + filters_only);
  refused({"--orders", "1,2", "--iv"}, "--iv: " + filters_only);
  refused({"--orders", "1,2", "--no-relocate"}, "--no-relocate: " + filters_only + ", only to flbf, svf and srivc");
  refused({"--orders", "1,2", "--refit", "--without", "b1"}, "--refit: estimates all coefficients");
  refused({"--orders", "1,2", "--max-iterations", "9"}, "--max-iterations: " + filters_only);
  refused({"--orders", "1,2", "--method", "flbf", "--without", "b7"}, "--without b7: expected one of a1, a0, b1, b0");
  refused({"--orders", "0,2", "--method", "svf", "--without", "b0"}, "at least one coefficient of the numerator");
  refused({"--orders", "1,2", "--method", "svf", "--max-delay", "2000"}, "--max-delay 2000: expected less than");
  refused({"--orders", "1,2", "--method", "srivc", "--iv"}, "srivc refines instrumental variables itself");
  refused({"--orders", "3,2", "--method", "flbf"}, "expected NB,NA with 0 <= NB <= NA");
  refused({"--orders", "1,2", "--method", "flbf", "--hold", "wave"}, "--hold wave: expected one of zoh");
  refused({"--orders", "1,2", "--method", "flbf", "--break-points", "5"}, "expected LO:HI");
}

}  // namespace
}  // namespace blockid
