// Laws of the closed-loop tests on plants of known uncertainty: nothing true is invalidated, what can be seen is.
#include "uncertain_plants.hpp"

#include <blockid/validation/verdict.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

NoisySignals signals_of(const KnownUncertainty& uncertainty, Index count, double relative, std::uint32_t seed) {
  const UncertainLoop loop = CrowderLoop{}.ok();
  return uncertain_signals(loop, uncertainty.delta, normal_reference(count, seed), relative, 1000 + seed);
}

// w = Delta v + delta for v and w of u and y. Some ten roundings a sample at 1e-16 of signals below 4, passed on less
// than 250 times.
TEST(VerdictLaws, SignalsAreThoseOfTheUncertainty) {
  for (const double norm : {0.9, 2.0}) {
    for (const KnownUncertainty& uncertainty : uncertainties(norm)) {
      const NoisySignals signals = signals_of(uncertainty, 300, 0.05, 1);
      const VectorXd left = signals.w - filter(uncertainty.delta, signals.v) - signals.delta;
      EXPECT_LT(left.cwiseAbs().maxCoeff(), 1e-12) << uncertainty.name;
    }
  }
}

// |T_Delta| of 200 samples, by an independent prototype, to its printed digits. (The zeros of its resonant filter are
// not recorded: one at 1 gives these figures and, within their spread, the medians of its bounds.)
TEST(VerdictLaws, VisibleNormsOfAnIndependentPrototype) {
  for (const auto& [norm, shown] : {std::array<double, 2>{0.5, .495}, {0.9, .891}, {1.1, 1.089}, {2.0, 1.980}}) {
    EXPECT_NEAR(visible_norm(low_pass(norm).delta, 200), shown, 1e-3) << norm;
  }
  for (const auto& [norm, shown] : {std::array<double, 2>{0.5, .457}, {0.9, .823}, {1.1, 1.005}, {2.0, 1.828}}) {
    EXPECT_NEAR(visible_norm(resonant(norm).delta, 200), shown, 1e-3) << norm;
  }
  for (const auto& [norm, shown] : {std::array<double, 2>{0.5, .499}, {0.9, .898}, {1.1, 1.097}, {2.0, 1.995}}) {
    EXPECT_NEAR(visible_norm(high_pass(norm).delta, 200), shown, 1e-3) << norm;
  }
  EXPECT_NEAR(visible_norm(all_pass(1.1).delta, 200), 1.1, 1e-3);
}

// Without noise and from rest the closed form sees what there is to see.
TEST(VerdictLaws, WithoutNoiseTheVisibleNormDecides) {
  for (const double norm : {0.5, 0.9, 1.1, 2.0}) {
    for (const KnownUncertainty& uncertainty : uncertainties(norm)) {
      for (const Index count : {50, 100}) {
        SCOPED_TRACE(::testing::Message() << uncertainty.name << " " << norm << ", " << count << " samples");
        const NoisySignals signals = signals_of(uncertainty, count, 0.0, 2);
        const double visible = visible_norm(uncertainty.delta, count);
        const double bound = noise_free_bound(signals.v, signals.w);
        // Both are norms of matrices that rounding changes by a relative 1e-13, some hundred units.
        EXPECT_LE(bound, visible * (1.0 + 1e-9));
        EXPECT_LE(schur_bound(signals.v, signals.w), visible * (1.0 + 1e-9));
        EXPECT_LE(running_bound(signals.v, signals.w)[count - 1], bound * (1.0 + 1e-9));
        EXPECT_TRUE(visible <= 1.0 + 1e-3 || bound > 1.0 + 1e-6) << bound;
      }
    }
  }
}

// Table of an independent prototype, medians over references, alpha_tau at 50, 100 and 200 samples. One reference
// differs from the median by what tau takes away, so that only the first digits are the same.
TEST(VerdictLaws, BoundsWithoutNoiseOfAnIndependentPrototype) {
  const auto bound = [](const KnownUncertainty& uncertainty, Index count) {
    const NoisySignals signals = signals_of(uncertainty, count, 0.0, 3);
    return noise_free_bound(signals.v, signals.w);
  };
  EXPECT_NEAR(bound(low_pass(1.1), 50), .981, 0.005);
  EXPECT_NEAR(bound(low_pass(1.1), 100), 1.060, 0.005);
  EXPECT_NEAR(bound(low_pass(1.1), 200), 1.089, 0.005);
}

// 1008 records of 50 samples from rest: 4 uncertainties, 2 norms, 3 sizes of noise, 42 references, gamma = max|delta|.
// A verdict is a proof, so that not one may be wrong; and the optimum exists, so that not one may be undecided.
TEST(VerdictLaws, NothingTrueIsInvalidatedFromRest) {
  int runs = 0;
  for (const double norm : {0.5, 0.9}) {
    for (const KnownUncertainty& uncertainty : uncertainties(norm)) {
      for (const double relative : {0.01, 0.05, 0.2}) {
        for (std::uint32_t seed = 1; seed <= 42; ++seed, ++runs) {
          const NoisySignals signals = signals_of(uncertainty, 50, relative, seed);
          const UncertaintyVerdict verdict = judge_uncertainty({signals.v, signals.w, {}}, signals.noise());
          EXPECT_EQ(verdict.verdict, Verdict::not_invalidated)
              << uncertainty.name << " " << norm << " " << relative << " " << seed << ": " << verdict.evidence;
        }
      }
    }
  }
  EXPECT_EQ(runs, 1008);
}

// Windows with their whole past, of norm 0.98.
TEST(VerdictLaws, NothingTrueIsInvalidatedInAWindow) {
  for (const KnownUncertainty& uncertainty : uncertainties(0.98)) {
    for (std::uint32_t seed = 1; seed <= 20; ++seed) {
      const NoisySignals signals = signals_of(uncertainty, 70, 0.01, seed);
      for (const Index first : {1, 10, 30}) {
        const UncertaintyVerdict verdict =
            judge_uncertainty(cut_window(signals.v, signals.w, first, 40, first), signals.noise());
        EXPECT_EQ(verdict.verdict, Verdict::not_invalidated) << uncertainty.name << " " << seed << " " << first;
      }
    }
  }
}

// What the programme and the corrected closed form prove is below the truth.
TEST(VerdictLaws, LowerBoundsAreBelowTheNorm) {
  for (const double norm : {0.5, 1.1, 2.0}) {
    for (const KnownUncertainty& uncertainty : uncertainties(norm)) {
      for (const double relative : {0.01, 0.1}) {
        SCOPED_TRACE(::testing::Message() << uncertainty.name << " " << norm << " " << relative);
        const NoisySignals signals = signals_of(uncertainty, 40, relative, 4);
        const double gamma = signals.noise();
        const ProgrammeSolution solution = smallest_alpha(uncertainty_programme({signals.v, signals.w, {}}), gamma);
        const double visible = visible_norm(uncertainty.delta, 40);
        EXPECT_LE(solution.lower_bound, visible);
        EXPECT_LE(solution.value, visible * (1.0 + 1e-6));
        // The closed form bounds |T_delta| alone, which is less than to know each sample.
        EXPECT_LE(noise_corrected_bound(signals.v, signals.w, gamma), solution.value * (1.0 + 1e-6));
      }
    }
  }
}

int invalidated(const KnownUncertainty& uncertainty, Index count, double relative) {
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const NoisySignals signals = signals_of(uncertainty, count, relative, seed);
    const Verdict verdict = judge_uncertainty({signals.v, signals.w, {}}, signals.noise()).verdict;
    EXPECT_NE(verdict, Verdict::undecided) << uncertainty.name << " " << seed;
    found += verdict == Verdict::invalidated ? 1 : 0;
  }
  return found;
}

// Cells of the prototype's table that are 100 % or 0 % of 40 references: ours are other references.
TEST(VerdictLaws, TooMuchUncertaintyIsFoundWhereThereIsInformation) {
  EXPECT_EQ(invalidated(all_pass(1.1), 50, 0.01), 10);
  EXPECT_EQ(invalidated(all_pass(1.1), 50, 0.05), 10);
  EXPECT_EQ(invalidated(all_pass(2.0), 50, 0.2), 10);
  EXPECT_EQ(invalidated(low_pass(2.0), 50, 0.05), 10);
  EXPECT_EQ(invalidated(high_pass(2.0), 50, 0.01), 10);
  EXPECT_EQ(invalidated(resonant(2.0), 100, 0.01), 10);
  EXPECT_EQ(invalidated(resonant(1.1), 50, 0.01), 0);
  EXPECT_EQ(invalidated(low_pass(1.1), 50, 0.05), 0);
  EXPECT_EQ(invalidated(high_pass(1.1), 50, 0.05), 0);
}

double least_alpha(const UncertaintyWindow& window, double gamma) {
  return smallest_alpha(uncertainty_programme(window), gamma).value;
}

// The programme ends at a relative gap of 1e-7: comparisons of two of its values hold to 1e-6.
constexpr double kGap = 1e-6;

TEST(VerdictLaws, LongerRecordsNeedNoLess) {
  const NoisySignals signals = signals_of(low_pass(1.1), 60, 0.02, 5);
  double before = 0.0;
  for (const Index count : {10, 20, 30, 45, 60}) {
    const double alpha = least_alpha(cut_window(signals.v, signals.w, 0, count, 0), signals.noise());
    EXPECT_GE(alpha, before * (1.0 - kGap)) << count;
    before = alpha;
  }
  EXPECT_GT(before, 0.5);
}

TEST(VerdictLaws, LargerTauGivesNoMore) {
  const NoisySignals signals = signals_of(low_pass(1.1), 60, 0.0, 5);
  double before = std::numeric_limits<double>::infinity();
  for (const double tau : {1e-9, 1e-8, 1e-6, 1e-4, 1e-2, 1.0}) {
    const double bound = noise_free_bound(signals.v, signals.w, tau);
    EXPECT_LE(bound, before * (1.0 + 1e-9)) << tau;
    before = bound;
  }
}

// A window leaves the samples of w before it open, which the whole record does not.
TEST(VerdictLaws, WholeRecordNeedsNoLessThanItsLastWindow) {
  const NoisySignals signals = signals_of(all_pass(1.1), 60, 0.02, 6);
  const double whole = least_alpha(cut_window(signals.v, signals.w, 0, 60, 0), signals.noise());
  for (const Index first : {10, 20, 40}) {
    EXPECT_LE(least_alpha(cut_window(signals.v, signals.w, first, 60 - first, first), signals.noise()),
              whole * (1.0 + kGap));
  }
}

// Zeros before both signals add a row and a column to T_h that nothing asks anything of.
TEST(VerdictLaws, CommonDelayChangesNothing) {
  const NoisySignals signals = signals_of(low_pass(1.1), 40, 0.02, 7);
  VectorXd v = VectorXd::Zero(45);
  VectorXd w = VectorXd::Zero(45);
  v.tail(40) = signals.v;
  w.tail(40) = signals.w;
  const double gamma = signals.noise();
  const double alpha = least_alpha({signals.v, signals.w, {}}, gamma);
  EXPECT_NEAR(least_alpha({v, w, {}}, gamma), alpha, kGap * alpha);
  const double bound = noise_free_bound(signals.v, signals.w);
  EXPECT_NEAR(noise_free_bound(v, w), bound, 1e-9 * bound);
}

TEST(VerdictLaws, NoiseAndUncertaintyAreInverse) {
  for (const double norm : {0.9, 1.1}) {
    const NoisySignals signals = signals_of(resonant(norm), 50, 0.05, 8);
    const UncertaintyProgramme programme = uncertainty_programme({signals.v, signals.w, {}});
    for (const double factor : {0.8, 1.0, 2.0}) {
      const double gamma = factor * signals.noise();
      const ProgrammeSolution solution = smallest_alpha(programme, gamma);
      if (solution.status != ProgrammeStatus::converged) continue;
      // d gamma = d alpha / |slope|, at a relative 1e-7 of alpha, and the gap of the second programme.
      const double tolerance = 1e-7 * solution.value / std::abs(solution.slope) + 1e-6 * gamma;
      EXPECT_NEAR(smallest_gamma(programme, solution.value).value, gamma, tolerance) << norm << " " << factor;
    }
  }
}

}  // namespace
}  // namespace blockid::testing
