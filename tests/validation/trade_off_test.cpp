// Uncertainty over noise: values of an independent prototype, slopes, elbow, errors.
#include "closed_loop_noise.hpp"

#include "data/message.hpp"

#include <blockid/validation/trade_off.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>

namespace blockid::testing {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;

// Independent prototype, to 1e-5 of its figures in units of the largest noise.
TEST(TradeOff, ValuesOfAnIndependentPrototype) {
  const NoisySignals signals = trade_off_signals();
  const UncertaintyProgramme programme = uncertainty_programme({signals.v, signals.w, {}});
  const VectorXd relative = polynomial({.6, .8, 1.0, 2.0, 4.0, 8.0, 15.0, .5});
  const TradeOffCurve curve = trade_off_curve(programme, relative * signals.noise());
  const std::vector<double> falling = {15.0, 8.0, 4.0, 2.0, 1.0, .8, .6};
  const std::vector<double> alphas = {.0908449, .3265121, .5770193, .7343412, .8181498, .8353089, .8535599};
  ASSERT_EQ(curve.points.size(), 8U);
  for (std::size_t i = 0; i < alphas.size(); ++i) {
    EXPECT_NEAR(curve.points[i].alpha, alphas[i], 1e-5) << i;
    EXPECT_GE(curve.points[i].alpha_proven, curve.points[i].alpha * (1.0 - 1e-6)) << i;
    EXPECT_DOUBLE_EQ(curve.points[i].gamma, falling[i] * signals.noise());
  }
  EXPECT_EQ(curve.points.back().alpha, std::numeric_limits<double>::infinity());
  EXPECT_EQ(curve.points.back().status, ProgrammeStatus::cap_exceeded);
  EXPECT_NEAR(curve.least_noise / signals.noise(), .552680, 1e-5);
  // The elbow is where the curve turns up, between gamma*(0.9) = .555692 and the first flat point, .6.
  ASSERT_TRUE(curve.elbow.has_value());
  EXPECT_GT(curve.elbow->gamma / signals.noise(), .5527);
  EXPECT_LT(curve.elbow->gamma / signals.noise(), .6);
  EXPECT_LE(curve.elbow->elasticity(), 1.0);
}

TEST(TradeOff, NoiseOverUncertaintyOfAnIndependentPrototype) {
  const NoisySignals signals = trade_off_signals();
  const UncertaintyProgramme programme = uncertainty_programme({signals.v, signals.w, {}});
  const std::vector<std::array<double, 2>> pairs = {{.25, 9.782459}, {.5, 5.064237}, {.75, 1.810951}, {.9, .555692},
                                                    {1.0, .552680},  {1.5, .547907}, {4.0, .542782}};
  for (const auto& [alpha, gamma] : pairs) {
    EXPECT_NEAR(smallest_gamma(programme, alpha).value / signals.noise(), gamma, 1e-5) << alpha;
  }
}

// Between neighbours the secant lies between the slopes of a convex curve.
TEST(TradeOff, SlopesAreThoseOfTheCurve) {
  const CrowderLoop crowder;
  const NoisySignals signals = noisy_signals(crowder.ok(), crowder.plant, normal_reference(60), 0.05, 77);
  const TradeOffCurve curve = trade_off_curve(uncertainty_programme({signals.v, signals.w, {}}));
  ASSERT_EQ(curve.points.size(), 12U);
  for (std::size_t i = 1; i < curve.points.size(); ++i) {
    const TradeOffPoint& right = curve.points[i - 1];
    const TradeOffPoint& left = curve.points[i];
    ASSERT_TRUE(std::isfinite(left.alpha)) << i;
    const double secant = (right.alpha - left.alpha) / (right.gamma - left.gamma);
    // The slopes come from duals at a relative gap of 1e-7: good to its root.
    EXPECT_GE(right.slope, secant * (1.0 + 1e-3)) << i;
    EXPECT_LE(left.slope, secant * (1.0 - 1e-3)) << i;
  }
  EXPECT_GT(curve.points.back().gamma, curve.noise_floor);
  EXPECT_LT(curve.points.front().gamma, signals.w.cwiseAbs().maxCoeff());
}

TEST(TradeOff, MistakesAreNamed) {
  const VectorXd one = VectorXd::Ones(1);
  const UncertaintyProgramme programme = uncertainty_programme({one, one, {}});
  EXPECT_THAT(message_of([&] { trade_off_curve(programme, VectorXd()); }), HasSubstr("at least one noise bound"));
  EXPECT_THAT(message_of([&] { trade_off_curve(programme, 1); }), HasSubstr("at least 2 points, got 1"));
  EXPECT_THAT(message_of([&] {
                trade_off_curve(uncertainty_programme({one, 0.0 * one, {}}), 4);
              }),
              HasSubstr("w is zero"));
}

}  // namespace
}  // namespace blockid::testing
