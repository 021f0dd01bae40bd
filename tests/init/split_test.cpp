#include <blockid/init/split.hpp>

#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <blockid/estimators/fit.hpp>
#include <blockid/estimators/gauges.hpp>
#include <blockid/estimators/static_parameters.hpp>
#include <blockid/init/wh_structure.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::model_of;
using testing::simulated_record;

constexpr double kNoise = 0.02;
// A fit has found the system when its rmse is within this factor of the noise: for N = 2000 the deviation of the rmse
// is 1.6 % of the noise.
constexpr double kSuccess = 1.05;

const char* const kChain = "G1=rational(nb=2,na=2) | f=polynomial(degree=3) | G2=rational(nb=1,na=2)";

// Close to linear, so that the best linear approximation shows the poles of both filters.
Model wiener_hammerstein() {
  Model model = testing::wiener_hammerstein();
  model.parameters[8] = -0.05;
  return model;
}

Record wh_record(Index samples = 2000) { return simulated_record(wiener_hammerstein(), samples, kNoise, 5); }

double rmse_of(const Model& model, const Record& record, const PredictionOptions& options = {}) {
  const DataSet data(record);
  const Predictor predictor(model.chain, data, options);
  return std::sqrt(predictor.sum_of_squares(model.parameters) / static_cast<double>(predictor.counted_samples()));
}

TEST(StructureTest, TakesApartRowsOfThree) {
  const WienerHammersteinStructure both = wiener_hammerstein_structure(parse(kChain), "test");
  ASSERT_NE(both.g_w(), nullptr);
  ASSERT_NE(both.g_h(), nullptr);
  EXPECT_EQ(both.g_w()->nb(), 2);
  EXPECT_EQ(both.g_h()->nb(), 1);
  EXPECT_EQ(both.static_block, 1u);
  const WienerHammersteinStructure wiener =
      wiener_hammerstein_structure(parse("rational(nb=1,na=1) | saturation"), "t");
  EXPECT_NE(wiener.g_w(), nullptr);
  EXPECT_EQ(wiener.g_h(), nullptr);
  const WienerHammersteinStructure alone = wiener_hammerstein_structure(parse("saturation").children()[0].block, "t");
  EXPECT_EQ(alone.g_w(), nullptr);
  EXPECT_EQ(alone.static_block, 0u);
}

TEST(StructureTest, OtherChainsAreNamed) {
  const auto message = [](const char* text) {
    return BLOCKID_MESSAGE(exhaustive_split()(parse(text), wh_record(100), {}));
  };
  for (const char* text : {"rational(nb=1,na=1)", "fir(nb=2) | saturation", "saturation | dead_zone",
                           "rational(nb=1,na=1) | rational(nb=1,na=1) | saturation",
                           "rational(nb=1,na=1) | saturation | rational(nb=1,na=1) | rational(nb=1,na=1)"}) {
    EXPECT_THAT(message(text), AllOf(HasSubstr("exhaustive_split"), HasSubstr("rational | static block | rational")))
        << text;
  }
  EXPECT_THAT(message("fir(nb=2) | saturation"), HasSubstr("'fir'"));
  EXPECT_THAT(BLOCKID_MESSAGE(exhaustive_split({.keep = 0})(parse(kChain), wh_record(100), {})), HasSubstr("keep"));
}

TEST(SplitTest, RanksEveryPartition) {
  const Record record = wh_record();
  const std::vector<Candidate> candidates = exhaustive_split({.keep = 1000})(parse(kChain), record, {});
  // Poles of the truth: one pair and two real ones, two of four degrees to each filter: the pair here or there.
  // Zeros: a pair and a real one, or three real ones: 1 or 3 ways to give two to the first.
  ASSERT_GE(candidates.size(), 2u);
  std::set<std::string> accounts;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const Candidate& candidate = candidates[k];
    EXPECT_EQ(to_text(candidate.model.chain).substr(0, 22), to_text(parse(kChain)).substr(0, 22));
    EXPECT_EQ(candidate.model.parameters.size(), 13);
    EXPECT_THAT(candidate.how, AllOf(HasSubstr("split "), HasSubstr("zeros"), HasSubstr("poles")));
    EXPECT_NEAR(candidate.rmse, rmse_of(candidate.model, record), 1e-9);
    if (k > 0) {
      EXPECT_GE(candidate.rmse, candidates[k - 1].rmse);
    }
    accounts.insert(candidate.how);
  }
  EXPECT_EQ(accounts.size(), candidates.size());
  EXPECT_LT(candidates.front().rmse, 0.5 * candidates.back().rmse);
  EXPECT_EQ(exhaustive_split({.keep = 1})(parse(kChain), record, {}).size(), 1u);
  EXPECT_EQ(exhaustive_split({.max_partitions = 1})(parse(kChain), record, {}).size(), 1u);
}

TEST(SplitTest, DoesNotDependOnTheNumberOfThreads) {
  const Record record = wh_record(800);
  for (const char* text : {kChain, "rational(nb=2,na=2) | saturation | rational(nb=1,na=2)"}) {
    InitialiserOptions options;
    const std::vector<Candidate> one = exhaustive_split()(parse(text), record, options);
    options.threads = 2;
    const std::vector<Candidate> two = exhaustive_split()(parse(text), record, options);
    ASSERT_EQ(one.size(), two.size());
    for (std::size_t k = 0; k < one.size(); ++k) {
      EXPECT_EQ(one[k].model.parameters, two[k].model.parameters);
      EXPECT_EQ(one[k].rmse, two[k].rmse);
      EXPECT_EQ(one[k].how, two[k].how);
    }
  }
}

TEST(SplitTest, BreaksAPairThatFitsNowhere) {
  // Both poles of the best linear approximation are one pair, yet each filter is to have one real pole.
  const Model truth = model_of("G=rational(nb=1,na=2) | f=polynomial(degree=3,range=[-4:4])",
                               {1.0, 0.3, -1.2, 0.52, 0.1, 2.0, 0.2, -0.3});
  const Record record = simulated_record(truth, 1000, kNoise, 6);
  const std::vector<Candidate> candidates =
      exhaustive_split()(parse("G1=rational(nb=0,na=1) | f=polynomial(degree=3) | G2=rational(nb=1,na=1)"), record, {});
  ASSERT_EQ(candidates.size(), 2u) << "two real halves, either way";
  for (const Candidate& candidate : candidates) {
    EXPECT_TRUE(std::isfinite(candidate.rmse));
    EXPECT_EQ(candidate.how.find("+-"), std::string::npos) << candidate.how;
    EXPECT_LT(std::abs(candidate.model.parameters[1]), 1.0);
  }
}

TEST(SplitTest, RankingSamplesLeaveRoomForWarmupAndPeriod) {
  const Record record = wh_record(1500);
  InitialiserOptions options;
  options.prediction.warmup = 600;
  const std::vector<Candidate> late = exhaustive_split({.ranking_samples = 500})(parse(kChain), record, options);
  EXPECT_FALSE(late.empty());
  Record periodic = record;
  for (Index t = 750; t < 1500; ++t) periodic.u[t] = periodic.u[t - 750];
  periodic.y = simulate(wiener_hammerstein(), periodic.u);
  periodic.period = 750;
  options.prediction = {InitialState::periodic, 0, 1};
  const std::vector<Candidate> steady = exhaustive_split({.ranking_samples = 500})(parse(kChain), periodic, options);
  EXPECT_FALSE(steady.empty());
}

TEST(SplitTest, StatesTheErrorOfTheModelItHandsOn) {
  // A saturation is ranked with a spline in its place; what is handed on is the saturation, with its own error.
  const Model truth =
      model_of("G1=rational(nb=0,na=1) | f=saturation | G2=rational(nb=0,na=1)", {1.0, -0.7, -0.8, 1.2, 1.0, -0.3});
  const Record record = simulated_record(truth, 1500, kNoise, 7);
  const std::vector<Candidate> candidates =
      exhaustive_split()(parse("G1=rational(nb=0,na=1) | f=saturation | G2=rational(nb=0,na=1)"), record, {});
  ASSERT_FALSE(candidates.empty());
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    EXPECT_NEAR(candidates[k].rmse, rmse_of(candidates[k].model, record), 1e-9) << candidates[k].how;
    if (k > 0) {
      EXPECT_GE(candidates[k].rmse, candidates[k - 1].rmse);
    }
  }
}

TEST(SplitTest, CanBeCancelled) {
  const Record record = wh_record(500);
  InitialiserOptions options;
  options.progress = [](const Progress& p) { return p.stage != "splits" || p.step < 1; };
  EXPECT_EQ(exhaustive_split()(parse(kChain), record, options).size(), 1u);
  options.progress = [](const Progress&) { return false; };
  EXPECT_TRUE(exhaustive_split()(parse(kChain), record, options).empty());
}

TEST(SplitTest, ReportsItsProgress) {
  std::vector<Progress> seen;
  InitialiserOptions options;
  options.progress = [&](const Progress& p) {
    if (p.stage == "splits") seen.push_back(p);
    return true;
  };
  options.threads = 2;
  exhaustive_split()(parse(kChain), wh_record(500), options);
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(std::ssize(seen), seen.front().steps);
  for (std::size_t k = 1; k < seen.size(); ++k) EXPECT_LE(seen[k].rmse, seen[k - 1].rmse);
}

TEST(FitTest, RecoversWienerAndHammersteinSystems) {
  for (const Model& truth : {testing::wiener(), testing::hammerstein()}) {
    const Record record = simulated_record(truth, 2000, kNoise, 8);
    const bool is_wiener = truth.chain.children()[0].label == "G";
    const FitResult result = fit(parse(is_wiener ? "G=rational(nb=1,na=2) | f=polynomial(degree=3)"
                                                 : "f=polynomial(degree=3) | G=rational(nb=1,na=2)"),
                                 record, exhaustive_split());
    EXPECT_EQ(result.report.status, FitStatus::converged) << result.report.message;
    EXPECT_LT(result.report.rmse, kSuccess * kNoise);
    const Model expected = normalise(truth);
    const Index first = is_wiener ? 0 : 4;
    EXPECT_LT((result.model.parameters.segment(first, 4) - expected.parameters.segment(first, 4)).norm(), 0.02);
  }
}

TEST(FitTest, ReturnsEveryTrialBestFirstAndTheBestNormalised) {
  const Record record = wh_record();
  FitOptions options;
  options.best = 3;
  const std::vector<Candidate> candidates = exhaustive_split()(parse(kChain), record, {});
  const FitResult result = fit(parse(kChain), record, exhaustive_split(), options);
  EXPECT_LT(result.report.rmse, kSuccess * kNoise);
  ASSERT_EQ(result.trials.size(), candidates.size());
  const auto refitted = std::min<std::ptrdiff_t>(3, std::ssize(candidates));
  for (std::ptrdiff_t k = 0; k < std::ssize(result.trials); ++k) {
    const Trial& trial = result.trials[static_cast<std::size_t>(k)];
    EXPECT_EQ(trial.refitted, k < refitted);
    if (k > 0 && k < refitted) {
      EXPECT_GE(trial.refit.rmse, result.trials[static_cast<std::size_t>(k) - 1].refit.rmse);
    }
    if (k >= refitted) {
      EXPECT_EQ(trial.candidate.how, candidates[static_cast<std::size_t>(k)].how);
    }
  }
  EXPECT_EQ(result.report.rmse, result.trials.front().refit.rmse);
  EXPECT_NEAR(rmse_of(result.model, record), result.report.rmse, 1e-9);
  EXPECT_EQ(normalise(result.model).parameters, result.model.parameters);
  ASSERT_TRUE(result.report.covariance.has_value());
  EXPECT_EQ(result.model.standard_deviations, result.report.covariance->standard_deviations);
  for (Index k = 0; k < 13; ++k) EXPECT_EQ(result.model.standard_deviations[k] == 0.0, k == 0 || k == 9) << k;
  EXPECT_GT(result.wall_seconds, 0.0);
}

TEST(FitTest, DoesNotDependOnTheNumberOfThreads) {
  const Record record = wh_record(800);
  FitOptions options;
  options.best = 3;
  const FitResult one = fit(parse(kChain), record, exhaustive_split(), options);
  options.threads = 2;
  const FitResult two = fit(parse(kChain), record, exhaustive_split(), options);
  EXPECT_EQ(one.model.parameters, two.model.parameters);
  EXPECT_EQ(one.report.rmse, two.report.rmse);
}

TEST(FitTest, CancelledKeepsTheBest) {
  const Record record = wh_record(1000);
  FitOptions options;
  options.progress = [](const Progress& p) {
    return p.stage.find("split") != std::string::npos || p.stage.find("best linear") != std::string::npos || p.step < 2;
  };
  const FitResult late = fit(parse(kChain), record, exhaustive_split(), options);
  EXPECT_EQ(late.report.status, FitStatus::cancelled);
  EXPECT_LE(late.report.rmse, late.trials.front().candidate.rmse);
  EXPECT_NEAR(rmse_of(late.model, record), late.report.rmse, 1e-9);

  options.progress = [](const Progress&) { return false; };
  const FitResult at_once = fit(parse(kChain), record, exhaustive_split(), options);
  EXPECT_EQ(at_once.report.status, FitStatus::cancelled);
  ASSERT_EQ(at_once.trials.size(), 1u) << "not even a candidate was found: the blocks' initial parameters";
  EXPECT_TRUE(std::isfinite(at_once.report.rmse));
}

TEST(FitTest, OtherInitialisers) {
  const Record record = wh_record(1000);
  const Model truth = wiener_hammerstein();
  const FitResult given = fit(truth.chain, record, start_from(truth));
  EXPECT_EQ(given.trials.size(), 1u);
  EXPECT_EQ(given.trials.front().candidate.how, "given model");
  EXPECT_LT(given.report.rmse, kSuccess * kNoise);
  const std::vector<Candidate> none = no_initialiser()(parse(kChain), record, {});
  ASSERT_EQ(none.size(), 1u);
  EXPECT_NEAR(none.front().rmse, rmse_of(none.front().model, record), 1e-9);
  EXPECT_THAT(BLOCKID_MESSAGE(fit(parse(kChain), record, start_from(testing::wiener()))),
              AllOf(HasSubstr("13"), HasSubstr("8")));
}

// The example of init/README.md: random poles for a single filter in front of a static block.
Initialiser random_poles(int draws) {
  return [draws](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options) {
    std::mt19937_64 engine(options.seed);
    std::vector<Candidate> found;
    for (int draw = 0; draw < draws; ++draw) {
      Model model = make_model(chain, data.records.front().sample_time_s);
      const double pole = 0x1.0p-64 * static_cast<double>(engine());
      model.parameters[parameter_index(model, "G.a1")] = -pole;
      model = adapt_structure(model, data.records.front().u);
      const StaticFit fitted = fit_static(model, data, options.prediction);
      if (fitted.finite) found.push_back({fitted.model, fitted.rmse, "pole " + std::to_string(pole)});
    }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.rmse < b.rmse; });
    return found;
  };
}

TEST(FitTest, TakesOnesOwnInitialiser) {
  const Model truth =
      model_of("G=rational(nb=0,na=1) | f=polynomial(degree=3,range=[-4:4])", {1.0, -0.7, 0.1, 2.0, 0.3, -0.4});
  const Record record = simulated_record(truth, 1000, kNoise, 9);
  const FitResult result = fit(parse("G=rational(nb=0,na=1) | f=spline(knots=8)"), record, random_poles(20));
  EXPECT_EQ(result.trials.size(), 20u);
  EXPECT_LT(result.report.rmse, kSuccess * kNoise);
  EXPECT_NEAR(result.model.parameters[1], -0.7, 0.01);
}

TEST(FitTest, MistakesAreNamed) {
  const Record record = wh_record(1000);
  FitOptions options;
  options.best = 0;
  EXPECT_THAT(BLOCKID_MESSAGE(fit(parse(kChain), record, exhaustive_split(), options)), HasSubstr("best = 0"));
  EXPECT_THAT(BLOCKID_MESSAGE(fit(parse(kChain), slice(record, 0, 12), exhaustive_split())),
              AllOf(HasSubstr("12"), HasSubstr("13")));
  Record constant = record;
  constant.u.setConstant(3.0);
  EXPECT_THAT(BLOCKID_MESSAGE(fit(parse(kChain), constant, exhaustive_split())), HasSubstr("3"));
}

}  // namespace
}  // namespace blockid
