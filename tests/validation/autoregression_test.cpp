// The spectrum of a residual as an autoregression.
#include "support/signals.hpp"

#include <blockid/data/error.hpp>
#include <blockid/validation/autoregression.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

MaskedSignal whole(const VectorXd& x) { return {x, VectorXd::Ones(x.size())}; }

TEST(Autoregression, FindsAKnownOne) {
  // v_t = 1.2 v_{t-1} - 0.5 v_{t-2} + e_t
  testing::Noise noise(1);
  constexpr Index kSamples = 40000;
  VectorXd v = noise.white(kSamples);
  for (Index t = 2; t < kSamples; ++t) v[t] += 1.2 * v[t - 1] - 0.5 * v[t - 2];
  const MaskedSignal signal = whole(v);
  const Autoregression ar = fit_autoregression({&signal, 1}, 10);
  ASSERT_GE(ar.order(), 2);
  // Standard deviation sqrt((1 - a_2^2) / samples) = 0.0043 at order 2; four of them, and the extra orders that
  // Akaike's criterion takes now and then widen it by half.
  EXPECT_NEAR(ar.coefficients[0], -1.2, 0.026);
  EXPECT_NEAR(ar.coefficients[1], 0.5, 0.026);
  // Deviation of a variance: sqrt(2 / samples) = 0.7 %.
  EXPECT_NEAR(ar.innovation_variance, 1.0, 0.03);
}

TEST(Autoregression, WhiteNoiseNeedsHardlyAny) {
  testing::Noise noise(2);
  const MaskedSignal signal = whole(noise.white(5000, 3.0));
  const Autoregression ar = fit_autoregression({&signal, 1}, 20);
  EXPECT_LE(ar.order(), 3);
  EXPECT_NEAR(ar.variance, 9.0, 9.0 * 0.08);
  EXPECT_NEAR(ar.innovation_variance, ar.variance, 0.01 * ar.variance);
}

TEST(Autoregression, RecordsAndGapsCountTogether) {
  testing::Noise noise(3);
  std::vector<MaskedSignal> records;
  for (int k = 0; k < 4; ++k) {
    MaskedSignal record = whole(noise.coloured(5000, 0.9, 2.0));
    for (Index t = 0; t < 5000; t += 10) {
      record.mask[t] = 0.0;
      record.values[t] = std::numeric_limits<double>::quiet_NaN();
    }
    records.push_back(record);
  }
  const Autoregression ar = fit_autoregression(records, 5);
  // 4999 pairs of neighbours, of which each gap takes two, the first one only one: 4999 - 2 * 499 - 1.
  const PairSums sums = pair_sums(records, 1);
  EXPECT_DOUBLE_EQ(sums.counts[0], 4 * 4500.0);
  EXPECT_DOUBLE_EQ(sums.counts[1], 4 * 4000.0);
  // Variance 4; 20000 samples of this colour count as 20000 (1 - 0.81) / (1 + 0.81) = 2100: 3 % deviation.
  EXPECT_NEAR(ar.variance, 4.0, 4.0 * 0.13);
  EXPECT_NEAR(sums.products[1] / sums.counts[1] / ar.variance, 0.9, 0.02);
}

TEST(Autoregression, CovarianceIsThatOfTheStationaryProcess) {
  // (1 - 0.6 q^-1)(1 + 0.3 q^-1): rho_1 = 0.3 / (1 - 0.18), then rho_k = 0.3 rho_{k-1} + 0.18 rho_{k-2}.
  Autoregression ar;
  ar.coefficients = (VectorXd(2) << -0.3, -0.18).finished();
  ar.innovation_variance = 2.0;
  constexpr Index kSize = 40;
  VectorXd rho(kSize);
  rho[0] = 1.0;
  rho[1] = 0.3 / (1.0 - 0.18);
  for (Index k = 2; k < kSize; ++k) rho[k] = 0.3 * rho[k - 1] + 0.18 * rho[k - 2];
  const double variance = 2.0 / (1.0 - 0.3 * rho[1] - 0.18 * rho[2]);
  const MatrixXd r =
      MatrixXd::NullaryExpr(kSize, kSize, [&](Index i, Index j) { return variance * rho[std::abs(i - j)]; });
  testing::Noise noise(4);
  const MatrixXd z = noise.matrix(kSize, 4);
  const MatrixXd f = backward_filtered(ar, z);
  // The recursion backwards ends at 1e-8 of the signal; its square is left out of F'F, itself times the record of
  // R Z.
  EXPECT_LT((2.0 * f.transpose() * f - z.transpose() * r * z).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_LT((covariance_times(ar, z) - r * z).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Autoregression, WhiteNoiseFiltersNothing) {
  Autoregression white;
  white.autocorrelation = VectorXd::Ones(1);
  white.innovation_variance = 3.0;
  testing::Noise noise(5);
  const MatrixXd z = noise.matrix(20, 2);
  const MatrixXd f = backward_filtered(white, z);
  EXPECT_EQ(f.bottomRows(20), z);
  EXPECT_EQ(f.topRows(f.rows() - 20).norm(), 0.0);
  EXPECT_EQ(covariance_times(white, z), 3.0 * z);
}

TEST(Autoregression, EffectiveSamplesOfFirstOrder) {
  // sum rho^(2|k|) = (1 + rho^2) / (1 - rho^2)
  Autoregression ar;
  ar.coefficients = VectorXd::Constant(1, -0.8);
  ar.autocorrelation = (VectorXd(2) << 1.0, 0.8).finished();
  EXPECT_NEAR(effective_samples(ar, 10000), 10000.0 * 0.36 / 1.64, 1e-6);
  Autoregression white;
  white.autocorrelation = VectorXd::Ones(1);
  EXPECT_DOUBLE_EQ(effective_samples(white, 500), 500.0);
}

TEST(Autoregression, ConstantSignalHasNoVariance) {
  const MaskedSignal signal = whole(VectorXd::Constant(50, 2.5));
  const Autoregression ar = fit_autoregression({&signal, 1}, 5);
  EXPECT_EQ(ar.order(), 0);
  EXPECT_EQ(ar.variance, 0.0);
}

TEST(Autoregression, RefusesWhatIsNoSignal) {
  const MaskedSignal wrong{VectorXd::Zero(3), VectorXd::Ones(2)};
  EXPECT_THAT(
      [&] {
        static_cast<void>(fit_autoregression({&wrong, 1}, 2));
      },
      ThrowsMessage<Error>(HasSubstr("expected a mask of 3 samples, got 2")));
  const MaskedSignal infinite{VectorXd::Constant(3, std::numeric_limits<double>::infinity()), VectorXd::Ones(3)};
  EXPECT_THAT(
      [&] {
        static_cast<void>(fit_autoregression({&infinite, 1}, 2));
      },
      ThrowsMessage<Error>(HasSubstr("expected finite values")));
  const MaskedSignal nothing{VectorXd::Zero(3), VectorXd::Zero(3)};
  EXPECT_THAT(
      [&] {
        static_cast<void>(fit_autoregression({&nothing, 1}, 2));
      },
      ThrowsMessage<Error>(HasSubstr("at least one sample that counts")));
}

}  // namespace
}  // namespace blockid
