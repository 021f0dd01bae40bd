// How many of 40 references invalidate a set, for uncertainties of known norm under noise of known size: the table of
// an independent prototype with other references.
#include "uncertain_plants.hpp"

#include <blockid/validation/verdict.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace blockid::testing {
namespace {

using Eigen::Index;

constexpr int kReferences = 40;
constexpr std::array<Index, 3> kCounts = {50, 100, 200};
constexpr std::array<double, 3> kNoise = {0.01, 0.05, 0.2};

struct Found {
  int invalidated = 0;
  int undecided = 0;
};

/// gamma = max|delta|; the whole record, or its second half with the first as the past.
Found found(const KnownUncertainty& uncertainty, Index count, double relative, bool second_half = false) {
  const UncertainLoop loop = CrowderLoop{}.ok();
  Found result;
  for (std::uint32_t seed = 1; seed <= kReferences; ++seed) {
    const NoisySignals signals =
        uncertain_signals(loop, uncertainty.delta, normal_reference(count, seed), relative, 1000 + seed);
    const Index first = second_half ? count / 2 : 0;
    const UncertaintyWindow window = cut_window(signals.v, signals.w, first, count - first, first);
    const Verdict verdict = judge_uncertainty(window, signals.noise()).verdict;
    result.invalidated += verdict == Verdict::invalidated ? 1 : 0;
    result.undecided += verdict == Verdict::undecided ? 1 : 0;
  }
  return result;
}

/// Two counts of 40 with one probability differ by at most 4 deviations of their difference; the probability from both,
/// with one success and one failure more, so that 0 and 40 have a deviation, too.
void expect_count(const Found& ours, double percent) {
  const double theirs = kReferences * percent / 100.0;
  const double share = (ours.invalidated + theirs + 1.0) / (2.0 * kReferences + 2.0);
  EXPECT_NEAR(ours.invalidated, theirs, 4.0 * std::sqrt(2.0 * kReferences * share * (1.0 - share)));
  EXPECT_EQ(ours.undecided, 0);
}

/// In percent, noise of 1, 5, 20 % by 50, 100, 200 samples; the last: samples 101 to 200, their past known, 1 %.
struct Row {
  KnownUncertainty uncertainty;
  std::array<std::array<double, 3>, 3> percent;
  double window;
};

std::string name_of(const ::testing::TestParamInfo<Row>& row) {
  std::string name = row.param.uncertainty.name + std::to_string(row.param.uncertainty.norm).substr(0, 3);
  std::erase_if(name, [](char c) { return c == '-' || c == '.'; });
  return name;
}

class Falsification : public ::testing::TestWithParam<Row> {};

TEST_P(Falsification, SharesOfAnIndependentPrototype) {
  for (std::size_t i = 0; i < kNoise.size(); ++i) {
    for (std::size_t j = 0; j < kCounts.size(); ++j) {
      SCOPED_TRACE(::testing::Message() << "noise " << kNoise[i] << ", " << kCounts[j] << " samples");
      expect_count(found(GetParam().uncertainty, kCounts[j], kNoise[i]), GetParam().percent[i][j]);
    }
  }
  expect_count(found(GetParam().uncertainty, 200, 0.01, true), GetParam().window);
}

constexpr std::array<double, 3> kNone = {0.0, 0.0, 0.0};
constexpr std::array<double, 3> kAll = {100.0, 100.0, 100.0};

INSTANTIATE_TEST_SUITE_P(
    Table, Falsification,
    ::testing::Values(Row{all_pass(1.1), {kAll, kAll, {8.0, 8.0, 2.0}}, 85.0},
                      Row{all_pass(2.0), {kAll, kAll, kAll}, 100.0}, Row{resonant(1.1), {kNone, kNone, kNone}, 0.0},
                      Row{resonant(2.0), {{{85.0, 100.0, 100.0}, {38.0, 98.0, 100.0}, {0.0, 52.0, 62.0}}}, 70.0},
                      Row{low_pass(1.1), {{{0.0, 2.0, 20.0}, kNone, kNone}}, 0.0},
                      Row{low_pass(2.0), {kAll, kAll, {78.0, 78.0, 82.0}}, 95.0},
                      Row{high_pass(1.1), {{{38.0, 62.0, 88.0}, kNone, kNone}}, 8.0},
                      Row{high_pass(2.0), {kAll, kAll, {38.0, 35.0, 25.0}}, 95.0}),
    name_of);

/// Without noise, by the closed form: percent invalidated, and medians of alpha_tau where the prototype has them.
struct CleanRow {
  KnownUncertainty uncertainty;
  std::array<double, 3> percent;
  std::array<double, 3> median;
};

/// Three deviations of the difference of two medians of 40, 1.25 sigma / sqrt(40) each, and half of the third decimal.
double median_spread(const std::vector<double>& values) {
  const Eigen::Map<const Eigen::ArrayXd> all(values.data(), static_cast<Index>(values.size()));
  const double deviation = std::sqrt((all - all.mean()).square().mean());
  return 3.0 * 1.25 * deviation * std::sqrt(2.0 / kReferences) + 5e-4;
}

TEST(CleanFalsification, SharesAndMediansWithoutNoise) {
  const double none = std::nan("");
  const std::array<double, 3> unknown = {none, none, none};
  const std::vector<CleanRow> rows = {{all_pass(0.5), kNone, {.5, .5, .5}},
                                      {all_pass(0.9), kNone, {.9, .9, .9}},
                                      {all_pass(1.1), kAll, {1.1, 1.1, 1.1}},
                                      {all_pass(2.0), kAll, {2.0, 2.0, 2.0}},
                                      {resonant(0.5), kNone, {.298, .392, .457}},
                                      {resonant(0.9), kNone, {.536, .706, .822}},
                                      {resonant(1.1), {0.0, 0.0, 82.0}, {.655, .863, 1.0047}},
                                      {resonant(2.0), kAll, {1.191, 1.569, 1.827}},
                                      {low_pass(0.9), kNone, unknown},
                                      {low_pass(1.1), {0.0, 100.0, 100.0}, {.981, 1.060, 1.089}},
                                      {low_pass(2.0), kAll, unknown},
                                      {high_pass(0.9), kNone, unknown},
                                      {high_pass(1.1), kAll, unknown},
                                      {high_pass(2.0), kAll, unknown}};
  const UncertainLoop loop = CrowderLoop{}.ok();
  for (const CleanRow& row : rows) {
    for (std::size_t j = 0; j < kCounts.size(); ++j) {
      SCOPED_TRACE(::testing::Message() << row.uncertainty.name << " " << row.uncertainty.norm << ", " << kCounts[j]);
      std::vector<double> alphas;
      for (std::uint32_t seed = 1; seed <= kReferences; ++seed) {
        const NoisySignals signals =
            uncertain_signals(loop, row.uncertainty.delta, normal_reference(kCounts[j], seed), 0.0, seed);
        alphas.push_back(noise_free_bound(signals.v, signals.w));
      }
      Found result;
      for (const double alpha : alphas) result.invalidated += alpha > 1.0 + 1e-6 ? 1 : 0;
      expect_count(result, row.percent[j]);
      std::sort(alphas.begin(), alphas.end());
      if (!std::isnan(row.median[j])) {
        EXPECT_NEAR(0.5 * (alphas[kReferences / 2 - 1] + alphas[kReferences / 2]), row.median[j],
                    median_spread(alphas));
      }
    }
  }
}

// Proofs may not be wrong once: no set with room for the truth is invalidated, and none is left open. 2880 records.
class TrueSets : public ::testing::TestWithParam<double> {};

TEST_P(TrueSets, AreNeverInvalidated) {
  for (const KnownUncertainty& uncertainty : uncertainties(GetParam())) {
    for (const double relative : kNoise) {
      for (const Index count : kCounts) {
        const Found result = found(uncertainty, count, relative);
        EXPECT_EQ(result.invalidated, 0) << uncertainty.name << ", " << relative << ", " << count;
        EXPECT_EQ(result.undecided, 0) << uncertainty.name << ", " << relative << ", " << count;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Norms, TrueSets, ::testing::Values(0.5, 0.9));

}  // namespace
}  // namespace blockid::testing
