#include <blockid/init/root_groups.hpp>

#include "data/message.hpp"
#include "support/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::Noise;
using Kind = RootGroup::Kind;

// Roots of a well separated polynomial of degree 10 or less: eigenvalues to 1e-14, products of them to 1e-11.
constexpr double kRoots = 1e-11;

Index degree_of(const std::vector<RootGroup>& groups) {
  Index degree = 0;
  for (const RootGroup& group : groups) degree += group.degree();
  return degree;
}

// The polynomial up to a factor.
void expect_parallel(const Eigen::VectorXd& a, const Eigen::VectorXd& b, double tolerance = kRoots) {
  ASSERT_EQ(a.size(), b.size());
  const double factor = a.dot(b) / b.squaredNorm();
  EXPECT_LT((a - factor * b).norm(), tolerance * a.norm());
}

TEST(RootGroupsTest, PolynomialsComeBack) {
  Noise numbers(1);
  for (Index degree = 0; degree <= 8; ++degree) {
    for (int draw = 0; draw < 20; ++draw) {
      const Eigen::VectorXd p = numbers.white(degree + 1);
      const std::vector<RootGroup> groups = root_groups(p);
      EXPECT_EQ(degree_of(groups), degree);
      expect_parallel(product(groups), p);
      for (const std::complex<double>& z : roots(groups)) {
        // p_0 z^n + ... + p_n = 0, by Horner.
        std::complex<double> value = 0.0;
        double size = 0.0;
        for (const double c : p) {
          value = value * z + c;
          size = size * std::abs(z) + std::abs(c);
        }
        EXPECT_LT(std::abs(value), kRoots * size);
      }
    }
  }
}

TEST(RootGroupsTest, GroupsComeBack) {
  const std::vector<RootGroup> groups = {{Kind::infinite, 0.0},    {Kind::real, 0.9},         {Kind::real, -0.4},
                                         {Kind::pair, {0.7, 0.3}}, {Kind::pair, {-0.2, 0.5}}, {Kind::real, 0.0},
                                         {Kind::infinite, 0.0},    {Kind::real, 1.7}};
  const Eigen::VectorXd p = product(groups);
  ASSERT_EQ(p.size(), 11);
  EXPECT_EQ(p[0], 0.0);
  EXPECT_EQ(p[1], 0.0);
  const std::vector<RootGroup> found = root_groups(p);
  ASSERT_EQ(found.size(), groups.size());
  EXPECT_NEAR(std::abs(found.back().value - std::complex<double>(-0.2, 0.5)), 0.0, 1e-9);
  Index infinite = 0;
  for (const RootGroup& group : found) infinite += group.kind == Kind::infinite ? 1 : 0;
  EXPECT_EQ(infinite, 2);
  EXPECT_EQ(roots(found).size(), 8u);
  expect_parallel(product(found), p);
}

TEST(RootGroupsTest, OrderZero) {
  EXPECT_TRUE(root_groups(Eigen::VectorXd::Constant(1, -3.0)).empty());
  EXPECT_EQ(product({}), Eigen::VectorXd::Ones(1));
  EXPECT_EQ(to_text(std::vector<RootGroup>{}), "{}");
}

TEST(RootGroupsTest, RepeatedRootsScatterButTheirProductHolds) {
  // (1 - 0.8 x)^4: eigenvalues scatter by the fourth root of rounding, 1e-4, into pairs or not.
  const Eigen::VectorXd p = product(std::vector<RootGroup>(4, {Kind::real, 0.8}));
  const std::vector<RootGroup> groups = root_groups(p);
  EXPECT_EQ(degree_of(groups), 4);
  for (const std::complex<double>& z : roots(groups)) EXPECT_LT(std::abs(z - 0.8), 1e-2);
  expect_parallel(product(groups), p);
}

TEST(RootGroupsTest, NearlyRealPairsBecomeTwoRealRoots) {
  // z^2 - 1.6 z + 0.64 + e^2: pair 0.8 +- i e; below 1e-10 of the size the imaginary part is rounding.
  for (const double e : {0.0, 1e-3}) {
    const std::vector<RootGroup> groups = root_groups(Eigen::Vector3d(1.0, -1.6, 0.64 + e * e));
    EXPECT_EQ(degree_of(groups), 2) << e;
    if (e > 0.0) {
      ASSERT_EQ(groups.size(), 1u);
      EXPECT_NEAR(groups[0].value.imag(), e, 1e-6);
    }
  }
}

TEST(RootGroupsTest, LeadingCoefficientsWithinTheToleranceAreInfiniteRoots) {
  const std::vector<RootGroup> strict = root_groups(Eigen::Vector3d(1e-9, 1.0, -0.5));
  EXPECT_EQ(strict[0].kind, Kind::real);
  const std::vector<RootGroup> loose = root_groups(Eigen::Vector3d(1e-9, 1.0, -0.5), 1e-6);
  EXPECT_EQ(to_text(loose), "{0.5, inf}");
  EXPECT_THAT(BLOCKID_MESSAGE(root_groups(Eigen::Vector3d::Zero())), HasSubstr("zero"));
}

TEST(RootGroupsTest, Texts) {
  EXPECT_EQ(to_text(RootGroup{Kind::real, 0.9}), "0.9");
  EXPECT_EQ(to_text(RootGroup{Kind::pair, {0.7, 0.3}}), "0.7+-0.3i");
  EXPECT_EQ(to_text(RootGroup{Kind::infinite, 0.0}), "inf");
}

TEST(StabilisedTest, ReflectsWhatLiesOutside) {
  const Eigen::VectorXd p = product({{Kind::real, 2.0}, {Kind::pair, {0.9, 0.9}}, {Kind::real, 0.5}});
  const Eigen::VectorXd stable = stabilised(p / p[0]);
  EXPECT_EQ(stable[0], 1.0);
  const std::complex<double> reflected = 1.0 / std::conj(std::complex<double>(0.9, 0.9));
  const Eigen::VectorXd expected = product({{Kind::real, 0.5}, {Kind::pair, reflected}, {Kind::real, 0.5}});
  EXPECT_LT((stable - expected / expected[0]).norm(), kRoots);
}

TEST(StabilisedTest, KeepsStablePolynomialsAndTheirOrder) {
  Eigen::VectorXd p(4);
  p << 1.0, -1.2, 0.52, 0.0;
  EXPECT_LT((stabilised(p) - p).norm(), kRoots);
  EXPECT_EQ(stabilised(Eigen::VectorXd::Ones(1)), Eigen::VectorXd::Ones(1));
}

TEST(StabilisedTest, RootsOnTheCircleMoveInside) {
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(1, -2, 1), Eigen::Vector3d(1, 0, 1), Eigen::Vector3d(1, 0, -1)}) {
    for (const std::complex<double>& z : roots(root_groups(stabilised(p)))) {
      EXPECT_LT(std::abs(z), 1.0);
      EXPECT_GT(std::abs(z), 0.99);
    }
  }
}

TEST(BrokenPairTest, KeepsTheSumAndStaysInside) {
  for (const std::complex<double> z : {std::complex<double>(0.6, 0.1), {0.0, 0.9}, {-0.95, 0.2}, {0.7, 0.7}}) {
    const std::vector<RootGroup> halves = broken_pair({Kind::pair, z});
    ASSERT_EQ(halves.size(), 2u);
    EXPECT_EQ(halves[0].kind, Kind::real);
    EXPECT_NEAR((halves[0].value + halves[1].value).real(), 2.0 * z.real(), 1e-15);
    for (const RootGroup& half : halves) EXPECT_LT(std::abs(half.value), 1.0);
    EXPECT_GT(halves[0].value.real(), halves[1].value.real());
  }
}

}  // namespace
}  // namespace blockid
