// Closed-loop validation on the command line.
#include "cli/program.hpp"
#include "support/temp_dir.hpp"

#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/cli/transfer_function.hpp>
#include <blockid/data/atomic_file.hpp>
#include <blockid/data/csv.hpp>
#include <blockid/data/error.hpp>
#include <blockid/problems/crowder_callafon.hpp>
#include <blockid/validation/coprime_factors.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace blockid {
namespace {

using Eigen::VectorXd;
using nlohmann::json;
using problems::CrowderCallafon;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::json_file;
using testing::ProgramRun;
using testing::run_program;
using testing::TempDir;
using ::testing::ThrowsMessage;

constexpr Index kQuiet = 100;
constexpr Index kSamples = 160;

DiscreteTransferFunction system_of(const problems::Polynomials& g) { return {g.numerator, g.denominator}; }

/// "b0,b1 / a0,a1" with all digits.
std::string text_of(const problems::Polynomials& g) {
  const auto list = [](const VectorXd& p) {
    std::string text;
    for (const double c : p) text += (text.empty() ? "" : ",") + compose(c);
    return text;
  };
  return list(g.numerator) + " / " + list(g.denominator);
}

class ClosedLoopCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    // 100 samples without a reference and, from rest again, 160 with one.
    const VectorXd d = 1e-3 * problems::crowder_reference(kQuiet + kSamples, 7).cwiseMin(2.0).cwiseMax(-2.0);
    const ClosedLoopRecord quiet = simulate(VectorXd::Zero(kQuiet), d.head(kQuiet));
    const VectorXd r = problems::crowder_reference(kSamples);
    const ClosedLoopRecord driven = simulate(r, d.tail(kSamples));
    Table table;
    table.has_header = true;
    table.names = {"u", "y", "r"};
    table.values = Eigen::MatrixXd::Zero(kQuiet + kSamples, 3);
    table.values.col(0) << quiet.u, driven.u;
    table.values.col(1) << quiet.y, driven.y;
    table.values.col(2).tail(kSamples) = r;
    write_file_atomically(folder_ / "loop.csv", to_csv(table));
    table.values.col(0) = table.values.col(0).cwiseMin(0.5).cwiseMax(-0.5);
    write_file_atomically(folder_ / "saturated.csv", to_csv(table));
  }

  ClosedLoopRecord simulate(const VectorXd& r, const VectorXd& d) const {
    return simulate_closed_loop(system_of(loop_.plant()), system_of(loop_.controller()), r, d);
  }

  /// u, y, r of another reference and disturbance, from rest, with the noise `scale` times as large.
  void write_experiment(const std::string& name, Index samples, std::uint32_t seed, double scale) const {
    const VectorXd d = scale * 1e-3 * problems::crowder_reference(samples, seed + 100).cwiseMin(2.0).cwiseMax(-2.0);
    const VectorXd r = problems::crowder_reference(samples, seed);
    const ClosedLoopRecord record = simulate(r, d);
    Table table;
    table.has_header = true;
    table.names = {"u", "y", "r"};
    table.values.resize(samples, 3);
    table.values << record.u, record.y, r;
    write_file_atomically(folder_ / name, to_csv(table));
  }

  ProgramRun run(const std::vector<std::string>& more, double k = CrowderCallafon::kCovers,
                 const std::string& file = "loop.csv", const std::string& plant = "") const {
    return run_on({file}, more, k, plant);
  }

  ProgramRun run_on(const std::vector<std::string>& files, const std::vector<std::string>& more,
                    double k = CrowderCallafon::kCovers, const std::string& plant = "") const {
    std::vector<std::string> arguments = {"closed-loop",
                                          "--input",
                                          "u",
                                          "--output",
                                          "y",
                                          "--sample-time",
                                          "0.1",
                                          "--plant",
                                          plant.empty() ? text_of(loop_.model()) : plant,
                                          "--controller",
                                          text_of(loop_.controller()),
                                          "--weight",
                                          text_of(loop_.weight(k)),
                                          "--factor-pole",
                                          compose(loop_.pole())};
    arguments.insert(arguments.begin() + 1, files.begin(), files.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments, folder_.path());
  }

  CrowderCallafon loop_;
  TempDir folder_;
};

TEST_F(ClosedLoopCommand, LargeEnoughWeightIsNotInvalidated) {
  const ProgramRun result = run({"--range", "100:", "--quiet-run", "0:100", "--reference", "r", "--json", "v.json"});
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("verdict     not invalidated"));
  const json outcome = json_file(folder_ / "v.json");
  EXPECT_EQ(outcome["verdict"], "not invalidated");
  EXPECT_GT(outcome["noise_bound"].get<double>(), 0.0);
  EXPECT_LE(outcome["whole"]["noise_needed"].get<double>(), outcome["noise_bound"].get<double>());
  const ProgramRun doubled = run({"--range", "100:", "--quiet-run", "0:100", "--reference", "2*r", "--quiet"});
  EXPECT_THAT(doubled.err, HasSubstr("u differs from r - C y"));
  // The file holds 17 digits, the texts of the systems 10.
  EXPECT_LT(outcome["reference_check"]["error"].get<double>(), 1e-8);
}

TEST_F(ClosedLoopCommand, TooSmallWeightIsInvalidated) {
  const ProgramRun result =
      run({"--range", "100:", "--quiet-run", "0:100", "--json", "v.json"}, 0.5 * CrowderCallafon::kTight);
  EXPECT_EQ(result.code, 5) << result.out << result.err;
  const json outcome = json_file(folder_ / "v.json");
  EXPECT_EQ(outcome["verdict"], "invalidated");
  EXPECT_GT(outcome["whole"]["noise_proven"].get<double>(), outcome["noise_bound"].get<double>());
}

// The weight is large enough. Windows with three samples of past do not show it, and prove nothing against it either.
TEST_F(ClosedLoopCommand, WindowsWithTooShortAPastAreUndecided) {
  const std::vector<std::string> test = {"--range", "100:", "--quiet-run", "0:100",  "--window", "40",
                                         "--step",  "40",   "--json",      "v.json", "--past"};
  std::vector<std::string> all = test;
  all.emplace_back("120");
  EXPECT_EQ(run(all).code, 0);
  std::vector<std::string> three = test;
  three.emplace_back("3");
  const ProgramRun result = run(three);
  EXPECT_EQ(result.code, 6) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("verdict     undecided"));
  EXPECT_THAT(result.err, HasSubstr("shorter than the memory of the uncertainty"));
  const json outcome = json_file(folder_ / "v.json");
  EXPECT_EQ(outcome["verdict"], "undecided");
  EXPECT_EQ(outcome["windows"][0]["window"]["verdict"], "not invalidated") << "this one starts at rest";
  int undecided = 0;
  for (const json& window : outcome["windows"]) {
    undecided += window["window"]["verdict"] == "undecided" ? 1 : 0;
    EXPECT_NE(window["window"]["verdict"], "invalidated");
    EXPECT_EQ(window["record"]["verdict"], "not invalidated");
  }
  EXPECT_GE(undecided, 1);
}

// Two iterations leave the least noise between bounds that lie on both sides of the noise bound.
TEST_F(ClosedLoopCommand, TooFewIterationsAreUndecided) {
  const auto after = [&](const std::string& iterations) {
    return run({"--range", "100:", "--quiet-run", "0:100", "--max-iterations", iterations, "--json", "v.json"},
               0.5 * CrowderCallafon::kTight);
  };
  const ProgramRun result = after("2");
  EXPECT_EQ(result.code, 6) << result.out << result.err;
  const json outcome = json_file(folder_ / "v.json");
  const double bound = outcome["noise_bound"].get<double>();
  EXPECT_LE(outcome["whole"]["noise_proven"].get<double>(), bound);
  EXPECT_GT(outcome["whole"]["noise_needed"].get<double>(), bound);
  EXPECT_THAT(outcome["evidence"].get<std::string>(), HasSubstr("is not settled by that"));
  EXPECT_EQ(after("100").code, 5);
}

TEST_F(ClosedLoopCommand, WindowsCurveAndBandsWithPictures) {
  const ProgramRun result = run({"--range", "100:", "--quiet-run", "0:100", "--window", "40", "--step", "40", "--curve",
                                 "--bands", "4", "--json", "v.json", "--report", "v.html"});
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  const json outcome = json_file(folder_ / "v.json");
  ASSERT_EQ(outcome["windows"].size(), 4U);
  EXPECT_EQ(outcome["windows"][3]["first"], 120);
  EXPECT_EQ(outcome["windows"][3]["past"], 120);
  EXPECT_EQ(outcome["curve"]["points"].size(), 12U);
  ASSERT_EQ(outcome["bands"].size(), 4U);
  const std::string page = read_file(folder_ / "v.html");
  for (const char* id : {"signals", "windows", "curve", "bands"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\">"));
  }
  if (result.err.find("gnuplot is not installed") == std::string::npos) {
    EXPECT_EQ(testing::occurrences(page, "<svg"), 4) << result.err;
  }
}

TEST_F(ClosedLoopCommand, SaturationShowsInTheReference) {
  const ProgramRun result =
      run({"--range", "100:", "--gamma", "0.1", "--reference", "r"}, CrowderCallafon::kCovers, "saturated.csv");
  EXPECT_THAT(result.err, HasSubstr("u differs from r - C y"));
  EXPECT_THAT(result.out, HasSubstr("behind the first sample to within"));
}

// A noise bound below the noise contradicts every set; the program says what to suspect, and that none was given.
TEST_F(ClosedLoopCommand, NoiseBoundBelowTheNoiseIsAWarning) {
  const ProgramRun result = run({"--range", "100:", "--gamma", "0.0001"});
  EXPECT_EQ(result.code, 5) << result.out;
  EXPECT_THAT(result.err, HasSubstr("does not explain the record either: suspect the noise bound"));
  const ProgramRun none = run({"--range", "100:"});
  EXPECT_THAT(none.err, HasSubstr("The noise bound of 0 was raised to"));
  EXPECT_THAT(none.out, HasSubstr("none was given: w is taken as exact"));
}

TEST_F(ClosedLoopCommand, PlantFromAModelFile) {
  Model model = make_model(parse("G=rational(nb=0,na=1,nk=1)"), loop_.sample_time_s);
  model.parameters << loop_.model().numerator[1], loop_.model().denominator[1];
  write_file_atomically(folder_ / "plant.json", to_json(model));
  const std::vector<std::string> more = {"--range", "100:", "--gamma", "0.001", "--json"};
  std::vector<std::string> text = more;
  text.emplace_back("text.json");
  std::vector<std::string> file = more;
  file.emplace_back("file.json");
  EXPECT_EQ(run(text).code, run(file, CrowderCallafon::kCovers, "loop.csv", "plant.json").code);
  // Ten digits of the text.
  EXPECT_NEAR(json_file(folder_ / "file.json")["largest_w"].get<double>(),
              json_file(folder_ / "text.json")["largest_w"].get<double>(), 1e-8);
}

class SeveralExperiments : public ClosedLoopCommand {
 protected:
  void SetUp() override {
    ClosedLoopCommand::SetUp();
    write_experiment("one.csv", 120, 11, 1.0);
    write_experiment("two.csv", 90, 12, 10.0);
    write_experiment("three.csv", 60, 13, 1.0);
  }

  json outcome_of(const std::vector<std::string>& files, std::vector<std::string> more, int code,
                  double k = CrowderCallafon::kCovers) const {
    more.insert(more.end(), {"--json", "v.json"});
    const ProgramRun result = run_on(files, more, k);
    EXPECT_EQ(result.code, code) << result.out << result.err;
    return json_file(folder_ / "v.json");
  }
};

TEST_F(SeveralExperiments, EachHasItsNoiseBound) {
  const json both = outcome_of({"one.csv", "two.csv"}, {"--gamma", "0.005", "--gamma", "0.05", "--reference", "r"}, 0);
  ASSERT_EQ(both["experiments"].size(), 2U);
  EXPECT_EQ(both["data"], "one.csv, two.csv");
  const std::vector<double> bounds = {0.005, 0.05};
  for (std::size_t i = 0; i < 2; ++i) {
    const json& one = both["experiments"][i];
    EXPECT_EQ(one["noise_bound"], bounds[i]);
    EXPECT_EQ(one["samples"], i == 0 ? 120 : 90);
    EXPECT_LE(one["noise_left"].get<double>(), bounds[i]);
    EXPECT_LT(one["reference_check"]["error"].get<double>(), 1e-8);
  }
  // The largest is the unit of the others: what is needed of it is what the worst of the experiments needs of its own.
  EXPECT_EQ(both["noise_bound"], 0.05);
  const double shares = std::max(both["experiments"][0]["noise_left"].get<double>() / 0.005,
                                 both["experiments"][1]["noise_left"].get<double>() / 0.05);
  EXPECT_NEAR(both["whole"]["noise_needed"].get<double>() / 0.05, shares, 1e-9);
  const ProgramRun text = run_on({"one.csv", "two.csv"}, {"--gamma", "0.005,0.05"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("2 experiments, sampled every 0.1 s"), HasSubstr("one.csv, samples 0:120"),
                              HasSubstr("two.csv, samples 0:90"), HasSubstr("noise       0.005, as given"),
                              HasSubstr("noise       0.05, as given"), HasSubstr("left        "),
                              HasSubstr("smaller noise bound, the noise is less in proportion")));
}

// The same record twice says what it says once; another one says more: gamma*(1) rises, never falls.
TEST_F(SeveralExperiments, OneDeltaIsAskedToExplainThemAll) {
  const double k = 0.5 * CrowderCallafon::kTight;
  const auto proven = [&](const std::vector<std::string>& files) {
    return outcome_of(files, {"--gamma", "0.001", "--curve"}, 5, k)["curve"]["least_noise"].get<double>();
  };
  const double one = proven({"one.csv"});
  EXPECT_NEAR(proven({"one.csv", "one.csv"}), one, 1e-6 * one);
  EXPECT_GE(proven({"one.csv", "three.csv"}), one * (1.0 - 1e-6));
  EXPECT_GE(proven({"three.csv", "one.csv"}), one * (1.0 - 1e-6));
}

// A noise bound that is true of the quiet experiment and false of the loud one, and the other way round.
TEST_F(SeveralExperiments, BoundsBelongToTheirExperiment) {
  const double k = CrowderCallafon::kCovers;
  outcome_of({"one.csv", "two.csv"}, {"--gamma", "0.005,0.05"}, 0, k);
  outcome_of({"two.csv", "one.csv"}, {"--gamma", "0.05,0.005"}, 0, k);
  outcome_of({"two.csv", "one.csv"}, {"--gamma", "0.005,0.05"}, 5, k);
  // One for all.
  EXPECT_EQ(outcome_of({"one.csv", "two.csv"}, {"--gamma", "0.05"}, 0, k)["experiments"][0]["noise_bound"], 0.05);
}

TEST_F(SeveralExperiments, RangesOfOneFile) {
  const json outcome = outcome_of(
      {"loop.csv"}, {"--range", "100:260", "--range", "100:180", "--quiet-run", "0:100", "--reference", "r"}, 0);
  ASSERT_EQ(outcome["experiments"].size(), 2U);
  EXPECT_EQ(outcome["experiments"][0]["range"], "100:260");
  EXPECT_EQ(outcome["experiments"][1]["range"], "100:180");
  EXPECT_EQ(outcome["experiments"][0]["noise_bound"], outcome["experiments"][1]["noise_bound"]);
  const json alone = outcome_of({"loop.csv"}, {"--range", "100:260", "--quiet-run", "0:100"}, 0);
  EXPECT_EQ(alone["noise_bound"], outcome["noise_bound"]);
  EXPECT_EQ(alone["experiments"].size(), 1U);
}

TEST_F(SeveralExperiments, WindowsBandsAndPicturesOfEach) {
  const json outcome =
      outcome_of({"one.csv", "three.csv"},
                 {"--gamma", "0.005", "--window", "30", "--step", "30", "--bands", "3", "--report", "v.html"}, 0);
  ASSERT_EQ(outcome["windows"].size(), 6U);
  EXPECT_EQ(outcome["windows"][3]["experiment"], 0);
  EXPECT_EQ(outcome["windows"][4]["experiment"], 1);
  EXPECT_EQ(outcome["windows"][4]["first"], 0);
  EXPECT_EQ(outcome["windows"][5]["first"], 30);
  EXPECT_TRUE(outcome["experiments"][0]["noise_left"].is_null());
  ASSERT_EQ(outcome["bands"].size(), 6U);
  EXPECT_EQ(outcome["bands"][5]["experiment"], 1);
  const std::string page = read_file(folder_ / "v.html");
  for (const char* id : {"signals", "signals-2", "windows", "windows-2", "bands", "bands-2"}) {
    EXPECT_THAT(page, HasSubstr("<figure id=\"" + std::string(id) + "\">"));
  }
}

TEST_F(SeveralExperiments, CountsThatDoNotFitAreRefused) {
  const auto error = [&](const std::vector<std::string>& files, const std::vector<std::string>& more) {
    const ProgramRun result = run_on(files, more);
    EXPECT_EQ(result.code, 1) << result.out;
    return result.err;
  };
  const std::vector<std::string> two = {"one.csv", "two.csv"};
  EXPECT_THAT(error(two, {"--gamma", "0.1,0.2,0.3"}),
              HasSubstr("--gamma: expected one for all experiments, or one for each of the 2 experiments, got 3"));
  EXPECT_THAT(error({"one.csv"}, {"--gamma", "0.1", "--gamma", "0.2"}),
              HasSubstr("expected one for the one experiment, got 2"));
  EXPECT_THAT(error(two, {"--range", "0:50", "--range", "0:60", "--range", "0:70"}), HasSubstr("--range: expected"));
  EXPECT_THAT(error({"one.csv", "two.csv", "three.csv"}, {"--quiet-run", "0:9", "--quiet-run", "0:9"}),
              HasSubstr("--quiet-run: expected one for all experiments, or one for each of the 3 experiments, got 2"));
  EXPECT_THAT(error(two, {"--gamma", "0.1,0"}), HasSubstr("two.csv, samples 0:90: expected a noise bound above 0"));
  EXPECT_THAT(error(two, {"--range", "0:100"}), HasSubstr("two.csv: --range 0:100"));
  EXPECT_THAT(error({"one.csv", "absent.csv"}, {}), HasSubstr("absent.csv"));
  const ProgramRun negative = run_on(two, {"--gamma", "-0.1"});
  EXPECT_NE(negative.code, 0);
  EXPECT_THAT(negative.err, HasSubstr("--gamma"));
}

TEST_F(ClosedLoopCommand, BadInputIsRefused) {
  const auto error = [&](const std::vector<std::string>& more, double k = CrowderCallafon::kCovers,
                         const std::string& plant = "") {
    const ProgramRun result = run(more, k, "loop.csv", plant);
    EXPECT_EQ(result.code, 1) << result.err;
    return result.err;
  };
  EXPECT_THAT(error({}, CrowderCallafon::kCovers, "0,-5 / 1,-1.2"), HasSubstr("stabilise"));
  EXPECT_THAT(error({}, CrowderCallafon::kCovers, "one / two"),
              HasSubstr("expected FILE.json or coefficients of q^-1"));
  EXPECT_THAT(error({}, CrowderCallafon::kCovers, "1 / 0,1"), HasSubstr("expected a0 other than 0"));
  EXPECT_THAT(error({}, 0.0), HasSubstr("biproper"));
  EXPECT_THAT(error({"--range", "0:9999"}), HasSubstr("--range 0:9999"));
  EXPECT_THAT(error({"--quiet-run", "100:200"}), HasSubstr("reference"));
  EXPECT_THAT(error({"--longest", "100"}), HasSubstr("more than --longest 100 in one test"));
  EXPECT_THAT(error({"--window", "40", "--longest", "30"}), HasSubstr("within 30 samples"));
  EXPECT_THAT(error({"--reference", "absent"}), HasSubstr("absent"));
  EXPECT_THAT(error({"--reference", "two*r"}), HasSubstr("expected NAME or GAIN*NAME"));
}

TEST_F(ClosedLoopCommand, NothingThatExcitesTheLoop) {
  Table table;
  table.has_header = true;
  table.names = {"u", "y"};
  table.values = Eigen::MatrixXd::Constant(50, 2, 0.25);
  write_file_atomically(folder_ / "still.csv", to_csv(table));
  const ProgramRun result = run({"--rest", "10"}, CrowderCallafon::kCovers, "still.csv");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.err, HasSubstr("the signal v is zero"));
}

TEST(TransferFunction, RowsOfLinearBlocks) {
  Model model = make_model(parse("K=gain() | D=delay(samples=2) | G=rational(nb=1,na=1)"));
  model.parameters << 2.0, 1.0, 0.5, -0.9;
  const DiscreteTransferFunction g = cli::transfer_function(model);
  EXPECT_EQ(cli::to_text(g), "(2 q^-2 + 1 q^-3) / (1 - 0.9 q^-1)");
  const VectorXd u = problems::crowder_reference(30);
  EXPECT_LT((filter(g, u) - simulate(model, u)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(cli::magnitude(g, 0.0), 30.0, 1e-12);
  EXPECT_THAT([] { static_cast<void>(cli::transfer_function(make_model(parse("f=saturation()")))); },
              ThrowsMessage<Error>(HasSubstr("expected a row of gain, delay, fir, rational and biquads")));
  EXPECT_THAT([] { static_cast<void>(cli::transfer_function(make_model(parse("[gain() + gain()]")))); },
              ThrowsMessage<Error>(HasSubstr("a sum of branches")));
}

}  // namespace
}  // namespace blockid
