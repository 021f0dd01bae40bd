// Verdicts of three values: both sides on published records, warnings, evidence, errors.
#include "closed_loop_noise.hpp"

#include "data/message.hpp"

#include <blockid/data/error.hpp>
#include <blockid/validation/noise_free_bound.hpp>
#include <blockid/validation/verdict.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

/// Of the records without noise.
double size_of_w() { return crowder_signals(CrowderLoop{}.ok()).w.cwiseAbs().maxCoeff(); }

UncertaintyWindow window_of(const UncertainLoop& loop, Index first, Index past, Index count = 200) {
  const UncertaintySignals signals = crowder_signals(loop);
  return cut_window(signals.v, signals.w, first, count, past);
}

TEST(Verdict, BothSidesOnRecordsFromRest) {
  const CrowderLoop crowder;
  const double gamma = 1e-3 * size_of_w();
  const UncertaintyVerdict good = judge_uncertainty(window_of(crowder.ok(), 0, 0), gamma);
  EXPECT_EQ(good.verdict, Verdict::not_invalidated) << good.evidence;
  EXPECT_TRUE(good.notes.empty());
  EXPECT_LE(good.noise_needed, gamma);
  EXPECT_LE(toeplitz_norm(good.h), 1.0 + 1e-9);
  EXPECT_THAT(good.evidence, HasSubstr("leaves at most"));

  const UncertaintyWindow window = window_of(crowder.tight(), 0, 0);
  const UncertaintyVerdict bad = judge_uncertainty(window, gamma);
  EXPECT_EQ(bad.verdict, Verdict::invalidated) << bad.evidence;
  EXPECT_TRUE(bad.notes.empty());
  EXPECT_GT(bad.noise_proven, gamma);
  // The optimum, of an independent prototype: 0.01743925.
  EXPECT_LT(bad.noise_proven, 0.0174393 * size_of_w());
  EXPECT_GT(bad.alpha_proven, 1.0);
  EXPECT_LT(bad.alpha_proven, 1.0612001);
  EXPECT_EQ(bad.noise_proven, certified_gamma(uncertainty_programme(window), 1.0, bad.certificate));
  EXPECT_THAT(bad.evidence, HasSubstr("proven by multipliers"));
}

TEST(Verdict, ToTheEndGivesTheLeastNoise) {
  VerdictOptions options;
  options.to_the_end = true;
  const UncertaintyVerdict verdict =
      judge_uncertainty(window_of(CrowderLoop{}.tight(), 0, 0), 1e-3 * size_of_w(), options);
  EXPECT_EQ(verdict.verdict, Verdict::invalidated);
  EXPECT_NEAR(verdict.noise_proven, 0.01743925 * size_of_w(), 1e-6 * size_of_w());
  EXPECT_NEAR(verdict.noise_needed, 0.01743925 * size_of_w(), 1e-6 * size_of_w());
}

TEST(Verdict, WithoutNoiseTheBoundIsRaisedToTheRounding) {
  const CrowderLoop crowder;
  const UncertaintyVerdict good = judge_uncertainty(window_of(crowder.ok(), 0, 0), 0.0);
  EXPECT_EQ(good.verdict, Verdict::not_invalidated) << good.evidence;
  EXPECT_TRUE(good.has(VerdictWarning::noise_bound_raised));
  EXPECT_GT(good.noise_bound, 0.0);
  EXPECT_EQ(judge_uncertainty(window_of(crowder.tight(), 0, 0), 0.0).verdict, Verdict::invalidated);
  EXPECT_EQ(judge_uncertainty(window_of(crowder.trivial(), 0, 0), 0.0).verdict, Verdict::invalidated);
}

// From an independent prototype: with 20 samples of the past gamma*(1) is 0.00679 max|w|, with the whole past zero.
TEST(Verdict, PastShorterThanTheMemoryProvesNothing) {
  const UncertainLoop loop = CrowderLoop{}.ok();
  const double gamma = 1e-3 * size_of_w();
  VerdictOptions options;
  options.memory = uncertainty_memory(loop);
  const UncertaintyVerdict cut = judge_uncertainty(window_of(loop, 299, 20), gamma, options);
  EXPECT_EQ(cut.verdict, Verdict::undecided) << cut.evidence;
  EXPECT_TRUE(cut.has(VerdictWarning::past_shorter_than_memory));
  EXPECT_EQ(judge_uncertainty(window_of(loop, 299, 100), gamma, options).verdict, Verdict::not_invalidated);
  // What is not contradicted with a short past is not contradicted.
  const UncertaintyVerdict free = judge_uncertainty(window_of(loop, 299, 20), 10.0 * gamma, options);
  EXPECT_EQ(free.verdict, Verdict::not_invalidated);
  EXPECT_TRUE(free.notes.empty());
}

// Poles of the loop at modulus 0.951 (two), the weight has its zeros at 0: 0.951^91 > 0.01 > 0.951^92.
TEST(Verdict, MemoryIsThatOfTheSlowestRoot) {
  const UncertainLoop loop = CrowderLoop{}.ok();
  const double radius = spectral_radius(characteristic_polynomial(loop));
  const Index memory = uncertainty_memory(loop);
  EXPECT_LE(std::pow(radius, memory), 0.01);
  EXPECT_GT(std::pow(radius, memory - 1), 0.01);
  UncertainLoop slow_weight = loop;
  slow_weight.weight = {polynomial({1.0, -0.99}), polynomial({1.0})};
  EXPECT_EQ(uncertainty_memory(slow_weight, 0.5), 69);  // 0.99^68 = 0.5049, 0.99^69 = 0.4998
  const UncertainLoop fir{{polynomial({1.0}), polynomial({1.0}), polynomial({1.0})},
                          {polynomial({1.0}), polynomial({1.0}), polynomial({1.0})},
                          {polynomial({1.0}), polynomial({1.0})}};
  EXPECT_EQ(uncertainty_memory(fir), 0);
  EXPECT_THROW(uncertainty_memory(loop, 1.0), Error);
}

// Independent prototype: gamma*(1) = 0.55268 max|delta|, and below 0.5 max|delta| no alpha up to 1024 explains it.
TEST(Verdict, NoiseBoundBelowTheNoiseIsNamed) {
  const NoisySignals signals = trade_off_signals();
  EXPECT_NEAR(signals.noise(), .0053758483, 1e-10);
  EXPECT_NEAR(signals.w.cwiseAbs().maxCoeff(), .1095808121, 1e-10);
  const UncertaintyWindow window = cut_window(signals.v, signals.w, 0, 200, 0);
  EXPECT_EQ(judge_uncertainty(window, 1.0 * signals.noise()).verdict, Verdict::not_invalidated);
  EXPECT_EQ(judge_uncertainty(window, 0.56 * signals.noise()).verdict, Verdict::not_invalidated);
  const UncertaintyVerdict low = judge_uncertainty(window, 0.5 * signals.noise());
  EXPECT_EQ(low.verdict, Verdict::invalidated);
  EXPECT_TRUE(low.has(VerdictWarning::noise_bound_too_small)) << low.evidence;
}

TEST(Verdict, OutputBeforeInputIsNamed) {
  VectorXd v = VectorXd::Zero(20);
  v[10] = 1.0;
  const UncertaintyVerdict verdict = judge_uncertainty({v, VectorXd::Unit(20, 3), {}}, 0.1);
  EXPECT_EQ(verdict.verdict, Verdict::invalidated) << verdict.evidence;
  ASSERT_TRUE(verdict.has(VerdictWarning::output_before_input));
  EXPECT_THAT(verdict.notes.front().text, HasSubstr("Sample 3"));
}

TEST(Verdict, NothingIsDecidedWithoutIterations) {
  VerdictOptions options;
  options.programme.max_iterations = 0;
  const UncertaintyVerdict verdict =
      judge_uncertainty(window_of(CrowderLoop{}.tight(), 0, 0), 1e-3 * size_of_w(), options);
  EXPECT_EQ(verdict.verdict, Verdict::undecided);
  EXPECT_THAT(verdict.evidence, HasSubstr("not settled"));
}

// The long record of set "tight" contradicts, its first 20 samples do not; a second experiment brings it back.
TEST(Verdict, ExperimentsAreJudgedTogether) {
  const UncertainLoop loop = CrowderLoop{}.tight();
  const double gamma = 1e-3 * size_of_w();
  const UncertaintyWindow first = window_of(loop, 0, 0, 20);
  EXPECT_EQ(judge_uncertainty(first, gamma).verdict, Verdict::not_invalidated);
  const std::vector<UncertaintyWindow> both = {first, window_of(loop, 0, 0)};
  EXPECT_EQ(judge_uncertainty(both, gamma).verdict, Verdict::invalidated);
}

// Half of the samples spoilt and left out, or allowed any noise by their shape: the truth still explains the rest.
TEST(Verdict, SpoiltSamplesAreLeftOut) {
  const UncertainLoop loop = CrowderLoop{}.ok();
  const double gamma = 1e-3 * size_of_w();
  UncertaintyWindow spoilt = window_of(loop, 0, 0, 100);
  UncertaintyWindow missing = spoilt;
  UncertaintyWindow shaped = spoilt;
  shaped.shape = VectorXd::Ones(100);
  for (Index t = 0; t < 100; t += 7) {
    spoilt.w[t] += 0.1;
    missing.w[t] = std::numeric_limits<double>::quiet_NaN();
    shaped.w[t] += 0.1;
    shaped.shape[t] = 0.101 / gamma;
  }
  EXPECT_EQ(judge_uncertainty(spoilt, gamma).verdict, Verdict::invalidated);
  EXPECT_EQ(judge_uncertainty(missing, gamma).verdict, Verdict::not_invalidated);
  EXPECT_EQ(judge_uncertainty(shaped, gamma).verdict, Verdict::not_invalidated);
}

TEST(Verdict, WindowsAreCutWithTheirPast) {
  const VectorXd v = VectorXd::LinSpaced(10, 0.0, 9.0);
  const VectorXd w = 10.0 * v;
  const UncertaintyWindow window = cut_window(v, w, 4, 3, 2, v.array() + 1.0);
  EXPECT_EQ(window.v, v.segment(2, 5));
  EXPECT_EQ(window.w, w.segment(4, 3));
  EXPECT_EQ(window.shape, (v.array() + 1.0).matrix().segment(4, 3));
  EXPECT_FALSE(window.from_rest);
  EXPECT_TRUE(cut_window(v, w, 4, 3, 4).from_rest);
  EXPECT_THROW(cut_window(v, w, 4, 3, 5), Error);
  EXPECT_THROW(cut_window(v, w, 4, 7, 0), Error);
  EXPECT_THROW(cut_window(v, w, 4, 0, 0), Error);
  EXPECT_THROW(cut_window(v, w.head(9), 4, 3, 0), Error);
  EXPECT_THROW(cut_window(v, w, 4, 3, 0, VectorXd::Ones(3)), Error);
}

TEST(Verdict, MistakesAreNamed) {
  const VectorXd one = VectorXd::Ones(1);
  const UncertaintyWindow window{one, one, {}};
  EXPECT_THAT(message_of([&] {
                judge_uncertainty({VectorXd::Zero(3), VectorXd::Ones(3), {}}, 0.1);
              }),
              HasSubstr("v is zero"));
  EXPECT_THAT(message_of([&] { judge_uncertainty(window, -1.0); }), HasSubstr("noise bound of at least 0, got -1"));
  UncertaintyWindow cut = window;
  cut.from_rest = false;
  EXPECT_THAT(message_of([&] { judge_uncertainty(cut, 0.1); }), HasSubstr("memory"));
  VerdictOptions options;
  options.absurd_alpha = 1.0;
  EXPECT_THAT(message_of([&] { judge_uncertainty(window, 0.1, options); }), HasSubstr("above 1, got 1"));
  options = {};
  options.memory = -1;
  EXPECT_THAT(message_of([&] { judge_uncertainty(window, 0.1, options); }), HasSubstr("got -1"));
  EXPECT_THAT(message_of([&] { judge_uncertainty(std::span<const UncertaintyWindow>(), 0.1); }),
              HasSubstr("at least one sample"));
  EXPECT_EQ(to_text(Verdict::invalidated), "invalidated");
  EXPECT_EQ(to_text(Verdict::not_invalidated), "not invalidated");
  EXPECT_EQ(to_text(Verdict::undecided), "undecided");
}

}  // namespace
}  // namespace blockid::testing
