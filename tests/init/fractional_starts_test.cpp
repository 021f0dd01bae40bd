// Initialisers beside the split: release, classify, random starts, special cases and their combination.
#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <blockid/estimators/fit.hpp>
#include <blockid/init/combined.hpp>
#include <blockid/init/exponent_starts.hpp>
#include <blockid/init/random_starts.hpp>
#include <blockid/init/special_cases.hpp>
#include <blockid/init/split.hpp>
#include <blockid/init/starting_bla.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::simulated_record;
using Kind = RootGroup::Kind;

constexpr double kNoise = 0.02;
// For N = 3000 the deviation of the rmse is 1.3 % of the noise.
constexpr double kSuccess = 1.05;

const char* const kChain = "G1=rational(nb=2,na=2) | f=polynomial(degree=3) | G2=rational(nb=1,na=2)";

Record wh_record() { return simulated_record(testing::wiener_hammerstein(), 3000, kNoise, 5); }

FitOptions quick() {
  FitOptions options;
  options.refit.covariance = false;
  options.refit.prediction.warmup = 50;
  return options;
}

struct Named {
  const char* name;
  Initialiser initialiser;
};

class EveryInitialiser : public ::testing::TestWithParam<int> {
 protected:
  static Named named() {
    switch (GetParam()) {
      case 0:
        return {"release", release()};
      case 1:
        return {"classify", classify()};
      case 2:
        return {"random", random_starts({.starts = 24})};
      default:
        return {"fractional", fractional()};
    }
  }
};

TEST_P(EveryInitialiser, LeadsToTheNoise) {
  const FitResult result = fit(parse(kChain), wh_record(), named().initialiser, quick());
  EXPECT_LT(result.report.rmse, kSuccess * kNoise) << named().name << ": " << result.trials.front().candidate.how;
}

TEST_P(EveryInitialiser, RanksTheSameWhateverTheThreads) {
  InitialiserOptions two;
  two.threads = 2;
  const std::vector<Candidate> serial = named().initialiser(parse(kChain), wh_record(), {});
  const std::vector<Candidate> parallel = named().initialiser(parse(kChain), wh_record(), two);
  ASSERT_EQ(serial.size(), parallel.size());
  ASSERT_FALSE(serial.empty());
  for (std::size_t k = 0; k < serial.size(); ++k) {
    EXPECT_EQ(serial[k].how, parallel[k].how);
    EXPECT_EQ(serial[k].model.parameters, parallel[k].model.parameters);
    EXPECT_LE(serial[k == 0 ? 0 : k - 1].rmse, serial[k].rmse);
  }
}

TEST_P(EveryInitialiser, StopsWhenCancelled) {
  InitialiserOptions options;
  int calls = 0;
  options.progress = [&calls](const Progress&) { return ++calls < 2; };
  named().initialiser(parse(kChain), wh_record(), options);
  // At most one more call for each of the combined initialisers.
  EXPECT_LE(calls, 6);
}

INSTANTIATE_TEST_SUITE_P(All, EveryInitialiser, ::testing::Range(0, 4));

// Two real poles near each other, one in each filter, which the linear model of a strongly nonlinear system merges.
TEST(ReleaseTest, StartsNearerThanTheSplit) {
  const Record record = wh_record();
  const std::vector<Candidate> split = exhaustive_split()(parse(kChain), record, {});
  const std::vector<Candidate> released = release()(parse(kChain), record, {});
  ASSERT_FALSE(released.empty());
  // The free expansions are fitted to the noise before they are reduced; a partition keeps the linear model's errors.
  EXPECT_LT(released.front().rmse, 0.5 * split.front().rmse);
}

TEST(ReleaseTest, EvenNonlinearity) {
  Model truth = testing::wiener_hammerstein();
  // c0 + c2 T2: even, so that the best linear approximation vanishes.
  truth.parameters.segment(5, 4) = Eigen::Vector4d(0.5, 0.0, 3.0, 0.0);
  const Record record = simulated_record(truth, 5000, kNoise, 8);
  const StartingBla start = starting_bla(record, {3, 4, 0}, {});
  EXPECT_TRUE(start.squared);
  EXPECT_FALSE(starting_bla(wh_record(), {3, 4, 0}, {}).squared);
  EXPECT_TRUE(classify()(parse(kChain), record, {}).empty());
  const FitResult result = fit(parse(kChain), record, fractional({.release = {.starts = 8}}), quick());
  EXPECT_LT(result.report.rmse, kSuccess * kNoise);
  EXPECT_THAT(result.trials.front().candidate.how, HasSubstr("u^2"));
}

TEST(ReleaseTest, WienerAndHammersteinChains) {
  for (const Model& truth : {testing::wiener(), testing::hammerstein()}) {
    const Record record = simulated_record(truth, 3000, kNoise, 9);
    FitOptions options = quick();
    const FitResult result = fit(truth.chain, record, release(), options);
    EXPECT_LT(result.report.rmse, kSuccess * kNoise);
    EXPECT_LT(fit(truth.chain, record, fractional(), options).report.rmse, kSuccess * kNoise);
  }
}

TEST(ExponentStartsTest, HalvesFirstThenCornersOutsideZerosWhole) {
  const ExpandableRoots roots = expandable_roots({{Kind::real, 0.8}, {Kind::pair, {0.0, 2.0}}},
                                                 {{Kind::real, 0.3}, {Kind::real, -1.5}, {Kind::infinite}});
  EXPECT_EQ(roots.infinite, 1);
  EXPECT_NEAR(std::abs(roots.finite.poles[1]), 0.5, 1e-15) << "reflected";
  const std::vector<ExponentStart> starts = exponent_starts(roots, 40, 3);
  ASSERT_EQ(starts.size(), 40u);
  EXPECT_EQ(starts[0].exponents, Eigen::Vector4d(0.5, 0.5, 0.5, 1.0));
  EXPECT_EQ(starts[1].exponents, Eigen::Vector4d(0.5, 0.5, 0.5, 0.0));
  for (std::size_t k = 2; k < starts.size(); ++k) {
    for (Index i = 0; i < 3; ++i) EXPECT_NEAR(std::abs(starts[k].exponents[i] - 0.5), 0.4, 1e-15);
    EXPECT_NEAR(std::abs(starts[k].exponents[3] - 0.5), 0.5, 1e-15);
  }
  EXPECT_EQ(exponent_starts(roots, 40, 3)[17].text, starts[17].text);
  const bool varied = std::any_of(starts.begin() + 3, starts.end(),
                                  [&](const ExponentStart& s) { return s.exponents != starts[2].exponents; });
  EXPECT_TRUE(varied);
}

TEST(ExponentStartsTest, NoStartTwiceWhereAllRootsCanBeHalved) {
  const ExpandableRoots roots = expandable_roots({{Kind::real, 0.8}}, {{Kind::real, 0.3}});
  const std::vector<ExponentStart> starts = exponent_starts(roots, 2, 3);
  EXPECT_EQ(starts[0].exponents, Eigen::Vector2d(0.5, 0.5));
  for (Index i = 0; i < 2; ++i) EXPECT_NEAR(std::abs(starts[1].exponents[i] - 0.5), 0.4, 1e-15);
}

TEST(SpecialCasesTest, OneFilterHoldsAllDynamics) {
  const std::vector<Candidate> both = wiener_and_hammerstein()(parse(kChain), wh_record(), {});
  ASSERT_EQ(both.size(), 2u);
  for (const Candidate& candidate : both) {
    const bool wiener = candidate.how.starts_with("Wiener");
    const std::vector<ChildParameters> parts = top_level_blocks(candidate.model);
    const Eigen::VectorXd& trivial = parts[wiener ? 2 : 0].parameters;
    EXPECT_GT(std::abs(trivial[0]), 0.0);
    EXPECT_TRUE(trivial.tail(trivial.size() - 1).isZero(0.0)) << candidate.how;
  }
  EXPECT_TRUE(wiener_and_hammerstein()(testing::wiener().chain, wh_record(), {}).empty());
}

TEST(RandomStartsTest, SeedsAreReproducibleAndDiffer) {
  InitialiserOptions first;
  InitialiserOptions second;
  second.seed = 2;
  const auto best = [](const InitialiserOptions& options) {
    return random_starts()(parse(kChain), wh_record(), options).front().model.parameters;
  };
  EXPECT_EQ(best(first), best(first));
  EXPECT_NE(best(first), best(second));
}

TEST(CombinedTest, MergesByError) {
  const std::vector<Candidate> a = exhaustive_split()(parse(kChain), wh_record(), {});
  const std::vector<Candidate> b = random_starts()(parse(kChain), wh_record(), {});
  const std::vector<Candidate> both = combined({exhaustive_split(), random_starts()})(parse(kChain), wh_record(), {});
  EXPECT_EQ(both.size(), a.size() + b.size());
  EXPECT_EQ(both.front().rmse, std::min(a.front().rmse, b.front().rmse));
}

TEST(CombinedTest, EachModelOnce) {
  const std::vector<Candidate> once = exhaustive_split()(parse(kChain), wh_record(), {});
  const std::vector<Candidate> both =
      combined({exhaustive_split(), exhaustive_split()})(parse(kChain), wh_record(), {});
  EXPECT_EQ(both.size(), once.size());
}

TEST(InitialiserErrorsTest, SayWhatWasExpected) {
  const Record record = wh_record();
  EXPECT_THAT(BLOCKID_MESSAGE(release({.starts = 0})(parse(kChain), record, {})), HasSubstr("starts"));
  EXPECT_THAT(BLOCKID_MESSAGE(classify({.neighbours = 0})(parse(kChain), record, {})), HasSubstr("neighbours"));
  EXPECT_THAT(BLOCKID_MESSAGE(random_starts({.radius = 1.0})(parse(kChain), record, {})), HasSubstr("radius"));
  EXPECT_THAT(BLOCKID_MESSAGE(classify()(testing::wiener().chain, record, {})), HasSubstr("two filters"));
  EXPECT_THAT(BLOCKID_MESSAGE(fractional()(parse("fir(nb=2) | saturation"), record, {})),
              HasSubstr("rational | static block | rational"));
}

}  // namespace
}  // namespace blockid
