#include "blockid/data/transforms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "message.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Record noisy(Eigen::Index count, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal(3.0, 2.0);
  Record record;
  record.u.resize(count);
  record.y.resize(count);
  for (Eigen::Index t = 0; t < count; ++t) {
    record.u[t] = normal(generator);
    record.y[t] = 1e3 * normal(generator) + 7.0 * static_cast<double>(t);
  }
  return record;
}

double rounding(const Eigen::VectorXd& x) {
  return 8 * std::numeric_limits<double>::epsilon() * x.cwiseAbs().maxCoeff();
}

void expect_undone(const Record& record, const Standardised& standardised) {
  const Record again = undo(standardised);
  EXPECT_LE((again.u - record.u).cwiseAbs().maxCoeff(), rounding(record.u));
  EXPECT_LE((again.y - record.y).cwiseAbs().maxCoeff(), rounding(record.y));
  EXPECT_EQ(again.sample_time_s, record.sample_time_s);
}

TEST(AffineTest, InverseUndoesForward) {
  const Affine affine{4.0, -0.5};
  EXPECT_EQ(affine.forward(5.0), -2.0);
  EXPECT_EQ(affine.inverse(affine.forward(5.0)), 5.0);
}

TEST(TransformsTest, EachIsUndone) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Record record = noisy(1000, seed);
    expect_undone(record, detrend(record, 0));
    expect_undone(record, detrend(record, 1));
    expect_undone(record, standardise(record));
  }
}

TEST(TransformsTest, UndoIsExactInExactArithmetic) {
  Record record;
  record.u = Eigen::Vector4d(1, 2, 3, 10);
  record.y = Eigen::Vector4d(5, 7, 9, 3);
  const Standardised result = detrend(record, 0);
  EXPECT_EQ(result.record.u, Eigen::Vector4d(-3, -2, -1, 6));
  EXPECT_EQ(result.record.y, Eigen::Vector4d(-1, 1, 3, -3));
  EXPECT_EQ(undo(result).u, record.u);
  EXPECT_EQ(undo(result).y, record.y);
}

TEST(TransformsTest, StandardisedHasZeroMeanAndUnitSpread) {
  const Record z = standardise(noisy(500, 4)).record;
  EXPECT_NEAR(z.u.mean(), 0.0, 1e-13);
  EXPECT_NEAR(z.y.mean(), 0.0, 1e-13);
  EXPECT_NEAR(z.u.squaredNorm() / 500, 1.0, 1e-13);
  EXPECT_NEAR(z.y.squaredNorm() / 500, 1.0, 1e-13);
}

TEST(TransformsTest, LineIsRemovedEntirely) {
  Record record = noisy(50, 5);
  for (Eigen::Index t = 0; t < 50; ++t) record.y[t] = 4.0 - 0.25 * static_cast<double>(t);
  const Standardised result = detrend(record, 1);
  EXPECT_NEAR(result.y.slope_per_sample, -0.25, 1e-14);
  EXPECT_NEAR(result.y.affine.offset, 4.0, 1e-13);
  EXPECT_LE(result.record.y.cwiseAbs().maxCoeff(), 1e-12);
}

TEST(TransformsTest, DetrendingLeavesNothingToDetrend) {
  const Standardised again = detrend(detrend(noisy(300, 6), 1).record, 1);
  EXPECT_NEAR(again.y.affine.offset, 0.0, 1e-9);
  EXPECT_NEAR(again.y.slope_per_sample, 0.0, 1e-11);
}

TEST(TransformsTest, MissingSamplesDoNotCount) {
  Record record;
  record.u = Eigen::Vector4d(1, 3, 100, 5);
  record.y = Eigen::Vector4d(2, 4, kNan, 6);
  record.weights = Eigen::Vector4d(1, 1, 0, 1);
  const Standardised mean = detrend(record, 0);
  EXPECT_EQ(mean.u.affine.offset, 3.0);
  EXPECT_EQ(mean.y.affine.offset, 4.0);
  EXPECT_TRUE(std::isnan(mean.record.y[2]));
  EXPECT_TRUE(std::isnan(undo(mean).y[2]));
  EXPECT_EQ(undo(mean).u, record.u);
  EXPECT_NEAR(standardise(record).y.affine.scale, std::sqrt(8.0 / 3.0), 1e-15);
}

TEST(TransformsTest, WeightsCountAsInTheResiduals) {
  Record record;
  record.u = Eigen::Vector2d(0, 1);
  record.y = Eigen::Vector2d(0, 10);
  record.weights = Eigen::Vector2d(1, 2);
  EXPECT_NEAR(detrend(record, 0).y.affine.offset, 8.0, 1e-14);
}

TEST(TransformsTest, RefusesWhatItCannotDo) {
  Record record = noisy(10, 7);
  EXPECT_THAT(BLOCKID_MESSAGE(detrend(record, 2)), AllOf(HasSubstr("order is 2"), HasSubstr("expected 0")));
  record.y.setConstant(0.1);
  EXPECT_THAT(BLOCKID_MESSAGE(standardise(record)), AllOf(HasSubstr("constant signal 'y'"), HasSubstr("0.1")));
  EXPECT_THAT(BLOCKID_MESSAGE(detrend(slice(record, 0, 1), 1)), AllOf(HasSubstr("1 present"), HasSubstr("at least 2")));
  record.weights = Eigen::VectorXd::Zero(10);
  EXPECT_THAT(BLOCKID_MESSAGE(standardise(record)), HasSubstr("0 present"));
  record.y.conservativeResize(9);
  EXPECT_THAT(BLOCKID_MESSAGE(detrend(record, 0)), HasSubstr("unequal lengths"));
}

}  // namespace
}  // namespace blockid
