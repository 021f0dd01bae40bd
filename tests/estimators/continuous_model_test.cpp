#include <blockid/estimators/continuous_model.hpp>

#include "data/message.hpp"
#include "support/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::Noise;
using Complex = std::complex<double>;

// Roots and their products lose a few digits of sixteen to the conditioning of these small examples.
constexpr double kRounding = 1e-10;

ContinuousTransferFunction random_model(const RationalBasis& basis, std::uint64_t seed) {
  Noise noise(seed);
  return {basis, 0.5 * noise.white(basis.order), noise.white(basis.numerator_degree + 1)};
}

std::vector<ContinuousTransferFunction> models() {
  std::vector<ContinuousTransferFunction> result;
  std::uint64_t seed = 1;
  const auto add = [&](const RationalBasis& basis) { result.push_back(random_model(basis, seed++)); };
  const Eigen::VectorXd p = break_points(0.1, 100.0, 5);
  for (Index m = 0; m <= 5; ++m) {
    add(localising_basis(p, m));
    add(monomial_basis(5, m, 3.0));
    add(chebyshev_basis(5, m, 10.0));
  }
  for (Index m = 4; m <= 5; ++m) add(laguerre_basis(5, m, 3.0));
  for (Index m = 3; m <= 4; ++m) add(kautz_basis(4, m, 3.0, 0.5));
  add(localising_basis(Eigen::VectorXd::Constant(1, 2.0), 0));
  add(laguerre_basis(1, 0, 2.0));
  return result;
}

Eigen::VectorXd grid() { return break_points(0.02, 500.0, 30); }

void expect_same(const Eigen::VectorXcd& left, const Eigen::VectorXcd& right) {
  ASSERT_EQ(left.size(), right.size());
  EXPECT_LT(((left - right).array() / right.array()).abs().maxCoeff(), kRounding);
}

class EveryModel : public ::testing::TestWithParam<ContinuousTransferFunction> {};

TEST_P(EveryModel, StateSpaceRespondsAlike) {
  const StateSpace system = state_space(GetParam());
  Eigen::VectorXcd g(grid().size());
  for (Index k = 0; k < g.size(); ++k) {
    const Eigen::MatrixXcd pencil =
        Complex(0.0, grid()[k]) * Eigen::MatrixXcd::Identity(system.a.rows(), system.a.rows()) -
        system.a.cast<Complex>();
    g[k] = (system.c.cast<Complex>() * pencil.partialPivLu().solve(system.b.cast<Complex>()))(0) + system.d;
  }
  // Where the response falls off as s^-n the state-space sum cancels: compare with the largest.
  const Eigen::VectorXcd expected = response_at(GetParam(), grid());
  EXPECT_LT((g - expected).cwiseAbs().maxCoeff(), kRounding * expected.cwiseAbs().maxCoeff());
}

TEST_P(EveryModel, PolynomialsRespondAlike) {
  const RationalPolynomials ratio = polynomials(GetParam());
  EXPECT_DOUBLE_EQ(ratio.denominator[GetParam().basis.order], 1.0);
  Eigen::VectorXcd g(grid().size());
  for (Index k = 0; k < g.size(); ++k) {
    const Complex z(0.0, grid()[k] / ratio.scale_rad_s);
    const auto at = [&](const Eigen::VectorXd& c) {
      Complex sum = 0.0;
      for (Index i = c.size() - 1; i >= 0; --i) sum = sum * z + c[i];
      return sum;
    };
    g[k] = at(ratio.numerator) / at(ratio.denominator);
  }
  expect_same(g, response_at(GetParam(), grid()));
}

TEST_P(EveryModel, ZeroPoleGainRespondsAlike) {
  const ZeroPoleGain form = zero_pole_gain(GetParam());
  Eigen::VectorXcd g = Eigen::VectorXcd::Constant(grid().size(), form.gain);
  for (Index k = 0; k < g.size(); ++k) {
    for (const Complex& zero : form.zeros) g[k] *= Complex(0.0, grid()[k]) - zero;
    for (const Complex& pole : form.poles) g[k] /= Complex(0.0, grid()[k]) - pole;
  }
  expect_same(g, response_at(GetParam(), grid()));
}

TEST_P(EveryModel, SectionsRespondAlike) {
  Eigen::VectorXcd g = Eigen::VectorXcd::Ones(grid().size());
  for (const SecondOrderSection& section : second_order_sections(GetParam())) {
    for (Index k = 0; k < g.size(); ++k) {
      const Complex z(0.0, grid()[k] / section.scale_rad_s);
      const auto at = [&](const Eigen::Vector3d& c) { return c[0] + z * (c[1] + z * c[2]); };
      g[k] *= at(section.numerator) / at(section.denominator);
    }
  }
  expect_same(g, response_at(GetParam(), grid()));
}

TEST_P(EveryModel, SensitivitiesOfPolesAreTheirDifferences) {
  ContinuousTransferFunction model = GetParam();
  const Eigen::MatrixXcd sensitivities = pole_sensitivities(model);
  constexpr double kStep = 1e-6;
  for (Index k = 0; k < model.basis.order; ++k) {
    ContinuousTransferFunction above = model;
    ContinuousTransferFunction below = model;
    above.denominator[k] += kStep;
    below.denominator[k] -= kStep;
    const Eigen::VectorXcd difference = (poles(above) - poles(below)) / (2.0 * kStep);
    // Central differences: rounding 1e-16 / 1e-6 of the poles and a third derivative times 1e-12.
    EXPECT_LT((difference - sensitivities.col(k)).cwiseAbs().maxCoeff(),
              1e-5 * (sensitivities.cwiseAbs().maxCoeff() + poles(model).cwiseAbs().maxCoeff()));
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryModel, ::testing::ValuesIn(models()), [](const auto& entry) {
  const RationalBasis& basis = entry.param.basis;
  return to_text(basis.kind) + std::to_string(basis.order) + "_" + std::to_string(basis.numerator_degree);
});

// 1 / (s + 1) and (s + 3) / ((s + 1)(s + 2)) from break points elsewhere.
TEST(ContinuousModel, KnownPolesAndZeros) {
  // (s + p + a p) / (s + p) = (s + 1) / (s + p) with p = 4: a = -3/4.
  const ContinuousTransferFunction first{localising_basis(Eigen::VectorXd::Constant(1, 4.0), 0),
                                         Eigen::VectorXd::Constant(1, -0.75), Eigen::VectorXd::Constant(1, 0.25)};
  EXPECT_NEAR(poles(first)[0].real(), -1.0, 1e-15);
  EXPECT_EQ(zeros(first).size(), 0);
  EXPECT_NEAR(zero_pole_gain(first).gain, 1.0, 1e-15);
  EXPECT_TRUE(is_stable(first));

  // With p = (1, 2) the denominator needs a = 0; b1 (s + 2) + b2 2 s = s + 3: b1 = 3/2, b2 = -1/4.
  const ContinuousTransferFunction second{localising_basis(Eigen::Vector2d(1.0, 2.0), 1), Eigen::Vector2d::Zero(),
                                          Eigen::Vector2d(1.5, -0.25)};
  EXPECT_NEAR(poles(second)[0].real(), -1.0, 1e-15);
  EXPECT_NEAR(poles(second)[1].real(), -2.0, 1e-15);
  EXPECT_NEAR(zeros(second)[0].real(), -3.0, 1e-14);
  const RationalPolynomials ratio = polynomials(second, 1.0);
  EXPECT_LT((ratio.denominator - Eigen::Vector3d(2.0, 3.0, 1.0)).norm(), 1e-14);
  EXPECT_LT((ratio.numerator - Eigen::Vector2d(3.0, 1.0)).norm(), 1e-14);
}

TEST(ContinuousModel, BreakPointsThemselvesArePolesOverThirtyDecades) {
  const Eigen::VectorXd p = break_points(1.0, 1e30, 60);
  const ContinuousTransferFunction model{localising_basis(p, 59), Eigen::VectorXd::Zero(60), Eigen::VectorXd::Ones(60)};
  EXPECT_LT(((poles(model).real() + p).array() / p.array()).abs().maxCoeff(), 1e-12);
  EXPECT_EQ(denominator_drift(model, p), 1.0);
}

TEST(ContinuousModel, TellsUnstableOnes) {
  const ContinuousTransferFunction model{localising_basis(Eigen::VectorXd::Constant(1, 1.0), 0),
                                         Eigen::VectorXd::Constant(1, -2.0), Eigen::VectorXd::Ones(1)};
  EXPECT_FALSE(is_stable(model));
  EXPECT_NEAR(poles(model)[0].real(), 1.0, 1e-15);
}

TEST(ContinuousModel, RefusesWhatItCannotDo) {
  const RationalBasis basis = localising_basis(Eigen::Vector2d(1.0, 2.0), 1);
  const Eigen::Vector2d one = Eigen::Vector2d::Ones();
  EXPECT_THAT(BLOCKID_MESSAGE(poles({basis, Eigen::VectorXd::Ones(1), one})), HasSubstr("expected 2 denominator"));
  EXPECT_THAT(BLOCKID_MESSAGE(poles({basis, one, Eigen::VectorXd::Ones(3)})), HasSubstr("expected 2 numerator"));
  EXPECT_THAT(BLOCKID_MESSAGE(poles({basis, one, std::nan("") * one})), HasSubstr("finite coefficients"));
  EXPECT_THAT(BLOCKID_MESSAGE(zeros({basis, one, Eigen::Vector2d(2.0, -1.0)})), HasSubstr("of s^1 vanishes"));
  EXPECT_EQ(zeros({basis, one, Eigen::Vector2d::Zero()}).size(), 0);
  EXPECT_THAT(BLOCKID_MESSAGE(polynomials({basis, one, one}, 0.0)), HasSubstr("positive frequency scale, got 0"));

  const Eigen::VectorXd p = break_points(1.0, 1e60, 120);
  const ContinuousTransferFunction wide{localising_basis(p, 119), Eigen::VectorXd::Zero(120),
                                        Eigen::VectorXd::Ones(120)};
  EXPECT_THAT(BLOCKID_MESSAGE(polynomials(wide)), HasSubstr("polynomial coefficients overflow"));
  const ContinuousTransferFunction low{localising_basis(p, 0), Eigen::VectorXd::Zero(120), Eigen::VectorXd::Ones(1)};
  EXPECT_TRUE(response_at(low, p).allFinite());
}

}  // namespace
}  // namespace blockid
