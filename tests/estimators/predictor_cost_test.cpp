#include <blockid/estimators/predictor_cost.hpp>

#include <blockid/blocks/rational.hpp>

#include "estimators/dense_twin.hpp"
#include "estimators/systems.hpp"

#include <ceres/gradient_checker.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

namespace blockid {
namespace {

using testing::Dense;
using testing::dense_residuals;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Analytic tangents against Jets, see predictor_test.cpp; J'J and its root add two digits.
constexpr double kModel = 1e-9;

class CostFixture : public ::testing::Test {
 protected:
  CostFixture() {
    data_.records.push_back(testing::simulated_record(truth_, 400, 0.05, 5));
    data_.records.push_back(testing::simulated_record(truth_, 150, 0.05, 6));
    p_ = testing::moved(truth_.parameters, {1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12}, 0.2, 7);
  }

  Model truth_ = testing::wiener_hammerstein();
  DataSet data_;
  PredictionOptions options_ = {InitialState::zero, 10, 1};
  Eigen::VectorXd p_;
};

class PredictorCostTest : public CostFixture, public ::testing::WithParamInterface<Handover> {};

TEST_P(PredictorCostTest, KeepsCostGradientAndGaussNewtonMatrix) {
  const Predictor predictor(truth_.chain, data_, options_);
  const PredictorCost cost(predictor, GetParam());
  const Index rows = cost.num_residuals();
  ASSERT_EQ(rows, GetParam() == Handover::full ? 550 : 14);
  ASSERT_EQ(cost.parameter_block_sizes(), std::vector<int>{13});
  const Dense dense = dense_residuals(truth_.chain, data_, options_, p_);

  Eigen::VectorXd r(rows);
  RowMajor jacobian(rows, 13);
  const double* parameters[] = {p_.data()};
  double* jacobians[] = {jacobian.data()};
  ASSERT_TRUE(cost.Evaluate(parameters, r.data(), jacobians));
  const Eigen::MatrixXd expected = dense.jacobian.transpose() * dense.jacobian;
  EXPECT_NEAR(r.squaredNorm(), dense.r.squaredNorm(), kModel * dense.r.squaredNorm());
  EXPECT_LT((jacobian.transpose() * r - dense.jacobian.transpose() * dense.r).norm(),
            kModel * dense.jacobian.norm() * dense.r.norm());
  EXPECT_LT((jacobian.transpose() * jacobian - expected).norm(), kModel * expected.norm());

  // The cost alone, both ways that Ceres asks for it.
  double* no_block[] = {nullptr};
  for (double** none : {static_cast<double**>(nullptr), static_cast<double**>(no_block)}) {
    Eigen::VectorXd alone(rows);
    ASSERT_TRUE(cost.Evaluate(parameters, alone.data(), none));
    EXPECT_NEAR(alone.squaredNorm(), dense.r.squaredNorm(), kModel * dense.r.squaredNorm());
  }
}

TEST_P(PredictorCostTest, RejectsPredictionsThatAreNotFinite) {
  const Predictor predictor(truth_.chain, data_, options_);
  const PredictorCost cost(predictor, GetParam());
  p_[3] = -40.0;
  Eigen::VectorXd r(cost.num_residuals());
  RowMajor jacobian(cost.num_residuals(), 13);
  const double* parameters[] = {p_.data()};
  double* jacobians[] = {jacobian.data()};
  EXPECT_FALSE(cost.Evaluate(parameters, r.data(), nullptr));
  EXPECT_FALSE(cost.Evaluate(parameters, r.data(), jacobians));
}

class CeresTest : public CostFixture {};

// Parameters after `iterations` of Levenberg-Marquardt.
Eigen::VectorXd after(const Predictor& predictor, Handover handover, Eigen::VectorXd p, int iterations,
                      ceres::LinearSolverType solver) {
  PredictorCost cost(predictor, handover);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  problem.AddResidualBlock(&cost, nullptr, p.data());
  // The gain of each filter is a gauge; without it the matrix is singular and no two factorisations agree.
  problem.SetManifold(p.data(), new ceres::SubsetManifold(static_cast<int>(p.size()), {0, 9}));
  ceres::Solver::Options options;
  options.linear_solver_type = solver;
  options.max_num_iterations = iterations;
  options.function_tolerance = 0.0;
  options.parameter_tolerance = 0.0;
  options.gradient_tolerance = 0.0;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_EQ(summary.iterations.size(), static_cast<std::size_t>(iterations) + 1);
  return p;
}

TEST_F(CeresTest, CeresTakesTheSameStepsWithEach) {
  // Steps are solutions of the same linear system, of condition number 1e3 (squared where J'J is formed): rounding
  // leaves nine digits after a few iterations.
  constexpr double kStep = 1e-8;
  const Predictor predictor(truth_.chain, data_, options_);
  for (const int iterations : {1, 2, 3, 5}) {
    const Eigen::VectorXd full = after(predictor, Handover::full, p_, iterations, ceres::DENSE_QR);
    EXPECT_GT((full - p_).norm(), 1e-2);
    const struct {
      Handover handover;
      ceres::LinearSolverType solver;
    } others[] = {{Handover::full, ceres::DENSE_NORMAL_CHOLESKY},
                  {Handover::compressed, ceres::DENSE_QR},
                  {Handover::compressed, ceres::DENSE_NORMAL_CHOLESKY},
                  {Handover::triangle, ceres::DENSE_QR}};
    for (const auto& other : others) {
      const Eigen::VectorXd p = after(predictor, other.handover, p_, iterations, other.solver);
      EXPECT_LT((p - full).cwiseAbs().maxCoeff(), kStep * (full - p_).norm())
          << "after " << iterations << " iterations, form " << static_cast<int>(other.handover);
    }
  }
}

TEST_F(CeresTest, PassesTheGradientCheckOfCeres) {
  const Predictor predictor(truth_.chain, data_, options_);
  const PredictorCost cost(predictor, Handover::full);
  const std::vector<const ceres::Manifold*>* no_manifolds = nullptr;
  ceres::NumericDiffOptions numeric;
  // A larger first step of Ridders's method would leave the stable filters.
  numeric.ridders_relative_initial_step_size = 1e-4;
  const ceres::GradientChecker checker(&cost, no_manifolds, numeric);
  ceres::GradientChecker::ProbeResults results;
  const double* parameters[] = {p_.data()};
  // Central or Ridders differences of a smooth function of size one.
  constexpr double kDifference = 1e-6;
  EXPECT_TRUE(checker.Probe(parameters, kDifference, &results)) << results.maximum_relative_error;
}

std::string name_of(const ::testing::TestParamInfo<Handover>& instance) {
  switch (instance.param) {
    case Handover::full:
      return "full";
    case Handover::compressed:
      return "compressed";
    case Handover::triangle:
      return "triangle";
  }
  return {};
}

TEST_P(PredictorCostTest, RefusesCostsWhoseDerivativesOverflow) {
  // y of the order of g^t: with g = 2.42 after 400 samples g^798 = 1e306, and t g^(t-1) squared is beyond all numbers.
  // A step there must not be taken for a finite cost: Ceres writes to stderr when derivatives fail behind it.
  const AnyBlock pole = Rational(0, 1);
  Record record;
  record.u = Eigen::VectorXd::Unit(400, 0);
  record.y = Eigen::VectorXd::Zero(400);
  const DataSet data(record);
  const Predictor predictor(pole, data, {});
  const PredictorCost cost(predictor, GetParam());
  std::vector<double> residuals(static_cast<std::size_t>(cost.num_residuals()));
  const auto evaluated = [&](double pole_place) {
    const Eigen::Vector2d p(1.0, -pole_place);
    const double* parameters[] = {p.data()};
    return cost.Evaluate(parameters, residuals.data(), nullptr);
  };
  EXPECT_TRUE(std::isfinite(predictor.sum_of_squares(Eigen::Vector2d(1.0, -2.42))));
  EXPECT_FALSE(evaluated(2.42));
  EXPECT_TRUE(evaluated(2.0));
  EXPECT_TRUE(evaluated(0.5));
}

INSTANTIATE_TEST_SUITE_P(All, PredictorCostTest,
                         ::testing::Values(Handover::full, Handover::compressed, Handover::triangle), name_of);

}  // namespace
}  // namespace blockid
