// Continuous-time models of which coefficients are known to be zero.
#include <blockid/estimators/continuous_fit.hpp>

#include "data/message.hpp"

#include <blockid/problems/gaussian.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace blockid {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;

constexpr double kSampleTime = 0.01;
constexpr double kScale = 10.0;

/// (5 s^2 + 300) / (s^3 + 6 s^2 + 100 s): b1 and a0 are missing. In powers of s / 10.
ContinuousTransferFunction integrator_with_notch() {
  return {monomial_basis(3, 2, kScale), Eigen::Vector3d(0.0, 1.0, 0.6), Eigen::Vector3d(0.3, 0.0, 0.5)};
}

/// White input held between samples, output from rest; the later part of it.
Record held_record(Index samples, std::uint64_t seed, const ContinuousTransferFunction& system) {
  Record record;
  record.sample_time_s = kSampleTime;
  record.u = problems::Gaussian(seed).vector(samples + 50);
  record.y = VectorXd::Zero(samples + 50);
  record.y = simulate(system, record, {Hold::zero_order, InitialState::zero, 0});
  return slice(record, 50, samples + 50);
}

std::vector<RationalBasis> bases(Index numerator_degree) {
  return {localising_basis(break_points(2.0, 40.0, 3), numerator_degree),
          state_variable_basis(3, numerator_degree, 12.0), laguerre_basis(3, numerator_degree, 12.0)};
}

ContinuousFitOptions options_of(ContinuousMethod method) {
  ContinuousFitOptions options;
  options.method = method;
  options.input_hold = Hold::zero_order;
  options.output_hold = Hold::septic;
  return options;
}

constexpr ContinuousMethod kMethods[] = {ContinuousMethod::least_squares, ContinuousMethod::instrumental_variables,
                                         ContinuousMethod::refined_instrumental_variables};

/// [b0, b1, b2, a0, a1, a2] in powers of s / 10.
VectorXd coefficients_of(const ContinuousTransferFunction& model) {
  const RationalPolynomials p = polynomials(model, kScale);
  VectorXd result(p.numerator.size() + p.denominator.size() - 1);
  result << p.numerator, p.denominator.head(p.denominator.size() - 1);
  return result;
}

TEST(MissingCoefficients, StayZeroInEveryBasisAndTheOthersAreFound) {
  const ContinuousTransferFunction truth = integrator_with_notch();
  const Record record = held_record(600, 1, truth);
  for (const ContinuousMethod method : kMethods) {
    ContinuousFitOptions options = options_of(method);
    options.zero_numerator = {1};
    options.zero_denominator = {0};
    // Of the first two methods the output's hold is part of the error: a spline through a response to steps, of which
    // the corners are the h / 2 = 5 ms times the fastest pole's 10 rad/s = 5 % wrong.
    const double tolerance = method == ContinuousMethod::refined_instrumental_variables ? 1e-8 : 5e-2;
    for (const RationalBasis& basis : bases(2)) {
      SCOPED_TRACE(to_text(method) + " " + to_text(basis.kind));
      const ContinuousFit fit = fit_continuous(record, basis, options);
      const VectorXd found = coefficients_of(fit.model);
      EXPECT_LT((found - coefficients_of(truth)).cwiseAbs().maxCoeff(), tolerance);
      // Sums of terms of the size of one to ten.
      EXPECT_NEAR(found[1], 0.0, 1e-13);
      EXPECT_NEAR(found[3], 0.0, 1e-13);
      EXPECT_LT(std::abs(poles(fit.model)[0]), 1e-10);
      EXPECT_FALSE(fit.flags.unstable);
      EXPECT_FALSE(fit.flags.not_converged);
      EXPECT_EQ(fit.unknowns, 3 + 4);
      EXPECT_EQ(fit.rank, 7);
    }
  }
}

TEST(MissingCoefficients, WithoutTheHighestOneIsALowerDegree) {
  const ContinuousTransferFunction truth{monomial_basis(3, 1, kScale), Eigen::Vector3d(0.2, 1.0, 0.6),
                                         Eigen::Vector2d(0.3, 0.1)};
  Record record = held_record(600, 2, truth);
  record.y += 0.05 * record.y.cwiseAbs().maxCoeff() * problems::Gaussian(3).vector(600);
  for (const ContinuousMethod method : kMethods) {
    ContinuousFitOptions left_out = options_of(method);
    left_out.zero_numerator = {2};
    // Laguerre functions have one numerator degree only.
    for (const RationalBasis& basis : {bases(2)[0], bases(2)[1]}) {
      SCOPED_TRACE(to_text(method) + " " + to_text(basis.kind));
      RationalBasis of_lower_degree = basis;
      of_lower_degree.numerator_degree = 1;
      const ContinuousFit lower = fit_continuous(record, of_lower_degree, options_of(method));
      const ContinuousFit fit = fit_continuous(record, basis, left_out);
      const VectorXd omega = break_points(0.5, 200.0, 50);
      const Eigen::VectorXcd expected = response_at(lower.model, omega);
      // The same equations in other coordinates; condition numbers of 1e3 to 1e5.
      EXPECT_LT((response_at(fit.model, omega) - expected).norm(), 1e-8 * expected.norm());
      EXPECT_NEAR(fit.noise_deviation, lower.noise_deviation, 1e-8 * lower.noise_deviation);
      const VectorXd deviation = response_deviation(lower.model, lower.covariance, omega);
      EXPECT_LT((response_deviation(fit.model, fit.covariance, omega) - deviation).norm(), 1e-6 * deviation.norm());
    }
  }
}

TEST(MissingCoefficients, RefinedEstimatesAgreeAndTheirVarianceIsLess) {
  const ContinuousTransferFunction truth{monomial_basis(3, 2, kScale), Eigen::Vector3d(0.2, 1.0, 0.6),
                                         Eigen::Vector3d(0.3, 0.0, 0.5)};
  Record record = held_record(2000, 4, truth);
  record.y += 0.1 * problems::Gaussian(5).vector(2000);
  ContinuousFitOptions options = options_of(ContinuousMethod::refined_instrumental_variables);
  options.tolerance = 1e-6;
  const auto deviations = [&](const ContinuousFit& fit) {
    const BasisPolynomials map = polynomials(fit.model.basis, kScale);
    const Eigen::MatrixXd a = map.phi.topRows(3) / map.lead[3];
    const Eigen::MatrixXd b = map.psi.topRows(3) / map.lead[3];
    VectorXd result(6);
    result << (b * fit.covariance.bottomRightCorner(3, 3) * b.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt(),
        (a * fit.covariance.topLeftCorner(3, 3) * a.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
    return result;
  };
  const ContinuousFit full = fit_continuous(record, bases(2)[0], options);
  options.zero_numerator = {1};
  const ContinuousFit localising = fit_continuous(record, bases(2)[0], options);
  const ContinuousFit filter = fit_continuous(record, bases(2)[1], options);
  const VectorXd deviation = deviations(localising);
  const VectorXd error = coefficients_of(localising.model) - coefficients_of(truth);
  for (Index k = 0; k < 6; ++k) {
    if (k == 1) continue;
    // Outside 4.5 deviations lies 7e-6 of a normal distribution.
    EXPECT_LT(std::abs(error[k]), 4.5 * deviation[k]) << k;
    // By linearisation at estimates that differ by their deviations, 1 % of a coefficient here.
    EXPECT_LE(deviation[k], deviations(full)[k] * 1.02) << k;
    EXPECT_NEAR(deviations(filter)[k], deviation[k], 1e-3 * deviation[k]) << k;
  }
  EXPECT_LT(deviation[1], 1e-6 * deviations(full)[1]);
  // Both stand where the output error has no slope along the coefficients that are left.
  const VectorXd difference = coefficients_of(filter.model) - coefficients_of(localising.model);
  for (Index k = 0; k < 6; ++k) EXPECT_LT(std::abs(difference[k]), 1e-3 * std::max(deviation[k], 1e-9)) << k;
}

TEST(MissingCoefficients, RefusesWhatIsNotThere) {
  const Record record = held_record(200, 6, integrator_with_notch());
  const auto refusal = [&](const std::vector<Index>& numerator, const std::vector<Index>& denominator) {
    ContinuousFitOptions options = options_of(ContinuousMethod::least_squares);
    options.zero_numerator = numerator;
    options.zero_denominator = denominator;
    return BLOCKID_MESSAGE(fit_continuous(record, bases(2)[0], options));
  };
  EXPECT_THAT(refusal({3}, {}), HasSubstr("coefficient b3 cannot be left out, expected b0 to b2"));
  EXPECT_THAT(refusal({}, {3}), HasSubstr("coefficient a3 cannot be left out, expected a0 to a2"));
  EXPECT_THAT(refusal({-1}, {}), HasSubstr("cannot be left out"));
  EXPECT_THAT(refusal({}, {1, 1}), HasSubstr("a1 is left out twice"));
  EXPECT_THAT(refusal({0, 1, 2}, {}), HasSubstr("at least one coefficient of the numerator"));
}

}  // namespace
}  // namespace blockid
