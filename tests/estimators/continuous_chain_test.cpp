// Continuous-time models as chains: the same response, the same simulation.
#include <blockid/estimators/continuous_chain.hpp>

#include "data/message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstddef>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using Complex = std::complex<double>;

constexpr double kSampleTime = 1e-3;

ContinuousTransferFunction localising(Index degree) {
  const Eigen::VectorXd p = Eigen::Vector4d(3.0, 20.0, 70.0, 300.0);
  ContinuousTransferFunction g{localising_basis(p, degree), Eigen::Vector4d(0.3, -0.4, 0.2, 0.5), {}};
  g.numerator = Eigen::VectorXd::LinSpaced(degree + 1, 1.0, -0.6);
  return g;
}

/// Largest difference of the responses relative to the largest.
double distance(const Model& model, const ContinuousTransferFunction& g) {
  const ChildParameters child = top_level_blocks(model).front();
  const auto* const block = child.block.target<ContinuousRational>();
  const Eigen::VectorXd omega = break_points(0.3, 3000.0, 60);
  const Eigen::VectorXcd expected = response_at(g, omega);
  double worst = 0.0;
  for (Index k = 0; k < omega.size(); ++k) {
    const Complex found = block->transfer_function(
        {child.parameters.data(), static_cast<std::size_t>(child.parameters.size())}, Complex(0.0, omega[k]));
    worst = std::max(worst, std::abs(found - expected[k]));
  }
  return worst / expected.cwiseAbs().maxCoeff();
}

TEST(ContinuousChain, KeepsTheResponseOfLocalisingFunctionsOfEveryDegree) {
  for (Index degree = 0; degree <= 4; ++degree) {
    const Model model = as_model(localising(degree), {kSampleTime, Hold::zero_order});
    EXPECT_EQ(model.sample_time_s, kSampleTime);
    EXPECT_EQ(parameter_index(model, "G.a1"), degree + 1);
    // A dozen operations on numbers of order one.
    EXPECT_LT(distance(model, localising(degree)), 1e-13) << "degree " << degree;
  }
}

TEST(ContinuousChain, KeepsTheResponseOfOtherBases) {
  const ContinuousTransferFunction laguerre{laguerre_basis(3, 2, 40.0), Eigen::Vector3d(0.2, 0.3, -0.1),
                                            Eigen::Vector3d(1.0, -0.5, 0.25)};
  const ContinuousTransferFunction proper{laguerre_basis(3, 3, 40.0), Eigen::Vector3d(0.2, 0.3, -0.1),
                                          Eigen::Vector4d(1.0, -0.5, 0.25, 0.1)};
  const ContinuousTransferFunction powers{monomial_basis(3, 1, 30.0), Eigen::Vector3d(1.0, 2.2, 1.9),
                                          Eigen::Vector2d(2.0, 0.3)};
  for (const ContinuousTransferFunction& g : {laguerre, proper, powers}) {
    // Roots found and multiplied again lose a few digits.
    EXPECT_LT(distance(as_model(g, {kSampleTime, Hold::first_order}), g), 1e-11) << to_text(g.basis.kind);
  }
}

TEST(ContinuousChain, AnIntegratorHasAPoleAtZero) {
  // 1 / (s (s + 1)): the break points stay positive.
  const ContinuousTransferFunction g{monomial_basis(2, 0), Eigen::Vector2d(0.0, 1.0), Eigen::VectorXd::Ones(1)};
  const Model model = as_model(g, {0.1, Hold::zero_order});
  const Eigen::VectorXd y = simulate(model, Eigen::VectorXd::Ones(101));
  // Step response t - 1 + e^-t; ten roundings of numbers up to 10.
  EXPECT_NEAR(y[100], 9.0 + std::exp(-10.0), 1e-11);
}

TEST(ContinuousChain, DeviationsGoOver) {
  const ContinuousTransferFunction g = localising(4);
  const Eigen::MatrixXd covariance = 0.01 * Eigen::MatrixXd::Identity(9, 9);
  const Model model = as_model(g, {kSampleTime, Hold::zero_order}, covariance);
  ASSERT_EQ(model.standard_deviations.size(), 9);
  EXPECT_NEAR(model.standard_deviations[parameter_index(model, "G.a2")], 0.1, 1e-15);
  // b_0 is the coefficient of s / (s + p_4), b_1 .. b_4 have one of their own and a share of that.
  EXPECT_NEAR(model.standard_deviations[parameter_index(model, "G.b0")], 0.1, 1e-15);
  EXPECT_GT(model.standard_deviations[parameter_index(model, "G.b4")], 0.1);
}

TEST(ContinuousChain, RefusesWhatItCannotSample) {
  EXPECT_THAT(BLOCKID_MESSAGE(as_model(localising(3), {0.0, Hold::zero_order})), HasSubstr("positive sample time"));
  EXPECT_THAT(BLOCKID_MESSAGE(as_model(localising(3), {1.0, Hold::zero_order}, Eigen::MatrixXd::Identity(3, 3))),
              HasSubstr("expected a covariance of 8 x 8, got 3 x 3"));
}

}  // namespace
}  // namespace blockid
