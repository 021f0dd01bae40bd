// Band-limited lower bounds of the uncertainty: values of an independent prototype, closed forms, laws, errors.
#include "closed_loop_noise.hpp"

#include "data/message.hpp"

#include <blockid/validation/band_bound.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

// Printed digits of an independent prototype: 500 samples, 100 samples of test signal.
TEST(BandBounds, ValuesOfAnIndependentPrototype) {
  const UncertaintySignals signals = crowder_signals(CrowderLoop{}.ok());
  const std::vector<BandBound> bounds =
      band_bounds(signals.v.head(500), signals.w.head(500), polynomial({.0855, .3, .6, 1.0, 2.0, 3.0}), 100);
  ASSERT_EQ(bounds.size(), 6U);
  EXPECT_NEAR(bounds[0].gain, .849, 5e-4);
  EXPECT_NEAR(bounds[1].gain, .297, 5e-4);
  EXPECT_NEAR(bounds[2].gain, .203, 5e-4);
  EXPECT_NEAR(bounds[3].gain, .1709, 5e-5);
  EXPECT_NEAR(bounds[4].gain, .1024, 5e-5);
  EXPECT_NEAR(bounds[5].gain, .0148, 5e-5);
  // Hann's main lobe reaches 4 pi / 101 to each side. At 3 rad v is so weak that the side lobes count.
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(bounds[i].mean_omega, bounds[i].omega, 4.0 * std::numbers::pi / 101.0);
    EXPECT_LT(bounds[i].spread_omega, 4.0 * std::numbers::pi / 101.0);
  }
  EXPECT_GT(bounds[5].spread_omega, 2.0 * bounds[4].spread_omega);
}

TEST(BandBounds, NeverAboveTheNormAndLowerWithNoise) {
  const CrowderLoop crowder;
  const VectorXd omegas = VectorXd::LinSpaced(25, 0.0, std::numbers::pi);
  const NoisySignals noisy = noisy_signals(crowder.ok(), crowder.plant, normal_reference(300), 0.05, 5);
  const std::vector<BandBound> bounds = band_bounds(noisy.v, noisy.w, omegas, 80, noisy.noise());
  const std::vector<BandBound> trusting = band_bounds(noisy.v, noisy.w, omegas, 80);
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    EXPECT_LE(bounds[i].gain, .95198548) << bounds[i].omega;
    EXPECT_LE(bounds[i].gain, trusting[i].gain) << bounds[i].omega;
  }
  EXPECT_GT(bounds[1].gain, 0.1);  // 0.13 rad, near the peak of Delta: the noise leaves something
}

// Delta = 0.7 q^-3: its gain is 0.7 at every frequency. Nothing is lost at the end, where v and the test signals rest.
TEST(BandBounds, OfAnAllPassIsItsGain) {
  VectorXd v = VectorXd::Zero(200);
  v.head(100) = normal_reference(100, 4);
  VectorXd w = VectorXd::Zero(200);
  w.tail(197) = 0.7 * v.head(197);
  for (const BandBound& bound : band_bounds(v, w, VectorXd::LinSpaced(9, 0.0, std::numbers::pi), 50)) {
    EXPECT_NEAR(bound.gain, 0.7, 1e-12) << bound.omega;  // sums of some hundred products
  }
}

// (1 / 2 pi) int |Delta|^2 |F(T_v x)|^2 is bounded from below: a narrow gap of Delta does not make the bound false, the
// mean over the band stays above it. Delta = (1 + q^-2) / 2 vanishes at pi / 2.
TEST(BandBounds, AreMeansOverTheLeakage) {
  const VectorXd v = normal_reference(400, 8);
  const VectorXd w = filter({polynomial({0.5, 0.0, 0.5}), polynomial({1.0})}, v);
  const double gap = std::numbers::pi / 2.0;
  for (const Index length : {20, 100, 400}) {
    const BandBound bound = band_bounds(v, w, VectorXd::Constant(1, gap), length).front();
    // |Delta| = |cos omega| <= |omega - pi / 2|: the root of its mean square over the weight.
    const double most = std::hypot(bound.spread_omega, bound.mean_omega - gap);
    EXPECT_LE(bound.gain, most * (1.0 + 1e-9)) << length;
    EXPECT_GT(bound.gain, 0.0);
  }
}

TEST(BandBounds, MistakesAreNamed) {
  const VectorXd one = VectorXd::Ones(3);
  const VectorXd omega = VectorXd::Ones(1);
  EXPECT_THAT(message_of([&] { band_bounds(one, VectorXd::Ones(2), omega, 1); }), HasSubstr("one size"));
  EXPECT_THAT(message_of([&] { band_bounds(0.0 * one, one, omega, 1); }), HasSubstr("v is zero"));
  EXPECT_THAT(message_of([&] { band_bounds(one, one, omega, 4); }), HasSubstr("between 1 and 3, got 4"));
  EXPECT_THAT(message_of([&] { band_bounds(one, one, 4.0 * omega, 1); }), HasSubstr("between 0 and pi, got 4"));
  EXPECT_THAT(message_of([&] { band_bounds(one, one, omega, 1, -1.0); }), HasSubstr("at least 0, got -1"));
  EXPECT_THAT(message_of([&] { band_bounds(one, std::nan("") * one, omega, 1); }), HasSubstr("finite samples"));
}

}  // namespace
}  // namespace blockid::testing
