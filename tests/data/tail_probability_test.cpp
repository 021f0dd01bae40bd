#include "blockid/data/tail_probability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace blockid {
namespace {

/// Some hundred roundings of the series.
constexpr double kRounding = 1e-13;

TEST(TailProbability, TwoDegreesOfFreedomAreExponential) {
  for (const double x : {0.1, 1.0, 5.0, 40.0}) {
    EXPECT_NEAR(chi_square_tail(x, 2.0), std::exp(-0.5 * x), kRounding * std::exp(-0.5 * x));
  }
}

TEST(TailProbability, FourDegreesOfFreedomByParts) {
  for (const double x : {0.1, 1.0, 5.0, 40.0}) {
    EXPECT_NEAR(chi_square_tail(x, 4.0), (1.0 + 0.5 * x) * std::exp(-0.5 * x), kRounding);
  }
}

TEST(TailProbability, OneDegreeOfFreedomIsASquaredNormal) {
  for (const double z : {0.3, 1.0, 2.575829303548901, 5.0}) {
    EXPECT_NEAR(chi_square_tail(z * z, 1.0), 2.0 * normal_tail(z), kRounding);
  }
  EXPECT_NEAR(2.0 * normal_tail(2.575829303548901), 0.01, 1e-15);
}

TEST(TailProbability, TwoSidedPointInvertsTheTail) {
  for (const double significance : {0.5, 0.05, 0.01, 1e-6, 1e-100}) {
    EXPECT_NEAR(2.0 * normal_tail(two_sided_point(significance)), significance, kRounding * significance);
  }
  // Abramowitz and Stegun, table 26.5.
  EXPECT_NEAR(two_sided_point(0.01), 2.5758293035489, 1e-13);
}

// exp(-x / 2) for two degrees of freedom; a square of a normal variable for one.
TEST(TailProbability, ChiSquarePointIsTheInverse) {
  for (const double significance : {1e-12, 1e-3, 0.01, 0.5, 1.0}) {
    const double point = -2.0 * std::log(significance);
    EXPECT_NEAR(chi_square_point(significance, 2.0), point, 1e-13 * (1.0 + point)) << significance;
  }
  EXPECT_NEAR(chi_square_point(0.01, 1.0), std::pow(two_sided_point(0.01), 2), 1e-12);
  EXPECT_NEAR(chi_square_tail(chi_square_point(0.01, 25.0), 25.0), 0.01, 1e-14);
}

TEST(TailProbability, Ends) {
  EXPECT_EQ(chi_square_tail(0.0, 3.0), 1.0);
  EXPECT_EQ(chi_square_tail(-1.0, 3.0), 1.0);
  EXPECT_EQ(chi_square_tail(std::numeric_limits<double>::infinity(), 3.0), 0.0);
}

// t^2 of nu degrees is F(1, nu), chi-square / d is F(d, infinity); and a point of the tables.
TEST(FTail, AgreesWithOtherDistributions) {
  EXPECT_NEAR(f_tail(4.0, 2.0, 6.0), std::pow(1.0 + 4.0 / 3.0, -3.0), 1e-12);  // (1 + x / nu)^-nu, nu = 3
  EXPECT_NEAR(f_tail(1.7, 8.0, 1e8), chi_square_tail(1.7 * 8.0, 8.0), 1e-6);
  EXPECT_NEAR(f_tail(3.325835, 5.0, 10.0), 0.05, 1e-6);
  EXPECT_NEAR(f_tail(2.0, 7.0, 9.0), 1.0 - f_tail(0.5, 9.0, 7.0), 1e-12);
  EXPECT_EQ(f_tail(0.0, 3.0, 4.0), 1.0);
  EXPECT_EQ(f_tail(std::numeric_limits<double>::infinity(), 3.0, 4.0), 0.0);
}

}  // namespace
}  // namespace blockid
