// The noise bound from a run without reference and from a bound of the disturbance.
#include "closed_loop_noise.hpp"

#include "data/message.hpp"

#include <blockid/validation/noise_estimate.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

TEST(NoiseEstimates, QuietRunShowsTheNoise) {
  const CrowderLoop crowder;
  const VectorXd d = 0.01 * normal_reference(400, 3);
  const VectorXd zero = VectorXd::Zero(400);
  const ClosedLoopRecord quiet = simulate_closed_loop(crowder.plant, crowder.controller, zero, d);
  const NoiseEstimate estimate = noise_from_quiet_run(crowder.ok(), quiet.u, quiet.y);
  // delta = s_C d_P / chi d with the true plant: (1 - p q)(1 - q) / ((1 - q)^2 + Ts q (c1 + c0 q)).
  const VectorXd chi = characteristic_polynomial(
      {trivial_factors(crowder.plant), trivial_factors(crowder.controller), CrowderLoop::weight(1.0)});
  const VectorXd delta = filter({polynomial({1.0, -1.0 - crowder.p, crowder.p}), chi}, d);
  EXPECT_NEAR(estimate.largest, delta.cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_DOUBLE_EQ(estimate.gamma, 1.2 * estimate.largest);
  EXPECT_LT(estimate.reference, 1e-12);
}

// No disturbance leaves more than the gain times its size, and the signs of the reversed response leave just that.
TEST(NoiseEstimates, DisturbanceGainIsAttained) {
  const CrowderLoop crowder;
  const UncertainLoop loop = crowder.ok();
  const double gain = disturbance_gain(loop, crowder.plant);
  const Index count = 1200;
  const VectorXd zero = VectorXd::Zero(count);
  const auto noise = [&](const VectorXd& d) {
    const ClosedLoopRecord run = simulate_closed_loop(crowder.plant, crowder.controller, zero, d);
    return uncertainty_output(loop, run.u, run.y);
  };
  const VectorXd response = noise(VectorXd::Unit(count, 0));
  const VectorXd worst = response.reverse().unaryExpr([](double g) { return g < 0.0 ? -1.0 : 1.0; });
  // 0.951^1200 is below 1e-26; a thousand terms of rounding 1e-16.
  EXPECT_NEAR(noise(worst)[count - 1], gain, 1e-12 * gain);
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const VectorXd d = normal_reference(count, seed);
    EXPECT_LE(noise(d).cwiseAbs().maxCoeff(), gain * d.cwiseAbs().maxCoeff());
  }
}

// h_k = gain pole^k and v of one sign and size reach the bound, all of the past being unrecorded: w at the t-th sample
// is what the recorded part leaves, and the geometric series of the rest.
TEST(NoiseEstimates, UnrecordedPastIsBoundedByItsSeries) {
  const Index length = 400;  // 0.9^400 is below 1e-18
  const Index past = 5;
  const Index count = 8;
  const VectorXd v = VectorXd::Constant(length + past + count, 2.0);
  const VectorXd w = filter({polynomial({0.3}), polynomial({1.0, -0.9})}, v);
  const VectorXd recorded = filter({polynomial({0.3}), polynomial({1.0, -0.9})}, v.tail(past + count));
  const VectorXd bound = unrecorded_past_bound(2.0, 0.3, 0.9, past, count);
  EXPECT_LT((w.tail(count) - recorded.tail(count) - bound).cwiseAbs().maxCoeff(), 1e-13);  // some units of 6
  EXPECT_THAT(message_of([] { unrecorded_past_bound(-1.0, 1.0, 0.5, 0, 1); }), HasSubstr("got -1 and 1"));
  EXPECT_THAT(message_of([] { unrecorded_past_bound(1.0, 1.0, 1.0, 0, 1); }), HasSubstr("below 1, got 1"));
  EXPECT_THAT(message_of([] { unrecorded_past_bound(1.0, 1.0, 0.5, -1, 1); }), HasSubstr("got -1 and 1"));
}

TEST(NoiseEstimates, MistakesAreNamed) {
  const CrowderLoop crowder;
  const VectorXd zero = VectorXd::Zero(50);
  const ClosedLoopRecord driven = simulate_closed_loop(crowder.plant, crowder.controller, normal_reference(50), zero);
  const UncertainLoop loop = crowder.ok();
  EXPECT_THAT(message_of([&] { noise_from_quiet_run(loop, driven.u, driven.y); }), HasSubstr("without reference"));
  EXPECT_THAT(message_of([&] { noise_from_quiet_run(loop, zero, zero, 0.9); }), HasSubstr("at least 1, got 0.9"));
  EXPECT_THAT(message_of([&] { noise_from_quiet_run(loop, VectorXd(), VectorXd()); }), HasSubstr("one sample"));
  const DiscreteTransferFunction runaway{polynomial({0.0, -0.1}), polynomial({1.0, -1.0})};
  EXPECT_THAT(message_of([&] { disturbance_gain(loop, runaway); }), HasSubstr("stabilises"));
}

}  // namespace
}  // namespace blockid::testing
