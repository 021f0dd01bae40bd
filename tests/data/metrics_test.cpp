#include "blockid/data/metrics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "message.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(MetricsTest, ValuesByHand) {
  // y: mean 3, variance (4+1+1+4)/4 = 2.5; e = (1, -1, 1, 1): mean square 1, mean 0.5, variance 0.75.
  const Eigen::Vector4d y(1, 2, 4, 5);
  const Eigen::Vector4d yhat(0, 3, 3, 4);
  const Metrics m = evaluate_metrics(y, yhat);
  EXPECT_DOUBLE_EQ(m.rmse, 1.0);
  EXPECT_DOUBLE_EQ(m.nrmse, 1.0 / std::sqrt(2.5));
  EXPECT_DOUBLE_EQ(m.fit_percent, 100.0 * (1.0 - 1.0 / std::sqrt(2.5)));
  EXPECT_DOUBLE_EQ(m.r2, 0.6);
  EXPECT_DOUBLE_EQ(m.vaf, 70.0);
  EXPECT_DOUBLE_EQ(m.mae, 1.0);
  EXPECT_EQ(m.samples, 4);
  EXPECT_EQ(m.warmup, 0);
}

TEST(MetricsTest, FunctionsAgreeWithTheStruct) {
  const Eigen::Vector4d y(1, 2, 4, 5);
  const Eigen::Vector4d yhat(0, 3, 3, 8);
  const Eigen::VectorXd weights = Eigen::Vector4d(1, 1, 0, 3);
  const Metrics m = evaluate_metrics(y, yhat, 1, weights);
  EXPECT_EQ(m.samples, 2);
  EXPECT_EQ(m.warmup, 1);
  EXPECT_DOUBLE_EQ(m.mae, 2.0);
  EXPECT_EQ(rmse(y, yhat, 1, weights), m.rmse);
  EXPECT_EQ(nrmse(y, yhat, 1, weights), m.nrmse);
  EXPECT_EQ(fit_percent(y, yhat, 1, weights), m.fit_percent);
  EXPECT_EQ(r2(y, yhat, 1, weights), m.r2);
  EXPECT_EQ(vaf(y, yhat, 1, weights), m.vaf);
  EXPECT_EQ(mae(y, yhat, 1, weights), m.mae);
}

class RandomSignals : public ::testing::Test {
 protected:
  void SetUp() override {
    std::mt19937 generator(11);
    std::normal_distribution<double> normal;
    for (double& value : y_) value = normal(generator);
    for (double& value : yhat_) value = normal(generator);
  }
  Eigen::VectorXd y_ = Eigen::VectorXd::Zero(200);
  Eigen::VectorXd yhat_ = Eigen::VectorXd::Zero(200);
};

TEST_F(RandomSignals, PerfectAndMeanPredictions) {
  const Metrics perfect = evaluate_metrics(y_, y_);
  EXPECT_EQ(perfect.rmse, 0.0);
  EXPECT_EQ(perfect.fit_percent, 100.0);
  EXPECT_EQ(perfect.r2, 1.0);
  EXPECT_EQ(perfect.vaf, 100.0);
  const Metrics mean = evaluate_metrics(y_, Eigen::VectorXd::Constant(200, y_.mean()));
  EXPECT_NEAR(mean.nrmse, 1.0, 1e-14);
  EXPECT_NEAR(mean.fit_percent, 0.0, 1e-12);
  EXPECT_NEAR(mean.r2, 0.0, 1e-13);
  EXPECT_NEAR(mean.vaf, 0.0, 1e-11);
}

TEST_F(RandomSignals, RelativeFiguresHaveNoUnit) {
  const Metrics m = evaluate_metrics(y_, yhat_);
  const Metrics scaled = evaluate_metrics(1e3 * y_, 1e3 * yhat_);
  EXPECT_NEAR(scaled.rmse, 1e3 * m.rmse, 1e-10);
  EXPECT_NEAR(scaled.mae, 1e3 * m.mae, 1e-10);
  EXPECT_NEAR(scaled.nrmse, m.nrmse, 1e-13);
  EXPECT_NEAR(scaled.vaf, m.vaf, 1e-10);
  EXPECT_NEAR(m.r2, 1.0 - m.nrmse * m.nrmse, 1e-13);
}

TEST_F(RandomSignals, VafIsBlindToAConstantError) {
  const Eigen::VectorXd shifted = yhat_.array() + 5.0;
  EXPECT_NEAR(vaf(y_, shifted), vaf(y_, yhat_), 1e-9);
  EXPECT_GT(rmse(y_, shifted), rmse(y_, yhat_));
}

TEST_F(RandomSignals, WarmupEqualsCuttingOff) {
  const Metrics whole = evaluate_metrics(y_, yhat_, 50);
  const Metrics cut = evaluate_metrics(y_.tail(150), yhat_.tail(150));
  EXPECT_EQ(whole.rmse, cut.rmse);
  EXPECT_EQ(whole.vaf, cut.vaf);
  EXPECT_EQ(whole.samples, 150);
}

TEST_F(RandomSignals, MissingSamplesEqualLeavingOut) {
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(200, 0.3);
  weights.tail(60).setZero();
  y_[180] = kNan;
  const Metrics masked = evaluate_metrics(y_, yhat_, 0, weights);
  const Metrics cut = evaluate_metrics(y_.head(140), yhat_.head(140));
  EXPECT_EQ(masked.rmse, cut.rmse);
  EXPECT_EQ(masked.nrmse, cut.nrmse);
  EXPECT_EQ(masked.samples, 140);
}

TEST(MetricsTest, ConstantOutputHasNoRelativeFigures) {
  const Metrics m = evaluate_metrics(Eigen::VectorXd::Constant(7, 0.1), Eigen::VectorXd::Zero(7));
  EXPECT_NEAR(m.rmse, 0.1, 1e-16);
  EXPECT_TRUE(std::isnan(m.nrmse));
  EXPECT_TRUE(std::isnan(m.fit_percent));
  EXPECT_TRUE(std::isnan(m.r2));
  EXPECT_TRUE(std::isnan(m.vaf));
}

TEST(MetricsTest, DivergedSimulationGivesNonFiniteFigures) {
  const Eigen::Vector2d y(1, 2);
  EXPECT_TRUE(std::isnan(rmse(y, Eigen::Vector2d(1, kNan))));
  EXPECT_TRUE(std::isinf(rmse(y, Eigen::Vector2d(1, std::numeric_limits<double>::infinity()))));
}

TEST(MetricsTest, MistakesAreNamed) {
  const Eigen::Vector3d y(1, kNan, 3);
  const Eigen::Vector3d yhat(1, 2, 3);
  EXPECT_THAT(BLOCKID_MESSAGE(rmse(y, yhat)), AllOf(HasSubstr("non-finite"), HasSubstr("index 1")));
  EXPECT_NO_THROW(static_cast<void>(rmse(y, yhat, 2)));
  EXPECT_THAT(BLOCKID_MESSAGE(rmse(y, yhat.head(2))), AllOf(HasSubstr("3 measured"), HasSubstr("2 simulated")));
  EXPECT_THAT(BLOCKID_MESSAGE(rmse(y, yhat, 0, Eigen::VectorXd::Ones(2))), HasSubstr("2 weights"));
  EXPECT_THAT(BLOCKID_MESSAGE(rmse(yhat, yhat, 3)), AllOf(HasSubstr("warm-up is 3"), HasSubstr("0 to 2")));
  EXPECT_THAT(BLOCKID_MESSAGE(rmse(yhat, yhat, -1)), HasSubstr("warm-up is -1"));
  EXPECT_THAT(BLOCKID_MESSAGE(rmse(yhat, yhat, 1, Eigen::VectorXd::Zero(3))),
              AllOf(HasSubstr("no sample to score"), HasSubstr("all 2")));
  EXPECT_THAT(BLOCKID_MESSAGE(rmse(yhat, yhat, 0, Eigen::Vector3d(1, -1, 1))),
              AllOf(HasSubstr("weight"), HasSubstr("index 1")));
}

}  // namespace
}  // namespace blockid
