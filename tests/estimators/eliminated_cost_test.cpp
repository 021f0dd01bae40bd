// Variable projection: the reduced cost against its definition.
#include <blockid/estimators/predictor_cost.hpp>

#include "estimators/dense_twin.hpp"
#include "estimators/systems.hpp"

#include <blockid/estimators/refit.hpp>
#include <blockid/estimators/static_parameters.hpp>

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

namespace blockid {
namespace {

using testing::Dense;
using testing::dense_residuals;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// J'J of the affine columns squares a condition number below 1e3.
constexpr double kCost = 1e-9;
// Central differences of a cost of order one with a step of 1e-5.
constexpr double kGradient = 1e-5;

struct Case {
  std::string name;
  Model truth;
  PredictionOptions options;
};

std::vector<Case> cases() {
  Model spline = testing::model_of("G=rational(nb=1,na=2) | f=spline(knots=6,range=[-4:4]) | H=rational(nb=1,na=1)",
                                   {1.0, 0.5, -1.1, 0.4, -2.0, -1.5, -0.9, -0.2, 0.4, 1.0, 1.6, 1.7, 1.0, 0.2, -0.6});
  Model oversampled =
      make_model(parse("G=rational(nb=1,na=2) | f=oversampled(spline(knots=6,range=[-4:4]),factor=4,"
                       "half_length=4) | H=rational(nb=1,na=1)"));
  oversampled.parameters = spline.parameters;
  return {{"wiener", testing::wiener(), {InitialState::zero, 5, 1}},
          {"hammerstein", testing::hammerstein(), {InitialState::zero, 0, 1}},
          {"wiener_hammerstein", testing::wiener_hammerstein(), {InitialState::zero, 20, 1}},
          {"parallel", testing::parallel_branches(), {InitialState::zero, 5, 1}},
          {"spline", spline, {InitialState::zero, 5, 1}},
          {"oversampled", oversampled, {InitialState::zero, 5, 1}},
          {"states", testing::wiener_hammerstein(), {InitialState::estimated, 0, 1}}};
}

class EliminatedCostTest : public ::testing::TestWithParam<std::size_t> {
 protected:
  EliminatedCostTest() : case_(cases()[GetParam()]), eliminated_(affine_parameters(case_.truth.chain)) {
    data_.records.push_back(testing::simulated_record(case_.truth, 300, 0.1, 11));
    data_.records.push_back(testing::simulated_record(case_.truth, 200, 0.1, 12));
    predictor_.emplace(case_.truth.chain, data_, case_.options);
    p_ = Eigen::VectorXd::Zero(predictor_->unknown_count());
    std::vector<Index> all;
    for (Index k = 0; k < case_.truth.parameters.size(); ++k) all.push_back(k);
    // The affine parameters are moved too: the reduced cost must not depend on where they start.
    p_.head(case_.truth.parameters.size()) = testing::moved(case_.truth.parameters, all, 0.1, 13);
  }

  // min over the affine parameters by QR of the dense columns.
  double reduced(const std::vector<Index>& remaining, const Eigen::VectorXd& q) const {
    Eigen::VectorXd p = p_;
    p(remaining) = q;
    const Dense dense = dense_residuals(case_.truth.chain, data_, case_.options, p);
    const Eigen::MatrixXd columns = dense.jacobian(Eigen::all, eliminated_);
    const Eigen::VectorXd norms = columns.colwise().norm();
    const Eigen::MatrixXd scaled = columns * norms.cwiseInverse().asDiagonal();
    return (dense.r - scaled * scaled.completeOrthogonalDecomposition().solve(dense.r)).squaredNorm();
  }

  // Evaluates with a Jacobian and compares everything with the definition.
  void expect_definition(const EliminatedCost& cost, const Eigen::VectorXd& q) const {
    const Index count = q.size();
    const double* parameters[] = {q.data()};
    Eigen::VectorXd r(count + 1);
    RowMajor jacobian(count + 1, count);
    double* jacobians[] = {jacobian.data()};
    ASSERT_TRUE(cost.Evaluate(parameters, r.data(), jacobians));
    const double expected = reduced(cost.remaining(), q);
    EXPECT_NEAR(r.squaredNorm(), expected, kCost * expected);
    // Kaufman's Gauss-Newton matrix: that of the other columns, projected off the affine ones, at the minimiser.
    const Dense dense = dense_residuals(case_.truth.chain, data_, case_.options, cost.complete(q));
    const Eigen::MatrixXd affine = dense.jacobian(Eigen::all, eliminated_);
    const Eigen::MatrixXd others = dense.jacobian(Eigen::all, cost.remaining());
    const Eigen::MatrixXd projected = others - affine * affine.completeOrthogonalDecomposition().solve(others);
    const Eigen::MatrixXd matrix = projected.transpose() * projected;
    EXPECT_LT((jacobian.transpose() * jacobian - matrix).norm(), kCost * others.squaredNorm());
    const Eigen::VectorXd gradient = 2.0 * jacobian.transpose() * r;
    constexpr double kStep = 1e-5;
    for (Index k = 0; k < count; ++k) {
      const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(count, k);
      const double slope = (reduced(cost.remaining(), q + step) - reduced(cost.remaining(), q - step)) / (2.0 * kStep);
      EXPECT_NEAR(gradient[k], slope, kGradient * (1.0 + gradient.norm())) << "unknown " << k;
    }
  }

  Case case_;
  std::vector<Index> eliminated_;
  DataSet data_;
  std::optional<Predictor> predictor_;
  Eigen::VectorXd p_;
};

TEST_P(EliminatedCostTest, IsTheLeastSquaresMinimumAndItsGradient) {
  const EliminatedCost cost(*predictor_, eliminated_, p_);
  const Index count = static_cast<Index>(cost.remaining().size());
  ASSERT_EQ(count + std::ssize(eliminated_), predictor_->unknown_count());
  ASSERT_EQ(cost.num_residuals(), count + 1);
  const Eigen::VectorXd start = p_(cost.remaining());
  // As Ceres asks: first at the start with a Jacobian, then elsewhere for the cost, then there with a Jacobian.
  expect_definition(cost, start);
  const Eigen::VectorXd elsewhere = 1.02 * start;
  const double* parameters[] = {elsewhere.data()};
  Eigen::VectorXd r(count + 1);
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), nullptr));
  const double expected = reduced(cost.remaining(), elsewhere);
  EXPECT_NEAR(r.squaredNorm(), expected, kCost * expected);
  expect_definition(cost, elsewhere);
  // A point that it has never seen, straight with a Jacobian.
  expect_definition(cost, 0.98 * start);
}

TEST_P(EliminatedCostTest, CompleteFillsInTheMinimiser) {
  const EliminatedCost cost(*predictor_, eliminated_, p_);
  const Eigen::VectorXd q = p_(cost.remaining());
  const Eigen::VectorXd p = cost.complete(q);
  ASSERT_EQ(p.size(), predictor_->unknown_count());
  EXPECT_EQ(Eigen::VectorXd(p(cost.remaining())), q);
  const double expected = reduced(cost.remaining(), q);
  EXPECT_NEAR(predictor_->sum_of_squares(p), expected, kCost * expected);
}

TEST_P(EliminatedCostTest, LeadsToTheMinimumOfTheJointFit) {
  Model start = case_.truth;
  start.parameters = testing::moved(case_.truth.parameters, {1, 2, 3}, 0.1, 14);
  RefitOptions options;
  options.prediction = case_.options;
  options.function_tolerance = 1e-14;
  options.covariance = false;
  options.static_parameters = StaticParameters::joint;
  const RefitReport joint = refit(start, data_, options);
  options.static_parameters = StaticParameters::eliminated;
  const RefitReport eliminated = refit(start, data_, options);
  EXPECT_EQ(eliminated.status, FitStatus::converged) << eliminated.message;
  EXPECT_LT(joint.rmse, 0.12);
  // Both stop where the cost changes by less than 1e-14 of itself: its root agrees to a few digits less.
  EXPECT_NEAR(eliminated.rmse, joint.rmse, 1e-9);
  if (case_.name == "parallel") return;  // the two constants trade: only the fit itself is comparable
  EXPECT_LT((eliminated.model.parameters - joint.model.parameters).cwiseAbs().maxCoeff(), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(All, EliminatedCostTest, ::testing::Range<std::size_t>(0, cases().size()),
                         [](const auto& instance) { return cases()[instance.param].name; });

TEST(EliminatedCostUnstableTest, RejectsPredictionsThatAreNotFinite) {
  const Model model = testing::hammerstein();
  const DataSet data(testing::simulated_record(model, 1000, 0.1, 15));
  const Predictor predictor(model.chain, data);
  const EliminatedCost cost(predictor, {0, 1, 2, 3}, model.parameters);
  Eigen::VectorXd q = model.parameters.tail(4);
  q[2] = -9.0;
  const double* parameters[] = {q.data()};
  Eigen::VectorXd r(5);
  RowMajor jacobian(5, 4);
  double* jacobians[] = {jacobian.data()};
  EXPECT_FALSE(cost.Evaluate(parameters, r.data(), nullptr));
  EXPECT_FALSE(cost.Evaluate(parameters, r.data(), jacobians));
  EXPECT_EQ(cost.complete(q).size(), 0);
  q = model.parameters.tail(4);
  EXPECT_TRUE(cost.Evaluate(parameters, r.data(), jacobians)) << "a rejected step must leave no trace";
}

TEST(EliminatedCostUnstableTest, RoundingDoesNotPassForAGoodFit) {
  // 1.1^400 = 4e16: finite, and r'r is rounding relative to the columns of J. The cost must be that of some c, and a
  // step back from there must find its way.
  const Model model = testing::hammerstein();
  const DataSet data(testing::simulated_record(model, 400, 0.1, 16));
  const Predictor predictor(model.chain, data);
  const EliminatedCost cost(predictor, {0, 1, 2, 3}, model.parameters);
  Eigen::VectorXd q(4);
  q << 1.0, 0.6, -1.1, 0.0;
  const double* parameters[] = {q.data()};
  Eigen::VectorXd r(5);
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), nullptr));
  // No filter with a pole at 1.1 comes near data from poles of 0.71; the noise alone has 400 * 0.1^2 = 4.
  EXPECT_GT(r.squaredNorm(), 100.0);
  q = model.parameters.tail(4);
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), nullptr));
  EXPECT_NEAR(r.squaredNorm(), 4.0, 1.0);
}

}  // namespace
}  // namespace blockid
