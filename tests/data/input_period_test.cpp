// Whether an input repeats itself, told from its samples.
#include <blockid/data/input_period.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd noise(Index count, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(count, [&] { return normal(engine); });
}

TEST(InputPeriod, OfWhatRepeats) {
  for (const Index period : {7, 64, 101}) {
    EXPECT_EQ(input_period(noise(period, 1).replicate(4, 1)), period);
    // Not a whole number of periods, an offset, noise of 0.01 % of the power.
    const VectorXd clean = noise(period, 2).replicate(4, 1).topRows(3 * period + period / 2);
    EXPECT_EQ(input_period(clean.array() + 100.0), period);
    const double deviation = std::sqrt((clean.array() - clean.mean()).square().mean());
    EXPECT_EQ(input_period(clean + 0.01 * deviation * noise(clean.size(), 3)), period);
  }
}

TEST(InputPeriod, ZeroForWhatDoesNot) {
  EXPECT_EQ(input_period(noise(1000, 4)), 0);
  // Slow: neighbours are alike, which is no period; and a ramp.
  VectorXd slow = noise(1000, 5);
  for (Index t = 1; t < 1000; ++t) slow[t] = 0.999 * slow[t - 1] + 0.01 * slow[t];
  EXPECT_EQ(input_period(slow), 0);
  EXPECT_EQ(input_period(VectorXd::LinSpaced(1000, 0.0, 1.0)), 0);
  EXPECT_EQ(input_period(VectorXd::Constant(1000, 3.7)), 0);
  EXPECT_EQ(input_period(VectorXd()), 0);
  // One period and a half: the record does not show it twice.
  EXPECT_EQ(input_period(noise(100, 6).replicate(2, 1).topRows(150)), 0);
}

}  // namespace
}  // namespace blockid
