// How many frequencies an input excites, on inputs of which it is known.
#include "support/signals.hpp"

#include <blockid/estimators/excitation.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace blockid {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;

Record record_of(const VectorXd& u) {
  Record record;
  record.u = u;
  record.y = VectorXd::Zero(u.size());
  record.sample_time_s = 0.01;
  return record;
}

Excitation of(const VectorXd& u) { return excitation({{record_of(u)}}); }

/// Frequencies in cycles a record.
VectorXd sines(Index count, const std::vector<double>& cycles) {
  VectorXd u = VectorXd::Zero(count);
  double phase = 0.3;
  for (const double f : cycles) {
    phase += 1.7;
    for (Index t = 0; t < count; ++t) {
      u[t] += std::sin(2.0 * std::numbers::pi * f * static_cast<double>(t) / static_cast<double>(count) + phase);
    }
  }
  return u;
}

TEST(ExcitationTest, SinesAreCountedWholeOrNot) {
  for (const Index count : {200, 1000, 4096, 5003}) {
    for (const double fraction : {0.0, 0.31, 0.5}) {
      EXPECT_EQ(of(sines(count, {12.0 + fraction})).frequencies, 1) << count << ' ' << fraction;
      EXPECT_EQ(of(sines(count, {12.0, 31.0 + fraction})).frequencies, 2);
      EXPECT_EQ(of(sines(count, {10.0, 25.3, 41.0 + fraction, 70.0, 90.1})).frequencies, 5);
    }
  }
  // Half a record of a slow one.
  EXPECT_EQ(of(sines(1000, {3.5})).frequencies, 1);
}

TEST(ExcitationTest, MeansGiveOneEquation) {
  const VectorXd sine = sines(1000, {20.0});
  EXPECT_EQ(of(sine).equations(), 2);
  EXPECT_FALSE(of(sines(1000, {20.3})).mean);
  const Excitation shifted = of(sine.array() + 0.5);
  EXPECT_TRUE(shifted.mean);
  EXPECT_EQ(shifted.equations(), 3);
}

TEST(ExcitationTest, NoiseAndStepsExciteNearlyAllLines) {
  testing::Noise noise(1);
  // 500 lines; the window takes up to eight, and few of the others lie 60 dB below the largest.
  EXPECT_GT(of(noise.white(1000)).frequencies, 400);
  EXPECT_GT(of(noise.white(40)).frequencies, 10);
  VectorXd step = VectorXd::Zero(1000);
  step.tail(600).setOnes();
  // 1 / f^2 reaches 1e-6 of its largest value at a thousand times its frequency.
  EXPECT_GT(of(step).frequencies, 50);
}

TEST(ExcitationTest, RecordsAddUpWhereTheyDiffer) {
  const DataSet different{{record_of(sines(1000, {20.0})), record_of(sines(1000, {50.0}))}};
  EXPECT_EQ(excitation(different).frequencies, 2);
  const DataSet alike{{record_of(sines(1000, {20.0})), record_of(sines(500, {10.0}))}};
  EXPECT_EQ(excitation(alike).frequencies, 1);
}

TEST(ExcitationTest, LackIsToldWithItsNumbers) {
  EXPECT_EQ(text_of_lack({.frequencies = 3, .mean = false}, 6), "");
  EXPECT_EQ(text_of_lack({.frequencies = 2, .mean = true}, 5), "");
  const std::string text = text_of_lack({.frequencies = 1, .mean = false}, 6);
  EXPECT_THAT(text, HasSubstr("excites 1 frequency: 2 equations for 6 coefficients"));
  EXPECT_THAT(text, HasSubstr("3 frequencies or more"));
}

}  // namespace
}  // namespace blockid
