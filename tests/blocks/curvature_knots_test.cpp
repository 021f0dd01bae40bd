// Knots laid where a curve bends.
#include "data/message.hpp"
#include "support/signals.hpp"

#include <blockid/blocks/curvature_knots.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::Noise;

constexpr Index kSamples = 4000;

/// Evenly spread over [-1, 1].
Eigen::VectorXd even() { return Eigen::VectorXd::LinSpaced(kSamples, -1.0, 1.0); }

std::vector<double> laid(const Eigen::VectorXd& v, const std::function<double(double)>& f, Index count) {
  return curvature_knots(std::span(v.data(), static_cast<std::size_t>(v.size())), f, count);
}

Index within(const std::vector<double>& knots, double lower, double upper) {
  return std::count_if(knots.begin(), knots.end(), [&](double k) { return lower < k && k < upper; });
}

/// A kink at 0.5, a hundredth wide.
double kinked(double x) { return 0.01 * std::log1p(std::exp((x - 0.5) / 0.01)); }

TEST(CurvatureKnots, SpanTheSignalAndIncrease) {
  Noise numbers(1);
  const Eigen::VectorXd v = numbers.white(kSamples);
  for (const Index count : {2, 3, 4, 5, 11, 40}) {
    const std::vector<double> knots = laid(v, kinked, count);
    ASSERT_EQ(std::ssize(knots), count);
    EXPECT_EQ(knots.front(), v.minCoeff());
    EXPECT_EQ(knots.back(), v.maxCoeff());
    const double spacing = (knots.back() - knots.front()) / (100.0 * static_cast<double>(count - 1));
    for (std::size_t k = 1; k < knots.size(); ++k) EXPECT_GE(knots[k] - knots[k - 1], 0.99 * spacing) << count;
  }
}

TEST(CurvatureKnots, CrowdWhereTheCurveBends) {
  // Beyond 0.1 of the kink f'' has fallen by exp(-10) and the density by exp(-4): of the ten knots that follow it most
  // lie within. Even knots would leave two of twenty there.
  const std::vector<double> knots = laid(even(), kinked, 20);
  EXPECT_GE(within(knots, 0.4, 0.6), 6);
}

TEST(CurvatureKnots, AConstantBendAsksForEvenKnots) {
  // Both halves are even then: no interval is wider than that of ten knots alone, 2 / 9.
  const std::vector<double> knots = laid(
      even(), [](double x) { return x * x; }, 20);
  for (std::size_t k = 1; k < knots.size(); ++k) EXPECT_LE(knots[k] - knots[k - 1], 2.0 / 9.0 + 1e-12);
  EXPECT_NEAR(static_cast<double>(within(knots, -1.1, 0.0)), 10.0, 1.0);
}

TEST(CurvatureKnots, AStraightCurveGetsEvenKnotsToo) {
  const std::vector<double> knots = laid(
      even(), [](double) { return 3.0; }, 20);
  EXPECT_NEAR(static_cast<double>(within(knots, -1.1, 0.0)), 10.0, 1.0);
}

TEST(CurvatureKnots, RefuseWhatPlaceKnotsRefuses) {
  EXPECT_THAT(BLOCKID_MESSAGE(laid(even(), kinked, 1)), HasSubstr("must lie in 2..1000"));
  EXPECT_THAT(BLOCKID_MESSAGE(laid(Eigen::VectorXd::Ones(10), kinked, 5)), HasSubstr("knots: "));
  EXPECT_THAT(BLOCKID_MESSAGE(laid(
                  even(), [](double x) { return 1.0 / (x - x); }, 5)),
              HasSubstr("not finite"));
}

}  // namespace
}  // namespace blockid
