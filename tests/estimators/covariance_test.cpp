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
  options_.frozen = {"f.c3", "G2.a1"};
  const std::vector<Index> free = {1, 2, 3, 4, 5, 6, 7, 10, 12};
  const Covariance result = covariance(model_, data_, options_);
  const Eigen::MatrixXd j = columns(free);
  expect_matrix(result.parameters, dense_.r.squaredNorm() / (780.0 - 9.0) * (j.transpose() * j).inverse(), free);
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

TEST_F(CovarianceTest, NotFinitePredictionsGiveNoNumbers) {
  model_.parameters[3] = -40.0;
  const Covariance result = covariance(model_, data_, options_);
  EXPECT_TRUE(std::isnan(result.standard_deviations[1]));
  EXPECT_EQ(result.rank, 0);
}

}  // namespace
}  // namespace blockid
