// Blocks as transfer functions, and the refit of continuous-time models.
#include <blockid/estimators/continuous_chain.hpp>
#include <blockid/estimators/continuous_fit.hpp>
#include <blockid/estimators/continuous_refit.hpp>

#include "data/message.hpp"

#include <blockid/problems/gaussian.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace blockid {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

constexpr double kSampleTime = 0.01;

/// Poles at -2 +- 4.4 j and -73 rad/s, a numerator of the given degree.
ContinuousTransferFunction system_of(Index numerator_degree) {
  return {localising_basis(Vector3d(2.0, 11.0, 60.0), numerator_degree), Vector3d(0.3, -0.8, 0.2),
          Eigen::Vector4d(1.0, 0.4, -2.0, 0.2).head(numerator_degree + 1)};
}

/// A smooth input in the middle of its course, output with white noise of deviation 0.01.
Record measured(const ContinuousTransferFunction& system, Hold hold, Index samples = 1000) {
  constexpr Index kBefore = 100;
  Record record;
  record.sample_time_s = kSampleTime;
  record.u = VectorXd::NullaryExpr(samples + kBefore, [](Index k) {
    const double t = kSampleTime * static_cast<double>(k);
    return std::sin(0.3 + 10.0 * t) + std::sin(1.3 * t) + std::cos(4.0 * t * t);
  });
  record.y = VectorXd::Zero(record.u.size());
  record.y = simulate(system, record, {hold, InitialState::zero, 0});
  record = slice(record, kBefore, samples + kBefore);
  record.y += 0.01 * problems::Gaussian(1).vector(samples);
  return record;
}

RefitOptions estimated_start() {
  RefitOptions options;
  options.prediction.initial_state = InitialState::estimated;
  return options;
}

class BlockOfDegree : public ::testing::TestWithParam<Index> {};

TEST_P(BlockOfDegree, GivesItsTransferFunctionBack) {
  const ContinuousTransferFunction system = system_of(GetParam());
  const Model model = as_model(system, {kSampleTime, Hold::first_order});
  const ContinuousRational block(GetParam(), 3, {kSampleTime, Hold::first_order}, {2.0, 11.0, 60.0});
  const ContinuousTransferFunction back = transfer_function_of(block, model.parameters);
  EXPECT_LT((back.denominator - system.denominator).norm(), 1e-15);
  // Of the order of one, a dozen operations.
  EXPECT_LT((back.numerator - system.numerator).norm(), 1e-14);
  EXPECT_EQ(back.basis.numerator_degree, GetParam());
}
INSTANTIATE_TEST_SUITE_P(Numerators, BlockOfDegree, ::testing::Values(0, 1, 2, 3));

TEST(ContinuousRefit, AgreesWithRefinedInstrumentalVariables) {
  // Both end where the gradient of the output error vanishes. The one stops when a step is below 1e-3 of the standard
  // deviation, the other when the cost changes by 1e-10, which is sqrt(1e-10 * 1000) = 3e-4 of it.
  constexpr double kShare = 0.01;
  const ContinuousTransferFunction system = system_of(3);
  for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
    const Record record = measured(system, hold);
    ContinuousFitOptions options;
    options.input_hold = hold;
    options.output_hold = Hold::septic;
    const ContinuousFit fit = fit_continuous(record, localising_basis(Vector3d(1.5, 20.0, 100.0), 3), options);
    const ContinuousRefit refitted = refit(fit.model, record, hold, estimated_start());
    EXPECT_EQ(refitted.report.status, FitStatus::converged) << to_text(hold);
    EXPECT_NEAR(refitted.report.rmse, fit.rms, 1e-6 * fit.rms) << to_text(hold);
    const VectorXcd distance = poles(refitted.transfer_function) - poles(fit.model);
    for (Index k = 0; k < 3; ++k) {
      EXPECT_LT(std::abs(distance[k].real()), kShare * fit.pole_deviations.real[k]) << to_text(hold) << ' ' << k;
      EXPECT_NEAR(refitted.pole_deviations.real[k], fit.pole_deviations.real[k], kShare * fit.pole_deviations.real[k])
          << to_text(hold) << ' ' << k;
    }
  }
}

TEST(ContinuousRefit, LeavesOutTheEndsThatASplineSees) {
  const ContinuousTransferFunction system = system_of(2);
  const Record record = measured(system, Hold::cubic);
  const ContinuousRefit refitted = refit(system, record, Hold::cubic, estimated_start());
  // 0.01 to within three standard deviations, 1 / sqrt(2 * 942).
  EXPECT_NEAR(refitted.report.rmse, 0.01, 3.0 * 0.01 / std::sqrt(1884.0));
  ASSERT_TRUE(refitted.report.covariance.has_value());
  EXPECT_TRUE(refitted.report.covariance->undetermined.empty());
  EXPECT_THAT(BLOCKID_MESSAGE(refit(system, slice(record, 0, 58), Hold::cubic, estimated_start())),
              HasSubstr("leaves out 58 samples at the ends of"));
}

TEST(ContinuousRefit, BridgesGapsAndTakesModelsInPowersOfS) {
  const ContinuousTransferFunction system = system_of(1);
  Record record = measured(system, Hold::first_order);
  record.weights = VectorXd::Ones(1000);
  for (Index t = 3; t < 1000; t += 10) record.weights[t] = 0.0;
  ContinuousFitOptions options;
  options.method = ContinuousMethod::least_squares;
  const ContinuousFit start =
      fit_continuous(measured(system, Hold::first_order), state_variable_basis(3, 1, 20.0), options);
  const ContinuousRefit refitted = refit(start.model, record, Hold::first_order, estimated_start());
  EXPECT_EQ(refitted.report.status, FitStatus::converged);
  EXPECT_EQ(refitted.transfer_function.basis.kind, BasisKind::localising);
  EXPECT_NEAR(refitted.report.rmse, 0.01, 3.0 * 0.01 / std::sqrt(1800.0));
}

TEST(ContinuousRefit, FindsAStableSystemFromAnUnstableStart) {
  const ContinuousTransferFunction system = system_of(2);
  const Record record = measured(system, Hold::first_order);
  // The fast pole at -73 rad/s goes to +200: a simulation grows by e^2 a sample, e^2000 over the record.
  ContinuousTransferFunction start = system;
  start.denominator = Vector3d(0.3, -0.8, -1.1);
  ASSERT_GT(poles(start).real().maxCoeff(), 1.0);
  const ContinuousRefit refitted = refit(start, record, Hold::first_order, estimated_start());
  EXPECT_EQ(refitted.report.status, FitStatus::converged);
  EXPECT_TRUE(is_stable(refitted.transfer_function));
  EXPECT_NEAR(refitted.report.rmse, 0.01, 3.0 * 0.01 / std::sqrt(2000.0));
}

TEST(ContinuousRefit, KeepsAnUnstableSystemUnstable) {
  // (s + 1)(s + 2) - 2 (s + 2) = (s - 1)(s + 2) over 3 s: a factor e^3 = 20.
  const ContinuousTransferFunction system{localising_basis(Eigen::Vector2d(1.0, 2.0), 1), Eigen::Vector2d(-2.0, 0.0),
                                          Eigen::Vector2d(1.0, 0.5)};
  const ContinuousRefit refitted =
      refit(system, measured(system, Hold::first_order, 300), Hold::first_order, estimated_start());
  EXPECT_NEAR(refitted.report.rmse, 0.01, 3.0 * 0.01 / std::sqrt(600.0));
  Index place = 0;
  const double pole = poles(refitted.transfer_function).real().maxCoeff(&place);
  EXPECT_GT(pole, 0.0);
  // Outside 4.5 deviations lies 7e-6 of a normal distribution.
  EXPECT_NEAR(pole, 1.0, 4.5 * refitted.pole_deviations.real[place]);
  EXPECT_LT(refitted.pole_deviations.real[place], 0.5);
}

TEST(ContinuousRefitErrors, AreNamed) {
  const ContinuousRational block(1, 2, {kSampleTime, Hold::first_order});
  EXPECT_THAT(BLOCKID_MESSAGE(transfer_function_of(block, VectorXd::Zero(3))),
              HasSubstr("expected 4 parameters, got 3"));
}

}  // namespace
}  // namespace blockid
