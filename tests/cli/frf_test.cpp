// Continuous-time models from frequency responses, given as tables or measured on records.
#include "cli/program.hpp"
#include "data/mat_writer.hpp"
#include "support/temp_dir.hpp"

#include <blockid/data/atomic_file.hpp>
#include <blockid/data/csv.hpp>
#include <blockid/problems/gaussian.hpp>
#include <blockid/problems/welsh_goodwin.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <utility>
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
using Complex = std::complex<double>;
using Arguments = std::vector<std::string>;

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Poles of result files.
std::vector<Complex> poles_of(const json& result) {
  std::vector<Complex> poles;
  for (const json& pole : result["poles"])
    poles.emplace_back(pole["real"].get<double>(), pole["imaginary"].get<double>());
  return poles;
}

/// Largest relative distance of a true pole from the nearest found.
double pole_error(const json& result, const Eigen::VectorXcd& truth) {
  double worst = 0.0;
  for (const Complex& pole : truth) {
    double nearest = std::abs(pole);
    for (const Complex& found : poles_of(result)) nearest = std::min(nearest, std::abs(found - pole));
    worst = std::max(worst, nearest / std::abs(pole));
  }
  return worst;
}

class FrfCommand : public ::testing::Test {
 protected:
  ProgramRun frf(const std::string& file, const Arguments& more) const {
    Arguments arguments = {"frf", file, "--json", "frf.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments, folder_.path());
  }

  json result() const { return json_file(folder_ / "frf.json"); }

  void write(const std::string& name, const std::vector<std::string>& names,
             const std::vector<Eigen::VectorXd>& columns) const {
    Table table;
    table.has_header = true;
    table.names = names;
    table.values.resize(columns.front().size(), std::ssize(columns));
    for (Eigen::Index k = 0; k < std::ssize(columns); ++k) table.values.col(k) = columns[static_cast<std::size_t>(k)];
    write_file_atomically(folder_ / name, to_csv(table));
  }

  /// w in rad/s, re, im
  void write_response(const std::string& name, const FrequencyResponse& g) const {
    write(name, {"w", "re", "im"}, {g.omega_rad_s, g.response.real(), g.response.imag()});
  }

  static Arguments table(const Arguments& more) {
    Arguments arguments = {"--frequency", "w", "--frequency-unit", "rad/s", "--real", "re", "--imaginary", "im"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  void expect_refused(const Arguments& more, const std::string& words, const std::string& file = "welsh.csv") const {
    const ProgramRun run = frf(file, more);
    EXPECT_EQ(run.code, 1) << run.err;
    EXPECT_THAT(run.err, HasSubstr(words));
  }

  TempDir folder_;
};

TEST_F(FrfCommand, NineDecadesFromATable) {
  const problems::ResonantProblem problem = problems::welsh_goodwin();
  write_response("welsh.csv", problem.data);
  const ProgramRun run =
      frf("welsh.csv", table({"--orders", "17,18", "--method", "ls", "--weighting", "none", "--no-relocate"}));
  ASSERT_EQ(run.code, 0) << run.err;
  const json found = result();
  // The table is written to the last bit: the digits are those of the estimator's own tests.
  EXPECT_LT(pole_error(found, problems::poles(problem.modes)), 1e-12);
  EXPECT_NEAR(found["condition"].get<double>(), 3788.349282, 1e-6 * 3788.35);
  EXPECT_LT(found["largest_db"].get<double>(), 1e-11);
  EXPECT_EQ(found["rank"], 36);
  EXPECT_EQ(found["zeros"].size(), 17U);
  EXPECT_EQ(found["coefficients"].size(), 36U);
  EXPECT_EQ(found["data"]["tones"], 36);
  EXPECT_TRUE(found["stable"].get<bool>());
  EXPECT_TRUE(found["warnings"].empty());
  EXPECT_EQ(run.err, "");
  EXPECT_THAT(run.out, HasSubstr("table of 36 tones"));
  EXPECT_THAT(run.out, HasSubstr("natural frequency Hz"));
}

TEST_F(FrfCommand, NoDeviationsWhereNothingIsLeftToTellThem) {
  // Eight complex numbers, sixteen parameters.
  write_response("few.csv", problems::resonant_decades(2).data);
  const ProgramRun run = frf("few.csv", table({"--orders", "7,8", "--method", "ls"}));
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(result()["coefficients"][0]["standard_deviation"].is_null());
  EXPECT_TRUE(result()["poles"][0]["real_standard_deviation"].is_null());
}

TEST_F(FrfCommand, EveryFormOfTheSameTable) {
  const problems::ResonantProblem problem = problems::resonant_decades(3);
  const FrequencyResponse& g = problem.data;
  write("polar.csv", {"f", "mag", "db", "deg", "rad", "sd"},
        {g.omega_rad_s / kTurn, g.response.cwiseAbs(), magnitude_db(g), phase_deg(g),
         phase_deg(g) * std::numbers::pi / 180.0, 0.01 * g.response.cwiseAbs()});
  testing::MatWriter writer(folder_ / "g.mat", MAT_FT_MAT5);
  writer.add("f", Eigen::VectorXd(g.omega_rad_s / kTurn));
  writer.add_complex("G", g.response);
  const Eigen::VectorXcd truth = problems::poles(problem.modes);
  const std::vector<std::pair<std::string, Arguments>> forms = {
      {"polar.csv", {"--magnitude", "mag", "--phase", "deg"}},
      {"polar.csv", {"--magnitude-db", "db", "--phase", "rad", "--phase-unit", "rad", "--deviation", "sd"}},
      {"g.mat", {"--response", "G"}}};
  for (const auto& [file, form] : forms) {
    Arguments arguments = {"--frequency", "f", "--orders", "5,6"};
    arguments.insert(arguments.end(), form.begin(), form.end());
    const ProgramRun run = frf(file, arguments);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_LT(pole_error(result(), truth), 1e-11) << file << " " << form[0];
    EXPECT_EQ(result()["weighting"], form.size() > 4 ? "deviation" : "relative");
    EXPECT_EQ(result()["method"], "ml");
  }
}

TEST_F(FrfCommand, OtherBasesOverThreeDecades) {
  const problems::ResonantProblem problem = problems::resonant_decades(3);
  write_response("three.csv", problem.data);
  for (const char* basis : {"monomial", "chebyshev", "laguerre", "kautz"}) {
    const ProgramRun run = frf("three.csv", table({"--orders", "5,6", "--basis", basis, "--method", "ls"}));
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_LT(pole_error(result(), problems::poles(problem.modes)), 1e-4) << basis;
    EXPECT_EQ(result()["basis"]["kind"], basis);
  }
  const ProgramRun run = frf("three.csv", table({"--orders", "5,6", "--basis", "kautz", "--point", "30,0.5"}));
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(result()["basis"]["points"], json::array({30.0, 0.5}));
}

TEST_F(FrfCommand, DeviationsAreThoseOfTheNoise) {
  const problems::ResonantProblem problem = problems::resonant_decades(2);
  const Eigen::VectorXd omega =
      Eigen::VectorXd::LinSpaced(200, 0.0, 2.0).unaryExpr([](double x) { return std::pow(10.0, x); });
  const FrequencyResponse g{omega, problems::response_at(problem.modes, omega), {}, 0.0};
  write_response("noisy.csv", problems::with_relative_noise(g, 0.01, 4));
  ASSERT_EQ(frf("noisy.csv", table({"--orders", "3,4"})).code, 0);
  const json found = result();
  // 8 of 400 real numbers are fitted; a mean of 200 squares has a deviation of 7 %, its root half of that.
  EXPECT_NEAR(found["relative_rms"].get<double>(), 0.01 * std::sqrt(1.0 - 8.0 / 400.0), 0.15 * 0.01);
  const Eigen::VectorXcd truth = problems::poles(problem.modes);
  for (const json& pole : found["poles"]) {
    const Complex value(pole["real"].get<double>(), pole["imaginary"].get<double>());
    Eigen::Index nearest = 0;
    (truth.array() - value).abs().minCoeff(&nearest);
    const Complex error = value - truth[nearest];
    const double deviation = pole["real_standard_deviation"];
    EXPECT_GT(deviation, 0.0);
    // Four and a half deviations: once in 150 000.
    EXPECT_LT(std::abs(error.real()), 4.5 * deviation);
    EXPECT_LT(std::abs(error.imag()), 4.5 * pole["imaginary_standard_deviation"].get<double>());
  }
}

// ---------------------------------------------------------------------------------------------------------- records

/// (s / 300 + 2) / (s^2 / 60^2 + 2 0.1 s / 60 + 1): a resonance at 60 rad/s.
Complex plant(double omega) {
  const Complex s(0.0, omega);
  return (s / 300.0 + 2.0) / (s * s / 3600.0 + 0.2 * s / 60.0 + 1.0);
}

class FrfRecord : public FrfCommand {
 protected:
  static constexpr Eigen::Index kPeriod = 1000;
  static constexpr Eigen::Index kPeriods = 4;
  static constexpr double kSampleTime = 1e-3;

  /// A multisine of 60 lines from 1 Hz and what the plant makes of it, in the steady state: band-limited between the
  /// samples.
  void SetUp() override {
    const Eigen::Index count = kPeriod * kPeriods;
    Eigen::VectorXd u = Eigen::VectorXd::Zero(count);
    Eigen::VectorXd y = Eigen::VectorXd::Zero(count);
    for (int line = 1; line <= 60; ++line) {
      const double omega = kTurn * line;
      const Complex g = plant(omega);
      const double phase = 0.1 * line * line;
      for (Eigen::Index t = 0; t < count; ++t) {
        const Complex tone = std::polar(1.0, omega * kSampleTime * static_cast<double>(t) + phase);
        u[t] += tone.real();
        y[t] += (g * tone).real();
      }
    }
    problems::Gaussian gaussian(2);
    write("record.csv", {"u", "y"}, {u, y + kNoise * gaussian.vector(count)});
  }

  static constexpr double kNoise = 0.05;
  static inline const Eigen::VectorXcd kPoles =
      Eigen::Vector2cd(Complex(-6.0, 60.0 * std::sqrt(0.99)), Complex(-6.0, -60.0 * std::sqrt(0.99)));

  static Arguments record(const Arguments& more) {
    Arguments arguments = {"--input", "u", "--output", "y", "--rate", "1000"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

TEST_F(FrfRecord, PeriodsAreAveragedAndWeighted) {
  for (const char* weighting : {"relative", "deviation"}) {
    const ProgramRun run = frf(
        "record.csv", record({"--period", "1000", "--orders", "1,2", "--weighting", weighting, "-o", "model.json"}));
    ASSERT_EQ(run.code, 0) << run.err;
    const json found = result();
    EXPECT_EQ(found["data"]["tones"], 60);
    EXPECT_THAT(found["data"]["origin"].get<std::string>(), HasSubstr("averaged over 4 periods"));
    // Noise of 0.05 over lines of one, 4000 samples: 0.05 sqrt(2 / 4000) = 0.1 % of a line.
    EXPECT_LT(pole_error(found, kPoles), 2e-3) << weighting;
    EXPECT_THAT(found["model"].get<std::string>(), HasSubstr("continuous_rational(nb=1,na=2"));
  }
  const ProgramRun simulation =
      run_program({"simulate", "model.json", "record.csv", "--input", "u", "--output", "y", "--period", "1000",
                   "--initial-state", "periodic", "--json", "simulation.json"},
                  folder_.path());
  ASSERT_EQ(simulation.code, 0) << simulation.err;
  // The model's own error of about 0.1 % of an output of 10 adds a few percent to the noise.
  EXPECT_NEAR(json_file(folder_ / "simulation.json")["metrics"]["rmse"].get<double>(), kNoise, 0.1 * kNoise);
}

TEST_F(FrfRecord, IsSimulatedAndTested) {
  for (const Arguments& period : {Arguments{"--period", "1000"}, Arguments{}}) {
    Arguments arguments = record({"--orders", "1,2", "--report", "frf.html"});
    arguments.insert(arguments.end(), period.begin(), period.end());
    const ProgramRun run = frf("record.csv", arguments);
    ASSERT_EQ(run.code, 0) << run.err;
    const json found = result();
    // The model's own error of about 0.1 % of an output of 10 adds a few percent to the noise; more without a period.
    EXPECT_NEAR(found["train"]["rmse"].get<double>(), kNoise, (period.empty() ? 0.3 : 0.1) * kNoise);
    EXPECT_EQ(found["residual_tests"]["set"], "training");
    EXPECT_EQ(found["residual_tests"]["tests"][0]["test"], "offset");
    EXPECT_THAT(run.out, HasSubstr("simulation of the record: RMSE"));
    const std::string page = read_file(folder_ / "frf.html");
    for (const char* id : {"measured-zoom", "measured-whole", "bode-G", "pole-zero-G", "residual-cross-correlation",
                           "residual-autocorrelation", "error-spectrum"}) {
      EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\"")) << id;
    }
  }
  // One pole too few.
  ASSERT_EQ(frf("record.csv", record({"--period", "1000", "--orders", "0,1"})).code, 0);
  EXPECT_FALSE(result()["residual_tests"]["passed"].get<bool>());
}

TEST_F(FrfRecord, ABandAndARangeAreObeyed) {
  const ProgramRun run =
      frf("record.csv", record({"--period", "1000", "--orders", "1,2", "--band", "6.2:130", "--train", "1000:3000"}));
  ASSERT_EQ(run.code, 0) << run.err;
  // Lines 1 .. 20 Hz.
  EXPECT_EQ(result()["data"]["tones"], 20);
  EXPECT_THAT(result()["data"]["origin"].get<std::string>(), HasSubstr("averaged over 2 periods"));
}

TEST_F(FrfCommand, AHeldInputIsTakenIntoAccount) {
  // 1 / (s / 50 + 1) under a held input, exact: x_{t+1} = e x_t + (1 - e) u_t, e = exp(-50 h).
  constexpr Eigen::Index kPeriod = 2000;
  constexpr double kSampleTime = 1e-3;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * kPeriod);
  for (Eigen::Index t = 0; t < u.size(); ++t) {
    for (int line = 1; line <= 40; ++line) {
      u[t] += std::cos(kTurn * line * static_cast<double>(t) / kPeriod + 0.1 * line * line);
    }
  }
  Eigen::VectorXd y = Eigen::VectorXd::Zero(u.size());
  const double e = std::exp(-50.0 * kSampleTime);
  for (Eigen::Index t = 0; t + 1 < u.size(); ++t) y[t + 1] = e * y[t] + (1.0 - e) * u[t];
  write("held.csv", {"u", "y"}, {u, y});
  const auto pole_with = [&](const char* hold) {
    const ProgramRun run = frf("held.csv", {"--input", "u", "--output", "y", "--sample-time", "0.001", "--period",
                                            "2000", "--transient-periods", "1", "--orders", "0,1", "--hold", hold});
    EXPECT_EQ(run.code, 0) << run.err;
    return poles_of(result()).front().real();
  };
  // Lines up to 20 Hz = 2 % of the sampling frequency: aliases are (0.02)^2 of the response, half a sample of delay
  // is 0.06 radians at the highest line.
  EXPECT_NEAR(pole_with("zoh"), -50.0, 0.1);
  EXPECT_GT(std::abs(pole_with("band_limited") + 50.0), 0.5);
}

TEST_F(FrfRecord, RecordsWithoutAPeriodByTheLocalPolynomialMethod) {
  const ProgramRun run = frf("record.csv", record({"--orders", "1,2"}));
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(result()["data"]["origin"].get<std::string>(), HasSubstr("local polynomial method"));
  // Its period is 1000 samples, which nobody has told.
  EXPECT_THAT(run.err, HasSubstr("warning: the input repeats itself every 1000 samples: with --period 1000"));
  EXPECT_THAT(frf("record.csv", record({"--period", "1000", "--orders", "1,2"})).err, Not(HasSubstr("repeats itself")));
}

TEST_F(FrfCommand, ATonePerTwoCoefficientsIsTheLeast) {
  // Two tones in a record, known or not to repeat: four equations.
  Eigen::VectorXd u(4000);
  for (Eigen::Index t = 0; t < u.size(); ++t) {
    const double time = static_cast<double>(t) / 1000.0;
    u[t] = std::cos(kTurn * 5.0 * time) + std::cos(kTurn * 12.0 * time);
  }
  Eigen::VectorXd y = Eigen::VectorXd::Zero(u.size());
  for (Eigen::Index t = 0; t + 1 < u.size(); ++t) y[t + 1] = 0.95 * y[t] + 0.05 * u[t];
  write("two.csv", {"u", "y"}, {u, y});
  const Arguments record = {"--input", "u", "--output", "y", "--rate", "1000", "--hold", "zoh"};
  for (const Arguments& period : {Arguments{}, Arguments{"--period", "1000", "--transient-periods", "1"}}) {
    Arguments arguments = record;
    arguments.insert(arguments.end(), period.begin(), period.end());
    Arguments many = arguments;
    many.insert(many.end(), {"--orders", "2,3"});
    const ProgramRun refused = frf("two.csv", many);
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.err, HasSubstr("at least 3 tones"));
    EXPECT_THAT(refused.err, HasSubstr("for 6 parameters, got 2"));
    arguments.insert(arguments.end(), {"--orders", "0,1"});
    const ProgramRun enough = frf("two.csv", arguments);
    EXPECT_EQ(enough.code, 0) << enough.err;
    EXPECT_THAT(enough.err, Not(HasSubstr("excites")));
    EXPECT_EQ(result()["excitation"]["frequencies"], 2);
  }
}

// ------------------------------------------------------------------------------------------------ flags and mistakes

TEST_F(FrfCommand, TellsOfBreakPointsOutsideTheBand) {
  write_response("welsh.csv", problems::welsh_goodwin().data);
  const ProgramRun partly = frf(
      "welsh.csv", table({"--orders", "17,18", "--break-points", "1e-5:1e6:18", "--method", "ls", "--no-relocate"}));
  EXPECT_EQ(partly.code, 0);
  EXPECT_THAT(partly.err, HasSubstr("break points lie outside the band"));
  EXPECT_THAT(partly.err, HasSubstr("digits are lost"));
  EXPECT_TRUE(result()["flags"]["break_points_outside_band"].get<bool>());
  const ProgramRun moved = frf("welsh.csv", table({"--orders", "17,18", "--break-points", "1e-5:1e6"}));
  EXPECT_TRUE(result()["flags"]["relocated"].get<bool>());
  EXPECT_THAT(moved.err, HasSubstr("relocated"));
  EXPECT_LT(result()["largest_db"].get<double>(), 1e-10);
  expect_refused(table({"--orders", "17,18", "--break-points", "1e6:1e8"}),
                 "outside the band of the data, 0.0001 to 100000");
}

TEST_F(FrfCommand, FlagsUnstableAndUndeterminedModels) {
  FrequencyResponse g;
  g.omega_rad_s = Eigen::VectorXd::LinSpaced(30, 0.1, 10.0);
  g.response = (Complex(0.0, 1.0) * g.omega_rad_s.array() - 1.0).inverse();
  write_response("unstable.csv", g);
  const ProgramRun unstable = frf("unstable.csv", table({"--orders", "0,1"}));
  EXPECT_EQ(unstable.code, 0);
  EXPECT_THAT(unstable.err, HasSubstr("the model is unstable"));
  EXPECT_FALSE(result()["stable"].get<bool>());
  EXPECT_NEAR(poles_of(result()).front().real(), 1.0, 1e-9);
  const ProgramRun many = frf("unstable.csv", table({"--orders", "4,5", "--method", "ls"}));
  EXPECT_EQ(many.code, 0);
  EXPECT_THAT(many.err, HasSubstr("do not determine all parameters"));
  EXPECT_LT(result()["rank"].get<int>(), 10);
}

TEST_F(FrfCommand, RefusesBadData) {
  write_response("few.csv", problems::resonant_decades(2).data);
  expect_refused(table({"--orders", "8,10"}), "at least 10 tones of weight above zero for 19 parameters, got 8",
                 "few.csv");
  FrequencyResponse falling = problems::resonant_decades(2).data;
  std::swap(falling.omega_rad_s[2], falling.omega_rad_s[3]);
  write_response("falling.csv", falling);
  expect_refused(table({"--orders", "1,2"}), "frequency at index 3", "falling.csv");
  expect_refused(table({"--orders", "1,2"}), "no such file", "nowhere.csv");
}

TEST_F(FrfCommand, RefusesBadOptions) {
  write_response("welsh.csv", problems::welsh_goodwin().data);
  const Arguments orders = {"--orders", "3,4"};
  const auto with = [&](Arguments more) {
    more.insert(more.begin(), orders.begin(), orders.end());
    return table(more);
  };
  expect_refused(table({"--orders", "5,4"}), "expected NB,NA with 0 <= NB <= NA");
  expect_refused(table({}), "--orders");
  expect_refused({"--orders", "3,4"}, "expected --frequency NAME for a table");
  expect_refused({"--orders", "3,4", "--frequency", "w"}, "in 0 forms");
  expect_refused({"--orders", "3,4", "--real", "re"}, "--frequency");
  expect_refused(with({"--input", "re"}), "--input: does not belong to a table");
  expect_refused(with({"--rate", "10"}), "--rate: does not belong to a table without -o");
  expect_refused(with({"-o", "m.json"}), "expected --rate HZ or --sample-time S");
  expect_refused(with({"-o", "m.json", "--sample-time", "-1"}), "--sample-time: expected a positive number");
  expect_refused(with({"--basis", "magic"}), "flbf");
  expect_refused(with({"--method", "magic"}), "ls");
  expect_refused(with({"--weighting", "deviation"}), "the data have no standard deviations");
  expect_refused(with({"--basis", "monomial", "--break-points", "1:2"}), "does not belong to --basis monomial");
  expect_refused(with({"--basis", "kautz", "--no-relocate"}), "does not belong to --basis kautz");
  expect_refused(with({"--point", "3"}), "--point: does not belong to --basis flbf");
  expect_refused(with({"--basis", "laguerre", "--point", "3,4"}), "at most 1 numbers");
  expect_refused(with({"--break-points", "1:x"}), "expected two frequencies");
  expect_refused(with({"--break-points", "5"}), "expected LO:HI");
  expect_refused(with({"--break-points", "1:10:7"}), "has 4 break points, got 7");
  expect_refused(with({"--band", "10"}), "expected LO:HI");
  expect_refused(with({"--band", "1e7:1e8"}), "no tone lies within");
  expect_refused(with({"--hold", "none"}), "--hold none: expected one of zoh");
  expect_refused({"--orders", "3,4", "--input", "re"}, "--output");
  expect_refused({"--orders", "3,4", "--input", "re", "--output", "im"}, "sample time");
  expect_refused({"--orders", "3,4", "--input", "re", "--output", "im", "--rate", "1", "--transient-periods", "2"},
                 "expected --period N");
  expect_refused({"--orders", "3,4", "--input", "re", "--output", "im", "--rate", "1", "--hold", "spline3"},
                 "a record is read with zoh, foh or band_limited");
}

TEST_F(FrfCommand, FilesThatCannotBeWrittenAreCode3) {
  write_response("welsh.csv", problems::welsh_goodwin().data);
  const ProgramRun run = frf("welsh.csv", table({"--orders", "3,4", "--report", "/nowhere/frf.html"}));
  EXPECT_EQ(run.code, 3);
}

TEST_F(FrfCommand, TheReportHasItsPictures) {
  const problems::ResonantProblem problem = problems::resonant_decades(4);
  write_response("four.csv", problem.data);
  const ProgramRun run = frf("four.csv", table({"--orders", "7,8", "--report", "frf.html", "--quiet"}));
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  const std::string page = read_file(folder_ / "frf.html");
  for (const char* id : {"bode-G", "pole-zero-G", "frf-difference"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\"")) << id;
  }
  EXPECT_THAT(page, HasSubstr("natural frequency [Hz]"));
  // Four decades of poles on one map.
  EXPECT_THAT(page, HasSubstr("grows by one a decade"));
  const ProgramRun bare = run_program({"frf", "four.csv", "--frequency", "w", "--frequency-unit", "rad/s", "--real",
                                       "re", "--imaginary", "im", "--orders", "7,8", "--report", "bare.html"},
                                      folder_.path(), {"PATH=/nowhere"});
  EXPECT_EQ(bare.code, 0) << bare.err;
  EXPECT_THAT(bare.err, HasSubstr("gnuplot is not installed"));
  EXPECT_THAT(read_file(folder_ / "bare.html"), Not(HasSubstr("<svg")));
}

}  // namespace
}  // namespace blockid
