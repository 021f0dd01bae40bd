// Structures chosen from the data.
#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/init/automatic.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <string>

namespace blockid {
namespace {

using ::testing::HasSubstr;

constexpr double kNoise = 0.02;

AutomaticOptions small() {
  AutomaticOptions options;
  options.max_order = 3;
  options.max_delay = 3;
  options.fit.refit.prediction.warmup = 50;
  options.fit.refit.covariance = false;
  return options;
}

Model delayed_system() {
  return testing::model_of("G1=rational(nb=2,na=2,nk=2) | f=polynomial(degree=3,range=[-4:4]) | G2=rational(nb=1,na=2)",
                           {1.0, 0.4, 0.2, -1.2, 0.52, 0.5, 3.0, 0.4, -0.5, 1.0, -0.3, -0.9, 0.2});
}

TEST(AutomaticTest, ReachesTheNoiseWithOrdersOfItsOwn) {
  const Record record = testing::simulated_record(delayed_system(), 6000, kNoise, 21);
  const AutomaticResult result = fit_wiener_hammerstein(record, small());
  // 22 spline coefficients for a cubic: the deviation of the rmse for N = 6000 is 1 %, the rest is the spline's error.
  EXPECT_LT(result.fit.report.rmse, 1.05 * kNoise);
  const AnyBlock first = top_level_blocks(result.fit.model).front().block;
  const auto* g1 = first.target<Rational>();
  ASSERT_NE(g1, nullptr);
  EXPECT_GE(g1->na(), 2);
  // The delay of two samples lies in nk or in leading zeros of the numerator.
  EXPECT_LE(g1->nk(), 2);
  EXPECT_EQ(to_text(parse(result.chain)), result.chain);
  ASSERT_GE(result.tried.size(), 3u);
  EXPECT_TRUE(result.tried.front().taken);
  double best = result.tried.front().validation_rmse;
  std::string taken;
  for (const StructureScore& score : result.tried) {
    if (!score.taken) continue;
    EXPECT_LE(score.validation_rmse, best) << score.chain;
    best = score.validation_rmse;
    taken = score.chain;
  }
  EXPECT_EQ(taken, result.chain);
}

TEST(AutomaticTest, CancelledKeepsTheBestSoFar) {
  const Record record = testing::simulated_record(delayed_system(), 3000, kNoise, 22);
  AutomaticOptions options = small();
  int calls = 0;
  options.fit.progress = [&calls](const Progress&) { return ++calls < 30; };
  const AutomaticResult result = fit_wiener_hammerstein(record, options);
  EXPECT_FALSE(result.tried.empty());
  EXPECT_TRUE(result.fit.model.parameters.allFinite());
  EXPECT_LT(calls, 40);
}

TEST(AutomaticTest, ChosenOrdersKeepTheStaticBlockOfAHammersteinChain) {
  const Model truth = testing::model_of("f=polynomial(degree=3,range=[-4:4]) | G=rational(nb=1,na=2,nk=2)",
                                        {0.5, 3.0, 0.4, -0.5, 1.0, 0.4, -1.2, 0.52});
  const Record record = testing::simulated_record(truth, 4000, kNoise, 24);
  const AutomaticResult result =
      fit_with_chosen_orders(parse("f=polynomial(degree=3,range=[-4:4]) | G=rational(nb=1,na=1)"), record, small());
  const std::vector<ChildParameters> blocks = top_level_blocks(result.fit.model);
  ASSERT_EQ(blocks.size(), 2u);
  EXPECT_EQ(to_text(blocks.front().block), "polynomial(degree=3,range=[-4,4])");
  const auto* filter = blocks.back().block.target<Rational>();
  ASSERT_NE(filter, nullptr);
  EXPECT_GE(filter->na(), 2);
  // The delay of two samples lies in nk or in leading zeros of the numerator.
  EXPECT_LE(filter->nk(), 2);
  // A dozen free parameters of 4000 samples leave the rmse of the noise, known to 1 / sqrt(2 * 4000) = 1.1 %; four of
  // these.
  EXPECT_NEAR(result.fit.report.rmse, kNoise, 0.045 * kNoise);
}

TEST(AutomaticTest, OrdersOfNothingCannotBeChosen) {
  const Record record = testing::simulated_record(delayed_system(), 300, kNoise, 25);
  EXPECT_THAT(BLOCKID_MESSAGE(fit_with_chosen_orders(parse("f=polynomial(degree=3)"), record)), HasSubstr("rational"));
}

TEST(AutomaticTest, BadInputIsNamed) {
  const Record record = testing::simulated_record(delayed_system(), 60, kNoise, 23);
  EXPECT_THAT(BLOCKID_MESSAGE(fit_wiener_hammerstein(record)), HasSubstr("100"));
  AutomaticOptions options;
  options.validation_share = 1.0;
  EXPECT_THAT(BLOCKID_MESSAGE(fit_wiener_hammerstein(record, options)), HasSubstr("validation_share"));
}

}  // namespace
}  // namespace blockid
