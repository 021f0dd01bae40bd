// Verdicts window by window along a record, and of the whole record.
#include "closed_loop_noise.hpp"

#include "data/message.hpp"

#include <blockid/validation/windowed_test.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

WindowPlan plan_of_figure_3() {
  WindowPlan plan;
  plan.step = 150;
  return plan;
}

// Figure 3 as it should be: with their past, no window contradicts the uncertainty that is large enough.
TEST(WindowedTest, EnoughUncertaintyIsNeverInvalidated) {
  const UncertaintySignals signals = crowder_signals(CrowderLoop{}.ok());
  const double gamma = 1e-3 * signals.w.cwiseAbs().maxCoeff();
  const std::vector<WindowedVerdict> rows = windowed_test(signals.v, signals.w, gamma, plan_of_figure_3());
  ASSERT_EQ(rows.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(rows[i].first, 150 * static_cast<Index>(i));
    EXPECT_EQ(rows[i].past, rows[i].first);
    EXPECT_EQ(rows[i].window.verdict, Verdict::not_invalidated) << rows[i].window.evidence;
    ASSERT_TRUE(rows[i].record.has_value());
    EXPECT_EQ(rows[i].record->verdict, Verdict::not_invalidated) << rows[i].record->evidence;
  }
}

// Independent prototype, set "tight", norm 1.11: windows after 150 samples of past need no more than 0.957, the records
// to their ends more than 1.07.
TEST(WindowedTest, WholeRecordsAreSharperThanWindows) {
  const UncertaintySignals signals = crowder_signals(CrowderLoop{}.tight());
  const double gamma = 1e-3 * signals.w.cwiseAbs().maxCoeff();
  const std::vector<WindowedVerdict> rows = windowed_test(signals.v, signals.w, gamma, plan_of_figure_3());
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].window.verdict, Verdict::invalidated);
  EXPECT_EQ(rows[1].window.verdict, Verdict::not_invalidated);
  EXPECT_EQ(rows[2].window.verdict, Verdict::not_invalidated);
  for (const WindowedVerdict& row : rows) EXPECT_EQ(row.record.value().verdict, Verdict::invalidated);
}

TEST(WindowedTest, WithoutPastNothingIsProven) {
  const UncertainLoop loop = CrowderLoop{}.ok();
  const UncertaintySignals signals = crowder_signals(loop, 160);
  WindowPlan plan;
  plan.count = 60;
  plan.step = 50;
  plan.past = 0;
  plan.longest = 100;
  VerdictOptions options;
  options.memory = uncertainty_memory(loop);
  const std::vector<WindowedVerdict> rows =
      windowed_test(signals.v, signals.w, 1e-3 * signals.w.cwiseAbs().maxCoeff(), plan, options);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].window.verdict, Verdict::not_invalidated);
  EXPECT_EQ(rows[1].window.verdict, Verdict::undecided) << rows[1].window.evidence;
  EXPECT_TRUE(rows[1].window.has(VerdictWarning::past_shorter_than_memory));
  EXPECT_FALSE(rows[1].record.has_value());
}

TEST(WindowedTest, MistakesAreNamed) {
  const VectorXd one = VectorXd::Ones(10);
  const auto message = [&](Index count, Index step, Index past, Index longest) {
    WindowPlan plan;
    plan.count = count;
    plan.step = step;
    plan.past = past;
    plan.longest = longest;
    return message_of([&] { windowed_test(one, one, 0.1, plan); });
  };
  EXPECT_THAT(message(0, 1, 0, 10), HasSubstr("at least 1 sample, got 0 and 1"));
  EXPECT_THAT(message(2, 0, 0, 10), HasSubstr("got 2 and 0"));
  EXPECT_THAT(message(2, 1, -2, 10), HasSubstr("got -2"));
  EXPECT_THAT(message(2, 1, 9, 10), HasSubstr("within 10 samples, got 2 and 9"));
  EXPECT_THAT(message(11, 1, 0, 20), HasSubstr("at least 11 samples, got 10"));
}

}  // namespace
}  // namespace blockid::testing
