// Coefficients of both filters by regression: the example (25) of Giordano and Sjoberg 2015 from data to exponents.
#include <blockid/blocks/model.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/taylor_expansion.hpp>
#include <blockid/init/bla.hpp>
#include <blockid/init/coefficient_regression.hpp>
#include <blockid/init/fractional_exponents.hpp>

#include "data/message.hpp"
#include "support/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::Noise;
using Kind = RootGroup::Kind;

// Example (25): v = (1 - b1 q^-1) / (1 - a1 q^-1) u, w = theta_1 v + theta_2 v^2, y = w / (1 - a2 q^-1).
constexpr double kA1 = 0.7;
constexpr double kA2 = 0.4;
constexpr double kB1 = -0.5;

Eigen::VectorXd filtered(const Rational& filter, const Eigen::VectorXd& theta, const Eigen::VectorXd& u) {
  Model model = make_model(filter);
  model.parameters = theta;
  return simulate(model, u);
}

Record example(Index samples, double noise, std::uint64_t seed) {
  Noise numbers(seed);
  Record record;
  record.u = numbers.white(samples, 3.0);
  const Eigen::VectorXd v = filtered(Rational(1, 1), Eigen::Vector3d(1.0, -kB1, -kA1), record.u);
  const Eigen::VectorXd w = 1.5 * v.array() + 0.2 * v.array().square();
  record.y = filtered(Rational(0, 1), Eigen::Vector2d(1.0, -kA2), w) + numbers.white(samples, noise);
  return record;
}

// 1, A_1 .. A_n of G_W; 1, B_1 .. B_n of G_H.
Eigen::VectorXd first_coefficients(Index n) { return taylor_coefficients(root_powers(kA1, n) - root_powers(kB1, n)); }
Eigen::VectorXd second_coefficients(Index n) { return taylor_coefficients(root_powers(kA2, n)); }

// Filters of finite length that the regression holds exactly.
TEST(CoefficientRegressionTest, IsExactForShortFiltersWithoutNoise) {
  Noise numbers(1);
  for (const Index degree : {2, 3}) {
    Record record;
    record.u = numbers.white(3000, 0.01);
    const Eigen::VectorXd a = Eigen::Vector2d(1.0, -0.6);
    const Eigen::VectorXd b = Eigen::Vector2d(1.0, 0.8);
    const Eigen::VectorXd v = filtered(Rational(1, 0), a, record.u);
    Eigen::VectorXd w = 0.3 * v.array() + 2.0 * v.array().square();
    if (degree == 3) w.array() += 50.0 * v.array().cube();
    record.y = 4.0 + filtered(Rational(1, 0), b, w).array();
    const CoefficientRegression found = coefficient_regression(record, 2, degree);
    // Normal equations of products with a condition number near 100.
    constexpr double kSolve = 1e-8;
    EXPECT_LT((found.first - Eigen::Vector3d(1.0, -0.6, 0.0)).norm(), kSolve) << degree;
    EXPECT_LT((found.second - Eigen::Vector3d(1.0, 0.8, 0.0)).norm(), kSolve) << degree;
    EXPECT_NEAR(found.polynomial[0], 0.3, kSolve);
    EXPECT_NEAR(found.polynomial[1], 2.0, 100.0 * kSolve);
    if (degree == 3) {
      EXPECT_NEAR(found.polynomial[2], 50.0, 1e4 * kSolve);
    }
    EXPECT_LT(found.first_ratio, kSolve);
    EXPECT_LT(found.second_ratio, kSolve);
    EXPECT_EQ(found.rank, found.regressors);
    EXPECT_EQ(found.regressors, degree == 2 ? 10 : 20);
  }
}

TEST(CoefficientRegressionTest, PublishedExampleFromDataToExponents) {
  const Index n = 10;  // what lies beyond, 0.7^10 = 0.03 of the response, acts as noise
  const CoefficientRegression found = coefficient_regression(example(40000, 0.1, 2), n, 2);
  // Measured over other seeds: 0.004 on average.
  EXPECT_LT((found.first - first_coefficients(n)).norm(), 0.02);
  EXPECT_LT((found.second - second_coefficients(n)).norm(), 0.02);
  EXPECT_NEAR(found.polynomial[0], 1.5, 0.02);
  EXPECT_NEAR(found.polynomial[1], 0.2, 0.003);
  const std::vector<RootGroup> poles = {{Kind::real, kA1}, {Kind::real, kA2}};
  const std::vector<RootGroup> zeros = {{Kind::real, kB1}};
  // A condition of 32 stands between the errors of coefficients and exponents.
  const FractionalExponents of_first = fractional_exponents(found.first, poles, zeros, {.error_decay = 1.0});
  EXPECT_LT((of_first.alpha - Eigen::Vector2d(1.0, 0.0)).norm(), 0.1);
  EXPECT_NEAR(of_first.beta[0], 1.0, 0.1);
  const FractionalExponents of_second = fractional_exponents(found.second, poles, zeros, {.error_decay = 1.0});
  EXPECT_LT((of_second.alpha - Eigen::Vector2d(0.0, 1.0)).norm(), 0.1);
  EXPECT_NEAR(of_second.beta[0], 0.0, 0.1);
  // n1 = 3 as in the paper, as many coefficients as exponents: a condition of 90, still clear to round.
  const FractionalExponents of_three = fractional_exponents(found.first.head(4), poles, zeros);
  EXPECT_LT((of_three.alpha - Eigen::Vector2d(1.0, 0.0)).norm(), 0.25);
  EXPECT_NEAR(of_three.beta[0], 1.0, 0.25);
}

TEST(CoefficientRegressionTest, PublishedExampleWithRootsOfTheBestLinearApproximation) {
  const Record record = example(40000, 0.1, 3);
  const BestLinearApproximation bla = best_linear_approximation(record, {.nb = 1, .na = 2, .nk = 0});
  const CoefficientRegression found = coefficient_regression(record, 10, 2);
  const FractionalExponents exponents = fractional_exponents(found.first, bla.poles, bla.zeros, {.error_decay = 1.0});
  ASSERT_EQ(exponents.alpha.size(), 2);
  // Groups come sorted by magnitude: 0.7, 0.4.
  EXPECT_EQ(std::lround(exponents.alpha[0]), 1);
  EXPECT_EQ(std::lround(exponents.alpha[1]), 0);
  EXPECT_EQ(std::lround(exponents.beta[0]), 1);
  EXPECT_LT(std::abs(exponents.alpha[0] - 1.0), 0.35);
  EXPECT_LT(std::abs(exponents.alpha[1]), 0.35);
}

TEST(CoefficientRegressionTest, MissingSamplesAreLeftOut) {
  Record record = example(5000, 0.0, 4);
  record.weights = Eigen::VectorXd::Ones(5000);
  for (const Index t : {10, 11, 400, 4999}) {
    record.weights[t] = 0.0;
    record.y[t] = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_LT((coefficient_regression(record, 8, 2).first - first_coefficients(8)).norm(), 0.1);
}

TEST(CoefficientRegressionTest, Refusals) {
  const Record record = example(50, 0.0, 5);
  EXPECT_THAT(BLOCKID_MESSAGE(coefficient_regression(record, 3, 1)), HasSubstr("degree >= 2"));
  EXPECT_THAT(BLOCKID_MESSAGE(coefficient_regression(record, -1, 2)), HasSubstr("n >= 0"));
  EXPECT_THAT(BLOCKID_MESSAGE(coefficient_regression(record, 60, 2)), HasSubstr("more than 1000 regressors"));
  EXPECT_THAT(BLOCKID_MESSAGE(coefficient_regression(record, 10, 2)), HasSubstr("as many samples"));
  Record silent = record;
  silent.y.setZero();
  EXPECT_THAT(BLOCKID_MESSAGE(coefficient_regression(silent, 2, 2)), HasSubstr("no leading coefficient"));
}

}  // namespace
}  // namespace blockid
