// Exponents in closed form: against the published third-order formulas, at higher orders, where they are not unique.
#include <blockid/blocks/taylor_expansion.hpp>
#include <blockid/init/fractional_exponents.hpp>

#include "data/message.hpp"
#include "support/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace blockid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Noise;
using Kind = RootGroup::Kind;

// Coefficients A_0 .. A_m for given exponents.
Eigen::VectorXd expanded(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros,
                         const Eigen::VectorXd& alpha, const Eigen::VectorXd& beta, Index m) {
  Eigen::VectorXd s = Eigen::VectorXd::Zero(m);
  for (std::size_t i = 0; i < poles.size(); ++i) s += alpha[static_cast<Index>(i)] * root_powers(poles[i].value, m);
  for (std::size_t j = 0; j < zeros.size(); ++j) s -= beta[static_cast<Index>(j)] * root_powers(zeros[j].value, m);
  return taylor_coefficients(s);
}

std::vector<RootGroup> real_roots(const std::vector<double>& values) {
  std::vector<RootGroup> groups;
  for (const double value : values) groups.push_back({Kind::real, value});
  return groups;
}

// Equations (38) and (39) for poles a1, a2 and the zero b1, with the sign of beta_1 that (33) to (37) give: as printed
// it is the negative.
Eigen::Vector3d published_exponents(double a1, double a2, double b1, const Eigen::VectorXd& c) {
  const double k1 = std::pow(c[1], 3);
  const double k2 = c[1] * c[1] - 2.0 * c[2];
  const double k3 = c[1];
  const double k4 = k2;
  const double k5 = 3.0 * c[3] - 3.0 * c[1] * c[2];
  const double alpha1 = (k1 + k2 * b1 + (k3 * b1 + k4) * a2 + k5) / (a1 * (a1 - a2) * (a1 - b1));
  const double alpha2 = -(k1 + k2 * b1 + (k3 * b1 + k4) * a1 + k5) / (a2 * (a1 - a2) * (a2 - b1));
  const double beta1 = -(k1 + k2 * a2 + (k3 * a2 + k4) * a1 + k5) / (b1 * (a1 - b1) * (a2 - b1));
  return {alpha1, alpha2, beta1};
}

// (33), the coefficients of the third-order example written out.
Eigen::Vector4d published_coefficients(double a1, double a2, double b1, double p, double q, double r) {
  Eigen::Vector4d c;
  c[0] = 1.0;
  c[1] = a1 * p + a2 * q - b1 * r;
  c[2] = 0.5 * (a1 * a1 * p * (p + 1) + 2 * a1 * a2 * p * q + a2 * a2 * q * (q + 1) - 2 * (a1 * p + a2 * q) * b1 * r +
                b1 * b1 * (r - 1) * r);
  c[3] = (a1 * a1 * a1 * p * (p + 1) * (p + 2) + 3 * a1 * a1 * a2 * p * (p + 1) * q +
          3 * a1 * a2 * a2 * p * q * (q + 1) + a2 * a2 * a2 * q * (q + 1) * (q + 2) -
          3 * (a1 * a1 * p * (p + 1) + 2 * a1 * a2 * p * q + a2 * a2 * q * (q + 1)) * b1 * r +
          3 * (a1 * p + a2 * q) * b1 * b1 * (r - 1) * r - b1 * b1 * b1 * (r - 2) * (r - 1) * r) /
         6.0;
  return c;
}

TEST(FractionalExponentsTest, ThirdOrderIsThePublishedSolution) {
  Noise numbers(1);
  for (int draw = 0; draw < 50; ++draw) {
    const double a1 = 0.5 + 0.45 * numbers.uniform();
    const double a2 = -0.1 - 0.7 * numbers.uniform();
    const double b1 = 0.1 + 0.2 * numbers.uniform();
    const Eigen::Vector3d exponents = 0.5 + numbers.white(3).array();
    const std::vector<RootGroup> poles = real_roots({a1, a2});
    const std::vector<RootGroup> zeros = real_roots({b1});
    const Eigen::VectorXd c = expanded(poles, zeros, exponents.head(2), exponents.tail(1), 3);
    // Sums of a dozen terms of order one.
    EXPECT_LT((c - published_coefficients(a1, a2, b1, exponents[0], exponents[1], exponents[2])).norm(), 1e-13);
    // Roots at least 0.1 from each other and from 0: divisors above 0.1^3.
    const FractionalExponents found = fractional_exponents(c, poles, zeros);
    EXPECT_LT((published_exponents(a1, a2, b1, c) - exponents).norm(), 1e-10);
    EXPECT_LT((found.alpha - exponents.head(2)).norm(), 1e-11);
    EXPECT_LT((found.beta - exponents.tail(1)).norm(), 1e-11);
    EXPECT_TRUE(found.unique());
    EXPECT_LT(found.residual, 1e-13);
  }
}

// The roots of a random filter: pairs and real roots at radii 0.3 .. 0.95, poles and zeros in turn, none nearer to
// another than 0.05.
struct RandomRoots {
  std::vector<RootGroup> poles;
  std::vector<RootGroup> zeros;
};

RandomRoots random_roots(Index groups, Noise& numbers) {
  constexpr double kApart = 0.05;
  RandomRoots roots;
  std::vector<std::complex<double>> taken;
  while (std::ssize(taken) < groups) {
    const double radius = 0.3 + 0.65 * numbers.uniform();
    const bool real = numbers.uniform() < 0.3;
    const std::complex<double> value =
        real ? (numbers.uniform() < 0.5 ? -radius : radius) : std::polar(radius, 0.1 + 2.9 * numbers.uniform());
    const auto near = [&](std::complex<double> other) { return std::abs(other - value) < kApart; };
    if (std::any_of(taken.begin(), taken.end(), near)) continue;
    (taken.size() % 2 == 0 ? roots.poles : roots.zeros).push_back({real ? Kind::real : Kind::pair, value});
    taken.push_back(value);
  }
  return roots;
}

// The largest error of any exponent.
double error_of(const FractionalExponents& found, const Eigen::VectorXd& alpha, const Eigen::VectorXd& beta) {
  Eigen::VectorXd error(alpha.size() + beta.size());
  error << found.alpha - alpha, found.beta - beta;
  return error.lpNorm<Eigen::Infinity>();
}

class OrdersTest : public ::testing::TestWithParam<Index> {};

// The error is rounding times the condition number; 100 covers the sums behind each coefficient. Conditions grow by a
// factor of about two for each group of roots (docs/mathematics.md has the medians).
TEST_P(OrdersTest, ExponentsComeBackToRoundingTimesCondition) {
  const Index groups = GetParam();
  Noise numbers(100 + static_cast<std::uint64_t>(groups));
  std::vector<double> conditions;
  for (int draw = 0; draw < 25; ++draw) {
    const RandomRoots roots = random_roots(groups, numbers);
    const Eigen::VectorXd alpha = 0.5 + numbers.white(std::ssize(roots.poles), 0.5).array();
    const Eigen::VectorXd beta = 0.5 + numbers.white(std::ssize(roots.zeros), 0.5).array();
    const Eigen::VectorXd c = expanded(roots.poles, roots.zeros, alpha, beta, 2 * groups);
    const FractionalExponents found = fractional_exponents(c, roots.poles, roots.zeros);
    EXPECT_TRUE(found.unique());
    EXPECT_LT(error_of(found, alpha, beta), 100.0 * 2.3e-16 * found.condition) << "condition " << found.condition;
    conditions.push_back(found.condition);
  }
  std::nth_element(conditions.begin(), conditions.begin() + 12, conditions.end());
  EXPECT_LT(conditions[12], 3.0 * std::pow(2.3, static_cast<double>(groups)));
}

INSTANTIATE_TEST_SUITE_P(Groups, OrdersTest, ::testing::Values(1, 2, 3, 4, 6, 8, 10, 12, 16, 20));

TEST(FractionalExponentsTest, ZerosOutsideTheCircleAndAFactorOnAllCoefficients) {
  const std::vector<RootGroup> poles = {{Kind::pair, {0.7, 0.4}}, {Kind::real, 0.5}};
  const std::vector<RootGroup> zeros = {{Kind::real, 1.8}, {Kind::pair, {-0.2, 0.6}}};
  const Eigen::Vector2d alpha(1.0, 0.0);
  const Eigen::Vector2d beta(0.0, 1.0);
  const Eigen::VectorXd c = -2.5 * expanded(poles, zeros, alpha, beta, 12);
  EXPECT_LT(error_of(fractional_exponents(c, poles, zeros), alpha, beta), 1e-9);
}

TEST(FractionalExponentsTest, MoreCoefficientsAndEqualWeightsHelpAgainstNoise) {
  const std::vector<RootGroup> poles = {{Kind::pair, {0.6, 0.3}}, {Kind::real, -0.5}};
  const std::vector<RootGroup> zeros = real_roots({0.4});
  const Eigen::Vector2d alpha(1.0, 0.0);
  const Eigen::VectorXd beta = Eigen::VectorXd::Ones(1);
  const double noise = 1e-4;
  const auto mean_square = [&](Index m, double decay) {
    Noise numbers(7);
    double sum = 0.0;
    for (int draw = 0; draw < 200; ++draw) {
      Eigen::VectorXd c = expanded(poles, zeros, alpha, beta, m);
      c.tail(m) += numbers.white(m, noise);
      sum += std::pow(error_of(fractional_exponents(c, poles, zeros, {.error_decay = decay}), alpha, beta), 2);
    }
    return sum / 200.0;
  };
  EXPECT_LT(mean_square(12, 1.0), 0.7 * mean_square(3, 1.0));
  EXPECT_LT(mean_square(12, 1.0), 0.7 * mean_square(12, 0.0));
  // With as many coefficients as exponents there is nothing to weigh.
  EXPECT_NEAR(mean_square(3, 0.0) / mean_square(3, 1.0), 1.0, 1e-9);
}

TEST(FractionalExponentsTest, RepeatedPolesShareTheirSum) {
  const std::vector<RootGroup> poles = real_roots({0.8, 0.3, 0.8});
  const std::vector<RootGroup> zeros = real_roots({-0.5});
  const Eigen::VectorXd c =
      expanded(poles, zeros, Eigen::Vector3d(1.0, 0.0, 0.2), Eigen::VectorXd::Constant(1, 0.7), 8);
  const FractionalExponents found = fractional_exponents(c, poles, zeros);
  EXPECT_FALSE(found.unique());
  ASSERT_EQ(found.shared.size(), 1u);
  EXPECT_THAT(found.shared[0].poles, ElementsAre(0, 2));
  EXPECT_TRUE(found.shared[0].zeros.empty());
  EXPECT_NEAR(found.shared[0].difference, 1.2, 1e-12);
  EXPECT_LT((found.alpha - Eigen::Vector3d(0.6, 0.0, 0.6)).norm(), 1e-12);
  EXPECT_NEAR(found.beta[0], 0.7, 1e-12);
  EXPECT_THAT(undetermined_text(found, poles, zeros), HasSubstr("pole repeated at 0.8"));
}

TEST(FractionalExponentsTest, PoleAndZeroThatCancelLeaveTheirDifference) {
  const std::vector<RootGroup> poles = {{Kind::pair, {0.6, 0.5}}, {Kind::real, 0.3}};
  const std::vector<RootGroup> zeros = {{Kind::real, -0.7}, {Kind::pair, {0.6, 0.5}}};
  const Eigen::VectorXd c = expanded(poles, zeros, Eigen::Vector2d(1.0, 0.1), Eigen::Vector2d(0.9, 0.0), 8);
  const FractionalExponents found = fractional_exponents(c, poles, zeros);
  ASSERT_EQ(found.shared.size(), 1u);
  EXPECT_THAT(found.shared[0].poles, ElementsAre(0));
  EXPECT_THAT(found.shared[0].zeros, ElementsAre(1));
  EXPECT_NEAR(found.shared[0].difference, 1.0, 1e-12);
  EXPECT_LT(error_of(found, Eigen::Vector2d(1.0, 0.1), Eigen::Vector2d(0.9, 0.0)), 1e-12);
  EXPECT_THAT(undetermined_text(found, poles, zeros), HasSubstr("cancel at 0.6+-0.5i"));
  EXPECT_EQ(found.unknowns, 3);
  EXPECT_EQ(found.rank, 3);
}

TEST(FractionalExponentsTest, NearlyRepeatedRootsLoseRankInsteadOfExploding) {
  const std::vector<RootGroup> poles = real_roots({0.8, 0.8 + 1e-6, 0.2});
  const Eigen::VectorXd c = expanded(poles, {}, Eigen::Vector3d(0.5, 0.5, 1.0), {}, 8);
  const FractionalExponents found = fractional_exponents(c, poles, {}, {.rank_tolerance = 1e-5});
  EXPECT_EQ(found.rank, 2);
  EXPECT_TRUE(std::isinf(found.condition));
  EXPECT_LT((found.alpha - Eigen::Vector3d(0.5, 0.5, 1.0)).norm(), 1e-5);
  EXPECT_THAT(undetermined_text(found, poles, {}), HasSubstr("1 combinations"));
}

TEST(FractionalExponentsTest, RootAtTheOriginHasNoExponent) {
  const std::vector<RootGroup> poles = real_roots({0.0, 0.6});
  const Eigen::VectorXd c = expanded(poles, {}, Eigen::Vector2d(1.0, 0.25), {}, 4);
  const FractionalExponents found = fractional_exponents(c, poles, {});
  EXPECT_LT((found.alpha - Eigen::Vector2d(0.5, 0.25)).norm(), 1e-12);
  EXPECT_FALSE(found.unique());
  EXPECT_THAT(undetermined_text(found, poles, {}), HasSubstr("origin"));
}

TEST(FractionalExponentsTest, ResidualShowsCoefficientsOfOtherRoots) {
  const std::vector<RootGroup> poles = real_roots({0.8, 0.2});
  const Eigen::VectorXd c = expanded(real_roots({0.5, -0.9}), {}, Eigen::Vector2d(1.0, 1.0), {}, 10);
  EXPECT_GT(fractional_exponents(c, poles, {}).residual, 0.1);
}

TEST(FractionalExponentsTest, NoRootsAndRefusals) {
  EXPECT_TRUE(fractional_exponents(Eigen::VectorXd::Ones(1), {}, {}).unique());
  EXPECT_THAT(BLOCKID_MESSAGE(fractional_exponents(Eigen::VectorXd::Ones(2), real_roots({0.5, 0.2}), {})),
              HasSubstr("at least 2 coefficients"));
  EXPECT_THAT(BLOCKID_MESSAGE(fractional_exponents(Eigen::VectorXd::Ones(3), {}, {{Kind::infinite, 0.0}})),
              HasSubstr("infinite"));
  EXPECT_THAT(BLOCKID_MESSAGE(fractional_exponents(Eigen::VectorXd::Zero(3), real_roots({0.5}), {})), HasSubstr("A_0"));
}

}  // namespace
}  // namespace blockid
