// The error of a model beside the noise.
#include "support/signals.hpp"

#include <blockid/data/error.hpp>
#include <blockid/validation/error_spectrum.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr Index kPeriod = 64;

ResidualRecord record_of(const VectorXd& residual) {
  return {VectorXd::Zero(residual.size()), VectorXd::Zero(residual.size()), residual, {}, {}, {}};
}

/// Amplitude 0.2 at line 5.
VectorXd tone(Index n) {
  return VectorXd::NullaryExpr(n, [](Index t) {
    return 0.2 * std::sin(2.0 * std::numbers::pi * 5.0 * static_cast<double>(t) / static_cast<double>(kPeriod));
  });
}

TEST(PeriodicError, HoldsItsSize) {
  // 400 records of 5 periods of white noise at 5 %: 20 expected, deviation 4.4, 3.3 of them.
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    testing::Noise noise(seed);
    const ResidualRecord record = record_of(noise.white(5 * kPeriod));
    alarms += periodic_error({&record, 1}, kPeriod, 1.0, 0.05).passed ? 0 : 1;
  }
  EXPECT_GE(alarms, 6);
  EXPECT_LE(alarms, 34);
}

TEST(PeriodicError, SeesWhatRepeats) {
  testing::Noise noise(1);
  const double sample_time_s = 0.01;
  const ResidualRecord record = record_of(noise.white(40 * kPeriod, 0.2) + tone(40 * kPeriod));
  const PeriodicError error = periodic_error({&record, 1}, kPeriod, sample_time_s);
  EXPECT_FALSE(error.passed);
  EXPECT_EQ(error.periods, 40);
  EXPECT_EQ(error.degrees_of_freedom, 2 * 31);
  Index place = 0;
  const double peak = error.error_density.maxCoeff(&place);
  EXPECT_EQ(place, 4);
  EXPECT_DOUBLE_EQ(error.frequency_hz[4], 5.0 / (64 * sample_time_s));
  // Power 0.2^2 / 2 in one line of width 1 / 0.64 s; its noise is 0.2^2 2 Ts, a fortieth of it in the mean.
  EXPECT_NEAR(peak / 0.64, 0.02, 0.004);
  // White noise: 2 Ts sigma^2; 31 lines of 39 degrees: 3 %.
  EXPECT_NEAR(error.noise_density.mean(), 2.0 * sample_time_s * 0.04, 0.1 * 2.0 * sample_time_s * 0.04);
}

TEST(PeriodicError, TakesTheLastWholePeriodsOfEachRecord) {
  testing::Noise noise(2);
  ResidualRecord first = record_of(noise.white(3 * kPeriod + 10));
  first.weights = VectorXd::Ones(first.residual.size());
  first.weights.head(20).setZero();
  first.residual.head(20).setConstant(std::nan(""));
  const ResidualRecord records[] = {first, record_of(noise.white(2 * kPeriod))};
  EXPECT_EQ(periodic_error(records, kPeriod, 1.0).periods, 4);
}

TEST(NoiseLevel, HoldsItsSizeForColouredNoise) {
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    testing::Noise noise(seed);
    ResidualRecord record = record_of(noise.coloured(1000, 0.8, 0.5));
    record.u = noise.white(1000);
    record.yhat = record.u;
    const ResidualTests tests =
        residual_tests({&record, 1}, {.covariance = {}, .lags = 5, .significance = 0.05, .noise_order = 5});
    alarms += noise_level_test(tests, 0.5).passed ? 0 : 1;
  }
  // 20 expected; the variance of this colour is worth 220 samples, the skewness of chi-square and the estimated colour
  // move the size by a tenth of it at most.
  EXPECT_GE(alarms, 6);
  EXPECT_LE(alarms, 36);
}

TEST(NoiseLevel, SeesALargerResidual) {
  testing::Noise noise(3);
  ResidualRecord record = record_of(noise.white(2000, 1.2));
  record.u = noise.white(2000);
  record.yhat = record.u;
  const ResidualTests tests = residual_tests({&record, 1});
  EXPECT_FALSE(noise_level_test(tests, 1.0).passed);
  EXPECT_NEAR(noise_level_test(tests, 1.0).ratio, 1.2, 0.08);
  EXPECT_TRUE(noise_level_test(tests, 1.3).passed);
  EXPECT_THAT([&] { static_cast<void>(noise_level_test(tests, 0.0)); },
              ThrowsMessage<Error>(HasSubstr("standard deviation above zero, got 0")));
}

void expect_error(const std::function<void(ResidualRecord&, Index&, double&)>& change, const char* part) {
  testing::Noise noise(4);
  ResidualRecord record = record_of(noise.white(3 * kPeriod));
  Index period = kPeriod;
  double sample_time_s = 1.0;
  EXPECT_NO_THROW(static_cast<void>(periodic_error({&record, 1}, period, sample_time_s)));
  change(record, period, sample_time_s);
  EXPECT_THAT(
      [&] {
        static_cast<void>(periodic_error({&record, 1}, period, sample_time_s));
      },
      ThrowsMessage<Error>(HasSubstr(part)));
}

TEST(PeriodicError, BadInputIsRefused) {
  expect_error([](auto& r, auto&, auto&) { r.residual.conservativeResize(100); }, "two whole periods of 64 samples");
  expect_error([](auto&, auto& period, auto&) { period = 2; }, "period of 3 samples or more, got 2");
  expect_error([](auto&, auto&, auto& ts) { ts = 0.0; }, "sample time above zero, got 0");
  expect_error([](auto& r, auto&, auto&) { r.residual[190] = std::nan(""); }, "finite residuals");
  expect_error([](auto& r, auto&, auto&) { r.weights = VectorXd::Ones(5); }, "weights of 192 samples, got 5");
  expect_error(
      [](auto& r, auto&, auto&) {
        r.weights = VectorXd::Ones(3 * kPeriod);
        r.weights[100] = 0.0;
      },
      "no missing samples behind the warm-up");
  EXPECT_THAT([] { static_cast<void>(periodic_error({}, kPeriod, 1.0)); },
              ThrowsMessage<Error>(HasSubstr("at least one record")));
}

}  // namespace
}  // namespace blockid
