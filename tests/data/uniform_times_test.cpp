// Time stamps: what counts as uniform, and what a refusal says.
#include "blockid/data/uniform_times.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "message.hpp"

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::AllOf;
using ::testing::HasSubstr;

VectorXd stamps(Index count, double interval, double start = 0.0) {
  return VectorXd::LinSpaced(count, start, start + interval * static_cast<double>(count - 1));
}

VectorXd rounded(const VectorXd& times, double quantum) { return (times / quantum).array().round() * quantum; }

TEST(UniformTimes, ExactStampsGiveTheirInterval) {
  for (const double interval : {1e-7, 2.0944e-5, 1e-3, 0.02, 1.0, 10.0, 3600.0}) {
    for (const double start : {0.0, -5.0 * interval, 12345.678 * interval}) {
      const SampleTimes times = uniform_times(stamps(1000, interval, start), "t");
      // The difference of stamps up to 13345 intervals, rounded in double precision, over 999 of them.
      EXPECT_NEAR(times.sample_time_s, interval, 1e-13 * interval);
    }
  }
}

TEST(UniformTimes, SumsOfTheIntervalAndTwoStampsWillDo) {
  VectorXd sums(100000);
  double sum = 0.0;
  for (double& value : sums) {
    value = sum;
    sum += 0.001;
  }
  EXPECT_NEAR(uniform_times(sums, "t").sample_time_s, 0.001, 1e-13);
  EXPECT_EQ(uniform_times(Eigen::Vector2d(1.0, 1.5), "t").sample_time_s, 0.5);
}

TEST(UniformTimes, RoundedStampsGiveTheMeanInterval) {
  // 30 Hz to milliseconds: intervals of 33 and 34 ms.
  const SampleTimes video = uniform_times(rounded(stamps(3001, 1.0 / 30.0), 1e-3), "t");
  EXPECT_NEAR(video.sample_time_s, 1.0 / 30.0, 1e-3 / 3000.0);
  EXPECT_NEAR(video.resolution_s, 1e-3, 1e-12);
  // 78125 Hz to microseconds: 12 and 13 us.
  const SampleTimes fast = uniform_times(rounded(stamps(50000, 12.8e-6), 1e-6), "t");
  EXPECT_NEAR(fast.sample_time_s, 12.8e-6, 1e-6 / 49999.0);
  // Finer roundings count as none.
  EXPECT_EQ(uniform_times(rounded(stamps(1000, 1.0 / 3.0), 1e-4), "t").resolution_s, 0.0);
}

TEST(UniformTimes, SinglePrecisionCountsAsRounding) {
  // Around 1000 s single-precision numbers are 61 us apart: 6 % of a millisecond.
  const VectorXd single = stamps(20000, 1e-3, 1000.0).cast<float>().cast<double>();
  const SampleTimes times = uniform_times(single, "t");
  EXPECT_NEAR(times.sample_time_s, 1e-3, 61e-6 / 19999.0);
  EXPECT_GT(times.resolution_s, 6e-5);
}

/// Uniform on -1/2 .. 1/2 times `jitter` around stamps of one millisecond.
VectorXd jittered(double jitter, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(-0.5, 0.5);
  VectorXd times = stamps(5000, 1e-3);
  for (double& value : times) value += jitter * 1e-3 * part(random);
  return times;
}

TEST(UniformTimes, JitterUpToOneHundredthPasses) {
  // Two stamps off by half the jitter each way change an interval by all of it.
  EXPECT_NEAR(uniform_times(jittered(0.009, 1), "t").sample_time_s, 1e-3, 1e-8);
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(jittered(0.03, 1), "t")), HasSubstr("not uniform"));
}

TEST(UniformTimes, LostSampleIsNamedWithBothIntervals) {
  VectorXd times = stamps(1000, 0.02);
  times.tail(400).array() += 0.02;
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(times, "t_s")),
              AllOf(HasSubstr("'t_s'"), HasSubstr("sample index 600 comes 0.04 s"), HasSubstr("expected 0.02 s")));
  // Rounding to half an interval does not hide it.
  times = rounded(stamps(1000, 0.034), 0.01);
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(times, "t")),
              AllOf(HasSubstr("not uniform"), HasSubstr("rounded to 0.01")));
}

TEST(UniformTimes, ChangeOfTheRateBehindRoundingIsSeen) {
  // 33 ms, then 34 ms: each interval is one of a 30 Hz record rounded to milliseconds.
  VectorXd times(1000);
  for (Index k = 0; k < times.size(); ++k) {
    times[k] = 1e-3 * static_cast<double>(k < 500 ? 33 * k : 33 * 500 + 34 * (k - 500));
  }
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(times, "t")),
              AllOf(HasSubstr("not uniform"), HasSubstr("sample index 10 comes 0.33 s")));
}

TEST(UniformTimes, StampsThatDoNotIncreaseAreNamed) {
  VectorXd times = stamps(10, 1.0);
  times[7] = times[6];
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(times, "t")),
              AllOf(HasSubstr("do not increase"), HasSubstr("6 s at sample index 6"), HasSubstr("at 7")));
  times[7] = -1.0;
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(times, "t")), HasSubstr("do not increase"));
  times[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(times, "t")), HasSubstr("'t' at sample index 3 is nan"));
  EXPECT_THAT(BLOCKID_MESSAGE(uniform_times(VectorXd::Zero(1), "t")), HasSubstr("two or more, came 1"));
}

TEST(UniformTimes, GivenSampleTimeIsCompared) {
  const SampleTimes exact = uniform_times(stamps(1001, 1e-3), "t");
  EXPECT_NO_THROW(check_sample_time(exact, 1001, 1e-3 * (1.0 + 5e-5), "t"));
  EXPECT_THAT(BLOCKID_MESSAGE(check_sample_time(exact, 1001, 1.01e-3, "t")),
              AllOf(HasSubstr("'t' are 0.001 s apart"), HasSubstr("expected 0.00101 s")));
  // Eleven stamps rounded to milliseconds know 33.3 ms to 0.1 ms only.
  const SampleTimes coarse = uniform_times(rounded(stamps(11, 1.0 / 30.0), 1e-3), "t");
  EXPECT_NO_THROW(check_sample_time(coarse, 11, 1.0 / 30.0, "t"));
  EXPECT_THROW(check_sample_time(coarse, 11, 1.0 / 29.0, "t"), Error);
}

}  // namespace
}  // namespace blockid
