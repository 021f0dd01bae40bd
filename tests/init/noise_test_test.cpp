// The test of residuals against noise: its distribution, what it finds, its edges.
#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <blockid/init/noise_test.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::model_of;
using testing::Noise;
using testing::simulated_record;

constexpr Index kSamples = 3000;
constexpr double kNoise = 0.05;
// Three regressors for each of 20 lags, and the constant.
constexpr double kDegrees = 61.0;

NoiseTest tested(const Model& model, const DataSet& data, const NoiseTestOptions& options = {}) {
  const Predictor predictor(model.chain, data);
  return noise_test(predictor, model.parameters, options);
}

// An input with a strong colour: u_t = 0.95 u_{t-1} + e_t.
Record coloured_record(const Model& model, std::uint64_t seed) {
  Noise numbers(seed);
  Record record;
  record.u = simulate(model_of("G=rational(nb=0,na=1)", {0.3, -0.95}), numbers.white(kSamples));
  record.y = simulate(model, record.u) + numbers.white(kSamples, kNoise);
  return record;
}

// Mean of the statistic over `count` records with the true model: chi-squared has the mean `degrees`, its mean over
// count records the deviation sqrt(2 degrees / count). N R^2 itself lies 1 + O(degrees / N) = 1 % beside chi-squared.
template <class Make>
void expect_chi_squared(Make&& record_of) {
  const Model truth = testing::wiener_hammerstein();
  constexpr int kRecords = 40;
  double sum = 0.0;
  int failures = 0;
  for (std::uint64_t seed = 1; seed <= kRecords; ++seed) {
    const NoiseTest test = tested(truth, record_of(truth, seed));
    sum += test.statistic;
    failures += test.like_noise() ? 0 : 1;
  }
  const double tolerance = 4.0 * std::sqrt(2.0 * kDegrees / kRecords) + 0.01 * kDegrees;
  EXPECT_NEAR(sum / kRecords, kDegrees, tolerance);
  // Each fails by a chance of 1e-4.
  EXPECT_EQ(failures, 0);
}

TEST(NoiseTest, TheTrueModelLeavesChiSquared) {
  expect_chi_squared([](const Model& m, std::uint64_t seed) { return simulated_record(m, kSamples, kNoise, seed); });
}

TEST(NoiseTest, WhateverTheSpectrumOfTheInput) { expect_chi_squared(coloured_record); }

TEST(NoiseTest, TheLimitIsTheQuantileOfChiSquared) {
  // 110.840 for 61 degrees and 0.9999, from the series of the incomplete gamma function; the formula of Wilson and
  // Hilferty errs by 0.14 % there.
  const Model truth = testing::wiener_hammerstein();
  EXPECT_NEAR(tested(truth, simulated_record(truth, kSamples, kNoise, 1)).limit, 110.840, 0.2);
}

TEST(NoiseTest, AWrongPoleIsSeen) {
  Model wrong = testing::wiener_hammerstein();
  wrong.parameters[3] += 0.02;
  const Record record = simulated_record(testing::wiener_hammerstein(), kSamples, kNoise, 2);
  EXPECT_FALSE(tested(wrong, record).like_noise());
}

TEST(NoiseTest, ColouredNoiseIsSeen) {
  const Model truth = testing::wiener_hammerstein();
  Record record = simulated_record(truth, kSamples, 0.0, 3);
  Noise numbers(4);
  record.y += simulate(model_of("G=rational(nb=0,na=1)", {1.0, -0.3}), numbers.white(kSamples, kNoise));
  EXPECT_FALSE(tested(truth, record).like_noise());
}

TEST(NoiseTest, AMissingSquareIsSeen) {
  const Model linear = testing::linear();
  Record record = simulated_record(linear, kSamples, kNoise, 5);
  record.y.array() += 0.5 * kNoise * (record.u.array().square() - 1.0);
  EXPECT_FALSE(tested(linear, record).like_noise());
}

TEST(NoiseTest, MissingSamplesDoNotCount) {
  const Model truth = testing::wiener_hammerstein();
  Record record = simulated_record(truth, kSamples, kNoise, 6);
  record.weights = Eigen::VectorXd::Ones(kSamples);
  for (Index t = 1000; t < 1100; ++t) {
    record.weights[t] = 0.0;
    record.y[t] = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_TRUE(tested(truth, record).like_noise());
}

TEST(NoiseTest, NothingLeftIsNothingToFind) {
  const Model truth = testing::linear();
  Record record = simulated_record(truth, kSamples, 0.0, 7);
  EXPECT_TRUE(tested(truth, record).like_noise());
  // Too few samples for a single lag.
  const DataSet few(simulated_record(truth, 50, kNoise, 7));
  EXPECT_EQ(tested(truth, few).statistic, 0.0);
}

TEST(NoiseTest, ResidualsThatAreNotFiniteFail) {
  Model unstable = testing::linear();
  unstable.parameters[3] = -5.0;
  EXPECT_FALSE(tested(unstable, simulated_record(testing::linear(), kSamples, kNoise, 8)).like_noise());
}

TEST(NoiseTest, RefusesBadOptions) {
  const Model truth = testing::linear();
  const DataSet data(simulated_record(truth, kSamples, kNoise, 9));
  EXPECT_THAT(BLOCKID_MESSAGE(tested(truth, data, {.lags = 0})), HasSubstr("lags >= 1"));
  EXPECT_THAT(BLOCKID_MESSAGE(tested(truth, data, {.level = 1.0})), HasSubstr("within (0, 1)"));
}

}  // namespace
}  // namespace blockid
