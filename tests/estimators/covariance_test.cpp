#include <blockid/estimators/refit.hpp>

#include "data/message.hpp"
#include "estimators/dense_twin.hpp"
#include "estimators/systems.hpp"

#include <blockid/estimators/gauges.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace blockid {
namespace {

using testing::Dense;
using testing::dense_residuals;
using ::testing::HasSubstr;

// (J'J)^-1 of a problem of condition 1e3, squared, from tangents that agree to 1e-10.
constexpr double kInverse = 1e-6;

class CovarianceTest : public ::testing::Test {
 protected:
  CovarianceTest() {
    data_.records.push_back(testing::simulated_record(model_, 500, 0.1, 3));
    data_.records.push_back(testing::simulated_record(model_, 300, 0.1, 4));
    options_.prediction.warmup = 10;
    dense_ = dense_residuals(model_.chain, data_, options_.prediction, model_.parameters);
  }

  Eigen::MatrixXd columns(const std::vector<Index>& free) const { return dense_.jacobian(Eigen::all, free); }

  void expect_matrix(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected, const std::vector<Index>& free) {
    const Eigen::VectorXd scale = expected.diagonal().cwiseSqrt().cwiseInverse();
    EXPECT_LT((scale.asDiagonal() * (found(free, free) - expected) * scale.asDiagonal()).cwiseAbs().maxCoeff(),
              kInverse);
    EXPECT_NEAR(found.norm(), found(free, free).norm(), 1e-12 * found.norm()) << "held rows must be zero";
  }

  Model model_ = testing::wiener_hammerstein();
  DataSet data_;
  CovarianceOptions options_;
  Dense dense_;
  const std::vector<Index> free_ = {1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12};
};

TEST_F(CovarianceTest, IsTheInverseOfTheNormalMatrix) {
  const Covariance result = covariance(model_, data_, options_);
  const double variance = dense_.r.squaredNorm() / (800.0 - 20.0 - 11.0);
  EXPECT_NEAR(result.noise_variance, variance, 1e-10);
  EXPECT_EQ(result.free_count, 11);
  EXPECT_EQ(result.rank, 11);
  const Eigen::MatrixXd j = columns(free_);
  const Eigen::MatrixXd expected = variance * (j.transpose() * j).inverse();
  expect_matrix(result.parameters, expected, free_);
  EXPECT_EQ(result.standard_deviations, Eigen::VectorXd(result.parameters.diagonal().cwiseSqrt()));
  const Eigen::VectorXd values = (j * j.colwise().norm().cwiseInverse().asDiagonal()).jacobiSvd().singularValues();
  EXPECT_NEAR(result.condition / (values[0] / values[10]), 1.0, kInverse);
}

TEST_F(CovarianceTest, FrozenParametersCarryNoUncertainty) {
  // f.c3 takes the place of the hold on G1.b0.
  options_.frozen = {"f.c3", "G2.a1"};
  const std::vector<Index> free = {0, 1, 2, 3, 4, 5, 6, 7, 10, 12};
  const Covariance result = covariance(model_, data_, options_);
  const Eigen::MatrixXd j = columns(free);
  expect_matrix(result.parameters, dense_.r.squaredNorm() / (780.0 - 10.0) * (j.transpose() * j).inverse(), free);
  options_.frozen = {"f.c9"};
  EXPECT_THAT(BLOCKID_MESSAGE(covariance(model_, data_, options_)), HasSubstr("f.c9"));
}

TEST_F(CovarianceTest, RobustIsTheSandwich) {
  options_.robust = true;
  options_.batch = 64;
  const Covariance result = covariance(model_, data_, options_);
  const Eigen::MatrixXd j = columns(free_);
  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(11, 11);
  Index row = 0;
  for (const Index length : {500, 300}) {
    for (Index first = 0; first < length; first += 64) {
      const Index rows = std::min<Index>(64, length - first);
      const Eigen::VectorXd score = j.middleRows(row + first, rows).transpose() * dense_.r.segment(row + first, rows);
      middle += score * score.transpose();
    }
    row += length;
  }
  const Eigen::MatrixXd inverse = (j.transpose() * j).inverse();
  expect_matrix(result.parameters, inverse * middle * inverse, free_);
  options_.batch = 0;
  EXPECT_THAT(BLOCKID_MESSAGE(covariance(model_, data_, options_)), HasSubstr("got 0"));
}

TEST_F(CovarianceTest, InvariantWhereParametersChangeTheirUnits) {
  // The same system with the output in thousandths: deviations of f scale, those of the poles stay.
  const Covariance result = covariance(model_, data_, options_);
  Model scaled = model_;
  scaled.parameters.segment(5, 4) *= 1e3;
  DataSet scaled_data = data_;
  for (Record& record : scaled_data.records) record.y *= 1e3;
  const Covariance other = covariance(scaled, scaled_data, options_);
  Eigen::VectorXd factor = Eigen::VectorXd::Ones(13);
  factor.segment(5, 4).setConstant(1e3);
  for (const Index k : free_) {
    EXPECT_NEAR(other.standard_deviations[k] / (factor[k] * result.standard_deviations[k]), 1.0, kInverse);
  }
}

TEST(Covariance, SurvivesAConditionThatItsSquareDoesNot) {
  // Five poles of one kind: single coefficients are badly known, the gain at low frequencies is known well.
  Model model = make_model(parse("G=rational(nb=4,na=5)"));
  Eigen::VectorXd a = Eigen::VectorXd::Ones(1);
  for (const double pole : {0.4, 0.6, 0.75, 0.85, 0.9}) {
    Eigen::VectorXd next = Eigen::VectorXd::Zero(a.size() + 1);
    next.head(a.size()) = a;
    next.tail(a.size()) -= pole * a;
    a = next;
  }
  model.parameters << 0.01, -0.02, 0.03, -0.01, 0.02, a.tail(5);
  const DataSet data = testing::simulated_record(model, 4000, 0.1, 5);
  CovarianceOptions options;
  options.prediction.warmup = 10;
  options.hold_gauges = false;
  options.batch = 100;

  const Dense dense = dense_residuals(model.chain, data, options.prediction, model.parameters);
  const Eigen::VectorXd scale = dense.jacobian.colwise().norm();
  const Eigen::MatrixXd scaled = dense.jacobian * scale.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& values = svd.singularValues();
  ASSERT_GT(values[0] / values[9], 1e5) << "condition";
  ASSERT_LT(values[0] / values[9], 2e7) << "condition";

  // Derivatives of the gain G(1) = b(1) / a(1), and its variance from the factors of J.
  const double below = a.sum();
  const double gain = model.parameters.head(5).sum() / below;
  Eigen::VectorXd slope(10);
  slope << Eigen::VectorXd::Constant(5, 1.0 / below), Eigen::VectorXd::Constant(5, -gain / below);
  const Eigen::VectorXd z =
      values.cwiseInverse().asDiagonal() * (svd.matrixV().transpose() * (slope.array() / scale.array()).matrix());
  const double plain = z.squaredNorm() * dense.r.squaredNorm() / (3990.0 - 10.0);
  const Eigen::VectorXd weights = svd.matrixU() * z;
  double robust = 0.0;
  for (Index begin = 0; begin < 4000; begin += 100) {
    const double score = weights.segment(begin, 100).dot(dense.r.segment(begin, 100));
    robust += score * score;
  }

  const Covariance result = covariance(model, data, options);
  EXPECT_EQ(result.rank, 10);
  EXPECT_NEAR(slope.dot(result.parameters * slope) / plain, 1.0, 1e-3);
  options.robust = true;
  EXPECT_NEAR(slope.dot(covariance(model, data, options).parameters * slope) / robust, 1.0, 1e-3);
}

TEST_F(CovarianceTest, NotFinitePredictionsGiveNoNumbers) {
  model_.parameters[3] = -40.0;
  const Covariance result = covariance(model_, data_, options_);
  EXPECT_TRUE(std::isnan(result.standard_deviations[1]));
  EXPECT_EQ(result.rank, 0);
}

}  // namespace
}  // namespace blockid
