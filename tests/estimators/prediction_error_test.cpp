// Prediction errors and their derivatives against dense matrices.
#include <blockid/estimators/prediction_error.hpp>

#include "data/message.hpp"
#include "estimators/polynomial_systems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace blockid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::AllOf;
using ::testing::HasSubstr;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Rounding of some hundred operations; the filters amplify it by less than a hundred.
constexpr double kRounding = 1e-11;
// Central differences with steps of 1e-5: third derivatives below a hundred times 1e-10, rounding 1e-16 / 1e-5.
constexpr double kStep = 1e-5;
constexpr double kDifference = 1e-7;
constexpr PredictionOptions kRest = {InitialState::zero, 0, 1};
constexpr PredictionOptions kEstimated = {InitialState::estimated, 0, 1};

// Lower triangular Toeplitz matrix: the polynomial as an operator on signals of N samples.
MatrixXd toeplitz(const VectorXd& polynomial, Index n) {
  MatrixXd matrix = MatrixXd::Zero(n, n);
  for (Index k = 0; k < std::min(n, polynomial.size()); ++k) matrix.diagonal(-k).setConstant(polynomial[k]);
  return matrix;
}

// e = C^-1 D (A y - F^-1 B u) + (C F)^-1 x.
VectorXd dense_errors(const PolynomialOrders& orders, const VectorXd& theta, const Record& record, const VectorXd& x) {
  const Index n = record.u.size();
  const Polynomials p = polynomials(orders, theta);
  const auto solve = [n](const VectorXd& polynomial, const VectorXd& right) {
    return VectorXd(toeplitz(polynomial, n).triangularView<Eigen::Lower>().solve(right));
  };
  const VectorXd v = toeplitz(p.a, n) * record.y - solve(p.f, toeplitz(p.b, n) * record.u);
  VectorXd past = VectorXd::Zero(n);
  past.head(x.size()) = x;
  return solve(p.c, toeplitz(p.d, n) * v) + solve(p.c, solve(p.f, past));
}

// All polynomials at once, degrees all different.
PolynomialModel everything() {
  return testing::polynomial_model({.na = 1, .nb = 4, .nc = 3, .nd = 2, .nf = 2, .nk = 2},
                                   {-0.5, 1.0, 0.5, -0.2, 0.1, 0.3, 0.6, 0.2, -0.1, -1.2, 0.5, -1.4, 0.7}, 0.25);
}

std::vector<PolynomialModel> all_systems() {
  return {testing::arx_system(), testing::armax_system(), testing::output_error_system(), testing::box_jenkins_system(),
          everything()};
}

VectorXd with_states(const PredictionError& function, const VectorXd& theta, std::uint64_t seed) {
  VectorXd p = testing::Noise(seed).white(function.unknown_count());
  p.head(theta.size()) = theta;
  return p;
}

TEST(PredictionErrorTest, ErrorsAreThoseOfDenseMatrices) {
  for (const PolynomialModel& model : all_systems()) {
    SCOPED_TRACE(::testing::PrintToString(parameter_names(model.orders)));
    const Record record = testing::simulated(model, 60, 1).record;
    for (const PredictionOptions& options : {kRest, kEstimated}) {
      const PredictionError function(model.orders, record, options);
      const VectorXd p = with_states(function, model.theta, 2);
      const VectorXd expected = dense_errors(model.orders, model.theta, record, p.tail(function.state_count()));
      VectorXd r(60);
      ASSERT_TRUE(function.residuals(p, r.data()));
      EXPECT_LT((r - expected).norm(), kRounding * expected.norm());
      EXPECT_NEAR(function.sum_of_squares(p), expected.squaredNorm(), kRounding * expected.squaredNorm());
      EXPECT_EQ(function.errors(p, 0), r);
    }
  }
}

TEST(PredictionErrorTest, AtTheTruthTheInnovationsComeBack) {
  for (const PolynomialModel& model : all_systems()) {
    const testing::SimulatedPolynomial data = testing::simulated(model, 300, 3);
    const PredictionError function(model.orders, data.record, kRest);
    EXPECT_LT((function.errors(model.theta, 0) - data.e).norm(), kRounding * data.e.norm());
  }
}

TEST(PredictionErrorTest, AnyPastAddsNothingButItsPolynomial) {
  // C F (e - e from rest) must vanish from sample state_count() on, whatever ran before the record.
  for (const PolynomialModel& model : all_systems()) {
    const testing::SimulatedPolynomial data = testing::simulated(model, 200, 4, 150);
    const PredictionError from_rest(model.orders, data.record, kRest);
    const Index states = PredictionError(model.orders, data.record, kEstimated).state_count();
    const Polynomials p = polynomials(model);
    const VectorXd x = toeplitz(p.c, 200) * toeplitz(p.f, 200) * (data.e - from_rest.errors(model.theta, 0));
    EXPECT_GT(x.head(states).norm(), 0.1);
    EXPECT_GT(std::abs(x[states - 1]), 1e-6) << "one state fewer would do";
    EXPECT_LT(x.tail(200 - states).norm(), 1e-9);
  }
}

MatrixXd central_differences(const PredictionError& function, const VectorXd& p) {
  MatrixXd j(function.sample_count(), p.size());
  VectorXd plus(function.sample_count());
  VectorXd minus(function.sample_count());
  for (Index k = 0; k < p.size(); ++k) {
    EXPECT_TRUE(function.residuals(p + kStep * VectorXd::Unit(p.size(), k), plus.data()));
    EXPECT_TRUE(function.residuals(p - kStep * VectorXd::Unit(p.size(), k), minus.data()));
    j.col(k) = (plus - minus) / (2.0 * kStep);
  }
  return j;
}

// Two records, weights, a warm-up; missing samples where C = 1.
DataSet awkward_data(const PolynomialModel& model) {
  Record first = testing::simulated(model, 700, 5, 50).record;
  Record second = testing::simulated(model, 90, 6).record;
  second.weights = testing::Noise(7).white(90).cwiseAbs();
  if (model.orders.nc == 0) {
    for (const Index t : {20, 21, 60}) {
      second.weights[t] = 0.0;
      second.y[t] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return std::vector<Record>{first, second};
}

TEST(PredictionErrorTest, DerivativesAreThoseOfDifferences) {
  for (const PolynomialModel& model : all_systems()) {
    SCOPED_TRACE(::testing::PrintToString(parameter_names(model.orders)));
    const DataSet data = awkward_data(model);
    for (const InitialState state : {InitialState::zero, InitialState::estimated}) {
      const PredictionError function(model.orders, data, {state, 10, 1}, 0.2, -0.3);
      const VectorXd p = with_states(function, model.theta, 8);
      VectorXd r(function.sample_count());
      RowMajor j(function.sample_count(), p.size());
      ASSERT_TRUE(function.jacobian(p, r.data(), j.data()));
      const MatrixXd expected = central_differences(function, p);
      for (Index k = 0; k < p.size(); ++k) {
        EXPECT_LT((j.col(k) - expected.col(k)).norm(), kDifference * std::max(1.0, expected.col(k).norm())) << k;
      }
      VectorXd same(function.sample_count());
      ASSERT_TRUE(function.residuals(p, same.data()));
      EXPECT_LT((r - same).norm(), kRounding * r.norm());
    }
  }
}

TEST(PredictionErrorTest, SumsAreThoseOfAllRows) {
  for (const PolynomialModel& model : all_systems()) {
    const DataSet data = awkward_data(model);
    const PredictionError function(model.orders, data, {InitialState::estimated, 5, 1});
    const VectorXd p = with_states(function, model.theta, 9);
    const Index unknowns = p.size();
    VectorXd r(function.sample_count());
    RowMajor j(function.sample_count(), unknowns);
    ASSERT_TRUE(function.jacobian(p, r.data(), j.data()));
    MatrixXd all(function.sample_count(), unknowns + 1);
    all << j, r;
    const MatrixXd gram = all.transpose() * all;
    NormalEquations normal(unknowns + 1);
    QrTriangle triangle(unknowns + 1);
    ASSERT_TRUE(function.accumulate(p, normal));
    ASSERT_TRUE(function.accumulate(p, triangle));
    EXPECT_LT((normal.gram() - gram).norm(), kRounding * gram.norm());
    EXPECT_LT((triangle.triangle().transpose() * triangle.triangle() - gram).norm(), kRounding * gram.norm());
    EXPECT_EQ(normal.rows(), function.sample_count());
  }
}

TEST(PredictionErrorTest, FittedStatesAreThoseOfLeastSquares) {
  for (const PolynomialModel& model : all_systems()) {
    const DataSet data = awkward_data(model);
    const PredictionError function(model.orders, data, kEstimated);
    const VectorXd p = function.with_fitted_states(model.theta);
    EXPECT_EQ(p.head(model.theta.size()), model.theta);
    VectorXd r(function.sample_count());
    RowMajor j(function.sample_count(), p.size());
    ASSERT_TRUE(function.jacobian(p, r.data(), j.data()));
    // The sum of squares is quadratic in the states: its gradient vanishes.
    const MatrixXd by_states = j.rightCols(p.size() - model.theta.size());
    EXPECT_LT((by_states.transpose() * r).norm(), 1e-9 * by_states.norm() * r.norm());
  }
}

TEST(PredictionErrorTest, LeavesOutWhatMissingSamplesReach) {
  const PolynomialModel model = testing::polynomial_model({.na = 1, .nb = 0, .nd = 2}, {-0.5, 1.0, -1.2, 0.5}, 0.25);
  testing::SimulatedPolynomial data = testing::simulated(model, 50, 10);
  const VectorXd e = data.e;
  data.record.weights = VectorXd::Ones(50);
  data.record.weights[20] = 0.0;
  data.record.y[20] = 1e9;
  const PredictionError function(model.orders, data.record, kRest);
  EXPECT_EQ(function.counted_samples(), 46);
  const VectorXd found = function.errors(model.theta, 0);
  VectorXd r(50);
  ASSERT_TRUE(function.residuals(model.theta, r.data()));
  for (Index t = 0; t < 50; ++t) {
    const bool reached = t >= 20 && t <= 23;
    EXPECT_EQ(std::isnan(found[t]), reached) << t;
    if (reached) {
      EXPECT_EQ(r[t], 0.0);
    } else {
      // Had 1e9 passed the filters, its rounding of 1e-7 would show.
      EXPECT_NEAR(found[t], e[t], kRounding) << t;
    }
  }
}

TEST(PredictionErrorTest, RejectsWhatIsNotFinite) {
  PolynomialModel model = testing::box_jenkins_system();
  const Record record = testing::simulated(model, 3000, 11).record;
  const PredictionError function(model.orders, record, kRest);
  // 2^3000 is beyond the largest number.
  model.theta[4] = 2.0;
  VectorXd r(3000);
  RowMajor j(3000, model.theta.size());
  NormalEquations sums(model.theta.size() + 1);
  QrTriangle triangle(model.theta.size() + 1);
  EXPECT_FALSE(function.residuals(model.theta, r.data()));
  EXPECT_FALSE(function.jacobian(model.theta, r.data(), j.data()));
  EXPECT_FALSE(function.accumulate(model.theta, sums));
  EXPECT_FALSE(function.accumulate(model.theta, triangle));
  EXPECT_EQ(sums.rows(), 0);
  EXPECT_TRUE(std::isinf(function.sum_of_squares(model.theta)));
}

TEST(PredictionErrorTest, ErrorsSayWhatIsExpected) {
  const PolynomialModel model = testing::box_jenkins_system();
  Record record = testing::simulated(model, 40, 12).record;
  record.name = "r";
  const auto message = [&](const PolynomialOrders& orders, const PredictionOptions& options) {
    return testing::message_of([&] { const PredictionError function(orders, record, options); });
  };
  EXPECT_THAT(message(model.orders, {InitialState::zero, 40, 1}), AllOf(HasSubstr("'r'"), HasSubstr("warm-up of 40")));
  EXPECT_THAT(message(model.orders, {InitialState::zero, -1, 1}), HasSubstr(">= 0 samples, got -1"));
  EXPECT_THAT(message(model.orders, {InitialState::periodic, 0, 1}), HasSubstr("zero or estimated"));
  EXPECT_THAT(message({.nb = -1}, {}), HasSubstr("nb=-1"));
  record.weights = VectorXd::Ones(40);
  record.weights[7] = 0.0;
  EXPECT_THAT(message(model.orders, {}), AllOf(HasSubstr("output sample 7 is missing"), HasSubstr("nc = 0")));
  const PredictionError function(testing::output_error_system().orders, record, kRest);
  EXPECT_THAT(testing::message_of([&] { function.sum_of_squares(VectorXd::Zero(3)); }),
              AllOf(HasSubstr("expected 4 unknowns"), HasSubstr("got 3")));
}

}  // namespace
}  // namespace blockid
