// The spectrum of a residual beside that of a record of noise alone.
#include "support/signals.hpp"

#include <blockid/data/error.hpp>
#include <blockid/validation/noise_spectrum.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

ResidualRecord record_of(const VectorXd& residual) {
  return {VectorXd::Zero(residual.size()), VectorXd::Zero(residual.size()), residual, {}, {}, {}};
}

/// Alarms at 5 % among 400 pairs of records, with noise of one pole.
int alarms(Index samples, Index of_noise, double pole) {
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    testing::Noise noise(seed);
    const ResidualRecord record = record_of(noise.coloured(samples, pole, 0.3));
    count += noise_spectrum_test({&record, 1}, noise.coloured(of_noise, pole, 0.3), 0.01, 0.05).passed ? 0 : 1;
  }
  return count;
}

// 20 expected, deviation 4.4; 3.3 of them.
TEST(NoiseSpectrum, HoldsItsSize) {
  for (const double pole : {0.0, 0.8}) {
    for (const auto& [samples, of_noise] : {std::pair<Index, Index>{2000, 2000}, {4000, 600}, {300, 3000}}) {
      const int found = alarms(samples, of_noise, pole);
      EXPECT_GE(found, 6) << pole << " " << samples;
      EXPECT_LE(found, 34) << pole << " " << samples;
    }
  }
}

// White noise of deviation s has the density 2 Ts s^2.
TEST(NoiseSpectrum, ShowsBothDensities) {
  testing::Noise noise(1);
  const double sample_time_s = 0.01;
  const ResidualRecord record = record_of(noise.white(16000, 0.2));
  const NoiseSpectrumTest test = noise_spectrum_test({&record, 1}, noise.white(8000, 0.3), sample_time_s);
  EXPECT_EQ(test.segment, 512);
  EXPECT_EQ(test.residual_segments, 31);
  EXPECT_EQ(test.noise_segments, 15);
  ASSERT_EQ(test.frequency_hz.size(), 16);
  EXPECT_EQ(test.degrees_of_freedom, 32);
  EXPECT_TRUE(test.passed);
  // 16 bands of 15 lines or so, 31 and 15 segments: means to 1.2 and 2 %, of which three.
  EXPECT_NEAR(test.residual_density.mean() / (2.0 * sample_time_s * 0.04), 1.0, 0.04);
  EXPECT_NEAR(test.noise_density.mean() / (2.0 * sample_time_s * 0.09), 1.0, 0.06);
  EXPECT_GT(test.frequency_hz[0], 0.0);
  EXPECT_LT(test.frequency_hz[15], 50.0);
}

// A sine of 8 % of the noise's power: in its band of 8 lines, of ratio F(126, 126), it more than doubles the power.
TEST(NoiseSpectrum, SeesAnErrorInABand) {
  testing::Noise noise(2);
  const VectorXd alone = noise.white(4000, 0.3);
  VectorXd residual = noise.white(4000, 0.3);
  EXPECT_TRUE([&] {
    const ResidualRecord record = record_of(residual);
    return noise_spectrum_test({&record, 1}, alone, 1.0).passed;
  }());
  for (Index t = 0; t < residual.size(); ++t) {
    residual[t] += 0.12 * std::sin(2.0 * std::numbers::pi * 0.11 * static_cast<double>(t));
  }
  const ResidualRecord record = record_of(residual);
  const NoiseSpectrumTest test = noise_spectrum_test({&record, 1}, alone, 1.0);
  EXPECT_FALSE(test.passed);
  Index place = 0;
  test.p_values.minCoeff(&place);
  EXPECT_NEAR(test.frequency_hz[place], 0.11, 0.02);
  // Twice the power of the noise, at all frequencies.
  const ResidualRecord loud = record_of(noise.white(4000, 0.45));
  EXPECT_FALSE(noise_spectrum_test({&loud, 1}, alone, 1.0).passed);
  // Less than the noise is no fault of the model.
  const ResidualRecord still = record_of(noise.white(4000, 0.1));
  EXPECT_TRUE(noise_spectrum_test({&still, 1}, alone, 1.0).passed);
}

TEST(NoiseSpectrum, GapsAndMeansDoNotCount) {
  testing::Noise noise(3);
  ResidualRecord record = record_of(noise.white(2000, 0.3).array() + 5.0);
  record.weights = VectorXd::Ones(2000);
  record.weights.head(100).setZero();
  record.residual.head(100).setConstant(1e6);
  record.weights[1000] = 0.0;
  record.residual[1000] = std::nan("");
  const NoiseSpectrumTest test = noise_spectrum_test({&record, 1}, noise.white(2000, 0.3).array() - 3.0, 1.0);
  EXPECT_TRUE(test.passed);
  EXPECT_EQ(test.segment, 128);
  EXPECT_EQ(test.residual_segments, 7 + 7) << "900 samples before the gap, 999 behind it";
}

void expect_error(const std::function<void(ResidualRecord&, VectorXd&, double&, double&)>& change, const char* part) {
  testing::Noise source(4);
  ResidualRecord record = record_of(source.white(400));
  VectorXd noise = source.white(400);
  double sample_time_s = 1.0;
  double significance = 0.01;
  const auto run = [&] { static_cast<void>(noise_spectrum_test({&record, 1}, noise, sample_time_s, significance)); };
  EXPECT_NO_THROW(run());
  change(record, noise, sample_time_s, significance);
  EXPECT_THAT(run, ThrowsMessage<Error>(HasSubstr(part)));
}

TEST(NoiseSpectrum, BadInputIsRefused) {
  expect_error(
      [](auto& r, auto&, auto&, auto&) { r.residual.conservativeResize(127); },
      "expected at least 8 segments of 16 samples without a gap in the residual and in the noise, got 7 and 25");
  expect_error([](auto&, auto& n, auto&, auto&) { n.conservativeResize(100); }, "got 25 and 6");
  expect_error([](auto&, auto& n, auto&, auto&) { n.setConstant(1.0); }, "the noise does not vary");
  expect_error([](auto&, auto& n, auto&, auto&) { n[3] = std::nan(""); }, "finite samples of the noise");
  expect_error([](auto& r, auto&, auto&, auto&) { r.residual[3] = std::nan(""); }, "finite residuals");
  expect_error([](auto& r, auto&, auto&, auto&) { r.weights = VectorXd::Ones(3); }, "weights of 400 samples, got 3");
  expect_error([](auto&, auto&, auto& ts, auto&) { ts = 0.0; }, "sample time above zero, got 0");
  expect_error([](auto&, auto&, auto&, auto& p) { p = 1.0; }, "significance in (0, 1), got 1");
}

}  // namespace
}  // namespace blockid
