// From a simulated loop of several inputs and outputs to the verdict: nothing true is invalidated, what shows is.
#include "mimo_loops.hpp"

#include "data/message.hpp"

#include <blockid/validation/mimo_verdict.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

struct NoisyRecord {
  MimoSignals signals;
  double noise = 0.0;  ///< max |delta|
};

/// u and y of the loop with an all-pass uncertainty of that norm, and what they give; d uniform, scaled to
/// max|delta| = relative max|w without noise|.
NoisyRecord noisy(const MimoLoop& loop, double norm, Index count, double relative, std::uint32_t seed) {
  const Index m = loop.plant.inputs();
  const Index p = loop.plant.outputs();
  const DiscreteStateSpace delta = all_pass_uncertainty(p, m, norm, seed);
  std::mt19937 generator(seed);
  const MatrixXd r = normal_matrix(m, count, seed);
  const MatrixXd d = MatrixXd::NullaryExpr(p, count, [&] { return 2.0 * problems::uniform(generator) - 1.0; });
  const double unit = simulate_uncertain_loop(loop, delta, 0.0 * r, d).delta.cwiseAbs().maxCoeff();
  const double clean = simulate_uncertain_loop(loop, delta, r, 0.0 * d).signals.w.cwiseAbs().maxCoeff();
  const MimoUncertainRecord run = simulate_uncertain_loop(loop, delta, r, relative * clean / unit * d);
  return {uncertainty_signals(loop, run.record.u, run.record.y), run.delta.cwiseAbs().maxCoeff()};
}

Verdict verdict_of(const NoisyRecord& record) {
  return judge_mimo_uncertainty(record.signals.v, record.signals.w, record.noise).verdict;
}

class MimoVerdicts : public ::testing::TestWithParam<MimoLoop (*)()> {
 protected:
  const MimoLoop loop_ = GetParam()();
};

// 1080 records from rest over the three loops, gamma = max|delta|: not one may be wrong, not one may stay open.
TEST_P(MimoVerdicts, NothingTrueIsInvalidated) {
  for (const double norm : {0.5, 0.9, 0.99}) {
    for (const double relative : {0.01, 0.1}) {
      for (std::uint32_t seed = 1; seed <= 60; ++seed) {
        EXPECT_EQ(verdict_of(noisy(loop_, norm, 20, relative, seed)), Verdict::not_invalidated)
            << norm << " " << relative << " " << seed;
      }
    }
  }
}

TEST_P(MimoVerdicts, NothingTrueIsInvalidatedInAWindow) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const NoisyRecord record = noisy(loop_, 0.95, 26, 0.02, seed);
    const MimoVerdict verdict = judge_mimo_uncertainty(record.signals.v, record.signals.w.rightCols(16), record.noise);
    EXPECT_EQ(verdict.verdict, Verdict::not_invalidated) << seed << verdict.evidence;
  }
}

int invalidated(const MimoLoop& loop, double norm, Index count, double relative) {
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const Verdict verdict = verdict_of(noisy(loop, norm, count, relative, seed));
    EXPECT_NE(verdict, Verdict::undecided);
    found += verdict == Verdict::invalidated ? 1 : 0;
  }
  return found;
}

// A gain above one at all frequencies shows as soon as the noise is small beside it.
TEST_P(MimoVerdicts, TooMuchUncertaintyIsFoundWhereThereIsInformation) {
  EXPECT_EQ(invalidated(loop_, 2.0, 40, 0.001), 10);
  EXPECT_EQ(invalidated(loop_, 3.0, 40, 0.01), 10);
  EXPECT_EQ(invalidated(loop_, 1.1, 12, 0.3), 0);
}

// Without noise the closed form rises to the norm from below.
TEST_P(MimoVerdicts, ClosedFormFromTheSignalsStaysBelowTheNorm) {
  for (const double norm : {0.9, 1.2}) {
    double before = 0.0;
    const NoisyRecord record = noisy(loop_, norm, 80, 0.0, 31);
    for (const Index count : {10, 20, 40, 80}) {
      const double bound = mimo_noise_free_bound(record.signals.v.leftCols(count), record.signals.w.leftCols(count));
      EXPECT_LE(bound, norm * (1.0 + 1e-6));
      EXPECT_GE(bound, before * (1.0 - 1e-9));
      before = bound;
    }
    EXPECT_GT(before, 0.9 * norm);
  }
}

// What the verdict rests on, computed here once more.
TEST_P(MimoVerdicts, SaysWhatOutputAndCertificateShow) {
  const NoisyRecord fits = noisy(loop_, 0.9, 24, 0.05, 32);
  const MimoVerdict yes = judge_mimo_uncertainty(fits.signals.v, fits.signals.w, fits.noise);
  EXPECT_LE(yes.alpha_attained, 1.0 + 1e-9);
  EXPECT_LE((fits.signals.w - yes.output).cwiseAbs().maxCoeff(), fits.noise);
  EXPECT_THAT(yes.evidence, HasSubstr("gain one or less leaves at most"));
  const NoisyRecord does_not = noisy(loop_, 2.5, 40, 0.001, 33);
  const MimoVerdict no = judge_mimo_uncertainty(does_not.signals.v, does_not.signals.w, does_not.noise);
  EXPECT_EQ(no.verdict, Verdict::invalidated);
  EXPECT_GT(no.alpha_proven, 1.0);
  EXPECT_LE(no.alpha_proven, 2.5);
  EXPECT_EQ(no.alpha_proven,
            certified_mimo_alpha(does_not.signals.v, does_not.signals.w, no.noise_bound, no.certificate, 1e-6));
  EXPECT_THAT(no.evidence, HasSubstr("proven by a multiplier"));
}

INSTANTIATE_TEST_SUITE_P(Loops, MimoVerdicts, ::testing::Values(&integral_loop, &observer_loop, &tall_loop),
                         [](const auto& p) { return loop_name(p.index); });

// Both programmes answer the same question of one channel; the scalar one by the least noise, this by the least gain.
TEST(MimoVerdict, OneChannelIsTheScalarVerdict) {
  const CrowderLoop crowder;
  for (const double k : {0.9, 0.6, 0.4}) {
    const UncertaintySignals signals = crowder_signals(crowder.loop(k), 60);
    for (const double share : {1e-2, 1e-1}) {
      const double gamma = share * signals.w.cwiseAbs().maxCoeff();
      const Verdict scalar = judge_uncertainty({signals.v, signals.w, {}}, gamma).verdict;
      const MimoVerdict matrix = judge_mimo_uncertainty(signals.v.transpose(), signals.w.transpose(), gamma);
      EXPECT_EQ(matrix.verdict, scalar) << k << " " << share << " " << matrix.evidence;
    }
  }
}

TEST(MimoVerdict, NotesSayWhatIsDoubtful) {
  const NoisyRecord record = noisy(integral_loop(), 2.0, 40, 0.001, 34);
  MimoVerdictOptions options;
  options.from_rest = false;
  options.memory = 30;
  const MimoVerdict window =
      judge_mimo_uncertainty(record.signals.v.rightCols(30), record.signals.w.rightCols(25), record.noise, options);
  EXPECT_NE(window.verdict, Verdict::invalidated);
  EXPECT_TRUE(window.has(VerdictWarning::past_shorter_than_memory)) << window.evidence;
  MatrixXd early = record.signals.w;
  early.rightCols(39) = record.signals.w.leftCols(39);
  early.col(0).setConstant(1.0);
  MatrixXd late = record.signals.v;
  late.col(0).setZero();
  const MimoVerdict wrong = judge_mimo_uncertainty(late, early, record.noise);
  EXPECT_EQ(wrong.verdict, Verdict::invalidated);
  EXPECT_TRUE(wrong.has(VerdictWarning::noise_bound_too_small)) << wrong.evidence;
  const MimoVerdict raised = judge_mimo_uncertainty(record.signals.v, record.signals.w, 0.0);
  EXPECT_TRUE(raised.has(VerdictWarning::noise_bound_raised));
  EXPECT_GT(raised.noise_bound, 0.0);
  EXPECT_EQ(raised.verdict, Verdict::invalidated);
}

TEST(MimoVerdict, MistakesAreNamed) {
  const MatrixXd one = MatrixXd::Ones(2, 5);
  MimoVerdictOptions options;
  EXPECT_THAT(message_of([&] { judge_mimo_uncertainty(one, one, -1.0); }), HasSubstr("at least 0, got -1"));
  EXPECT_THAT(message_of([&] { judge_mimo_uncertainty(0.0 * one, one, 0.1); }), HasSubstr("v is zero"));
  EXPECT_THAT(message_of([&] { judge_mimo_uncertainty(MatrixXd(), one, 0.1); }), HasSubstr("got none"));
  options.from_rest = false;
  EXPECT_THAT(message_of([&] { judge_mimo_uncertainty(one, one, 0.1, options); }), HasSubstr("needs the memory"));
  options = {};
  options.absurd_alpha = 1.0;
  EXPECT_THAT(message_of([&] { judge_mimo_uncertainty(one, one, 0.1, options); }), HasSubstr("absurd alpha above 1"));
}

}  // namespace
}  // namespace blockid::testing
