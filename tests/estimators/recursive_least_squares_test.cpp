#include <blockid/estimators/recursive_least_squares.hpp>

#include "data/message.hpp"
#include "support/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace blockid {
namespace {

using Eigen::Index;
using ::testing::HasSubstr;
using testing::Noise;

// Plane rotations against Householder on well-conditioned rows: rounding of some hundred operations.
constexpr double kRounding = 1e-11;

struct Rows {
  Eigen::MatrixXd x;
  Eigen::VectorXd d;
};

Rows random_rows(Index n, Index parameters, std::uint64_t seed) {
  Noise noise(seed);
  return {noise.matrix(n, parameters), noise.white(n)};
}

void update(RecursiveLeastSquares& recursion, const Rows& rows, Index k, double weight = 1.0) {
  const Eigen::VectorXd row = rows.x.row(k);
  recursion.update({row.data(), static_cast<std::size_t>(row.size())}, rows.d[k], weight);
}

// Minimiser of |W (d - X theta)| by dense QR.
Eigen::VectorXd dense(const Rows& rows, const Eigen::VectorXd& w) {
  return (w.asDiagonal() * rows.x).colPivHouseholderQr().solve(w.cwiseProduct(rows.d));
}

TEST(RecursiveLeastSquares, equals_least_squares_over_all_rows_at_every_step) {
  const Rows rows = random_rows(60, 4, 1);
  RecursiveLeastSquares recursion(4);
  for (Index k = 0; k < 60; ++k) {
    update(recursion, rows, k);
    ASSERT_EQ(recursion.is_determined(), k >= 3) << "row " << k;
    if (k < 3) continue;
    const Rows so_far{rows.x.topRows(k + 1), rows.d.head(k + 1)};
    const Eigen::VectorXd expected = dense(so_far, Eigen::VectorXd::Ones(k + 1));
    EXPECT_LE((recursion.estimate() - expected).norm(), kRounding * expected.norm() * (k == 3 ? 1e3 : 1.0));
    EXPECT_NEAR(recursion.residual_sum_of_squares(), (so_far.d - so_far.x * expected).squaredNorm(), kRounding);
  }
}

TEST(RecursiveLeastSquares, weighs_and_forgets_rows) {
  constexpr double kForgetting = 0.95;
  const Rows rows = random_rows(50, 3, 2);
  RecursiveLeastSquares recursion(3, kForgetting);
  Eigen::VectorXd w(50);
  for (Index k = 0; k < 50; ++k) {
    const double weight = 0.5 + 0.02 * static_cast<double>(k);
    update(recursion, rows, k, weight);
    w[k] = weight * std::pow(kForgetting, 0.5 * static_cast<double>(49 - k));
  }
  EXPECT_LE((recursion.estimate() - dense(rows, w)).norm(), kRounding);
}

TEST(RecursiveLeastSquares, does_not_depend_on_the_scale_of_a_column) {
  Rows rows = random_rows(40, 3, 3);
  RecursiveLeastSquares plain(3);
  RecursiveLeastSquares scaled(3);
  for (Index k = 0; k < 40; ++k) {
    update(plain, rows, k);
    Rows large = rows;
    large.x.col(1) *= 1e12;
    update(scaled, large, k);
  }
  ASSERT_TRUE(scaled.is_determined());
  EXPECT_NEAR(scaled.estimate()[1] * 1e12, plain.estimate()[1], kRounding);
  EXPECT_NEAR(scaled.estimate()[0], plain.estimate()[0], kRounding);
}

TEST(RecursiveLeastSquares, covariance_is_that_of_the_normal_equations) {
  const Rows rows = random_rows(200, 3, 4);
  RecursiveLeastSquares recursion(3);
  for (Index k = 0; k < 200; ++k) update(recursion, rows, k);
  const Eigen::VectorXd theta = dense(rows, Eigen::VectorXd::Ones(200));
  const double s2 = (rows.d - rows.x * theta).squaredNorm() / 197.0;
  const Eigen::MatrixXd expected = s2 * (rows.x.transpose() * rows.x).inverse();
  EXPECT_LE((recursion.covariance() - expected).norm(), kRounding * expected.norm());
}

TEST(RecursiveLeastSquares, a_prior_is_a_row_for_each_parameter) {
  RecursiveLeastSquares recursion(2);
  recursion.add_prior(Eigen::Vector2d(3.0, -1.0), Eigen::Vector2d(0.5, 2.0));
  ASSERT_TRUE(recursion.is_determined());
  EXPECT_NEAR(recursion.estimate()[0], 3.0, kRounding);
  // One row theta_0 = 5 of deviation 0.5: halfway between.
  recursion.update(std::vector<double>{2.0, 0.0}, 10.0);
  EXPECT_NEAR(recursion.estimate()[0], 4.0, kRounding);
  EXPECT_NEAR(recursion.estimate()[1], -1.0, kRounding);
}

TEST(RecursiveLeastSquares, says_when_a_direction_is_not_determined) {
  RecursiveLeastSquares recursion(2);
  for (int k = 1; k <= 5; ++k) recursion.update(std::vector<double>{1.0 * k, 2.0 * k}, 1.0);
  EXPECT_FALSE(recursion.is_determined());
  EXPECT_THAT(testing::message_of([&] { recursion.estimate(); }), HasSubstr("5 rows do not determine 2 parameters"));
}

TEST(RecursiveLeastSquares, refuses_a_bad_row_and_stays_as_it_was) {
  const Rows rows = random_rows(10, 2, 5);
  RecursiveLeastSquares recursion(2);
  for (Index k = 0; k < 10; ++k) update(recursion, rows, k);
  const Eigen::VectorXd before = recursion.estimate();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(testing::message_of([&] {
                recursion.update(std::vector<double>{1.0, nan}, 1.0);
              }),
              HasSubstr("row 10 is not finite"));
  EXPECT_THAT(testing::message_of([&] { recursion.update(std::vector<double>{1.0}, 1.0); }),
              HasSubstr("expected 2 regressors, got 1"));
  EXPECT_EQ(recursion.estimate(), before);
  EXPECT_EQ(recursion.rows(), 10);
}

TEST(RecursiveLeastSquares, refuses_bad_options) {
  EXPECT_THAT(testing::message_of([] { RecursiveLeastSquares(0); }), HasSubstr("at least one parameter, got 0"));
  EXPECT_THAT(testing::message_of([] { RecursiveLeastSquares(2, 0.0); }),
              HasSubstr("forgetting factor in (0, 1], got 0"));
  EXPECT_THAT(testing::message_of([] { RecursiveLeastSquares(2, 1.5); }), HasSubstr("got 1.5"));
}

}  // namespace
}  // namespace blockid
