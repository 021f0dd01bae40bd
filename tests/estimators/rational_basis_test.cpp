#include <blockid/estimators/rational_basis.hpp>

#include "data/message.hpp"

#include <blockid/estimators/frequency_fit.hpp>
#include <blockid/problems/welsh_goodwin.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using Complex = std::complex<double>;

// Some dozens of operations in double precision, relative to the largest term.
constexpr double kRounding = 1e-13;

std::vector<RationalBasis> bases() {
  const Eigen::VectorXd p = break_points(0.3, 40.0, 4);
  std::vector<RationalBasis> result;
  for (Index m = 0; m <= 4; ++m) {
    result.push_back(localising_basis(p, m));
    result.push_back(monomial_basis(4, m, 3.0));
    result.push_back(chebyshev_basis(4, m, 20.0));
  }
  for (Index m = 3; m <= 4; ++m) {
    result.push_back(laguerre_basis(4, m, 2.0));
    result.push_back(kautz_basis(4, m, 3.0, 0.4));
  }
  result.push_back(localising_basis(Eigen::VectorXd::Constant(1, 2.0), 0));
  result.push_back(localising_basis(Eigen::VectorXd::Constant(1, 2.0), 1));
  result.push_back(monomial_basis(1, 1, 2.0));
  result.push_back(chebyshev_basis(1, 0, 2.0));
  return result;
}

// Points of the right half plane, where no basis has a pole.
Eigen::VectorXcd points() {
  Eigen::VectorXcd s(5);
  s << Complex(0.0, 0.1), Complex(0.0, 3.0), Complex(0.2, -7.0), Complex(4.0, 30.0), Complex(11.0, 0.0);
  return s;
}

class EveryBasis : public ::testing::TestWithParam<RationalBasis> {};

TEST_P(EveryBasis, IsTheStatesOfItsFilterBank) {
  const RationalBasis& basis = GetParam();
  const BasisValues values = evaluate(basis, points());
  const FilterBank bank = filter_bank(basis);
  for (Index k = 0; k < points().size(); ++k) {
    const Eigen::MatrixXcd pencil =
        points()[k] * Eigen::MatrixXcd::Identity(basis.order, basis.order) - bank.a.cast<Complex>();
    const Eigen::VectorXcd states = pencil.partialPivLu().solve(bank.b.cast<Complex>());
    const Eigen::VectorXcd expected = values.phi.row(k).transpose() / values.lead[k];
    EXPECT_LT((states - expected).norm(), kRounding * expected.norm());
  }
}

TEST_P(EveryBasis, HasTheNumeratorsOfItsMap) {
  const RationalBasis& basis = GetParam();
  const BasisValues values = evaluate(basis, points());
  Eigen::MatrixXcd all(points().size(), basis.order + 1);
  all << values.phi, values.lead;
  const Eigen::MatrixXcd mapped = all * numerator_map(basis).cast<Complex>();
  ASSERT_EQ(values.psi.cols(), basis.numerator_degree + 1);
  EXPECT_LT((mapped - values.psi).norm(), kRounding * values.psi.norm());
}

TEST_P(EveryBasis, IsARatioOfItsPolynomials) {
  const RationalBasis& basis = GetParam();
  constexpr double kScale = 5.0;
  const BasisValues values = evaluate(basis, points());
  const BasisPolynomials parts = polynomials(basis, kScale);
  for (Index k = 0; k < points().size(); ++k) {
    Eigen::RowVectorXcd powers(basis.order + 1);
    for (Index i = 0; i <= basis.order; ++i) powers[i] = std::pow(points()[k] / kScale, static_cast<double>(i));
    const Complex lead = powers * parts.lead.cast<Complex>();
    const Eigen::RowVectorXcd phi = powers * parts.phi.cast<Complex>() / lead;
    const Eigen::RowVectorXcd psi = powers * parts.psi.cast<Complex>() / lead;
    EXPECT_LT((phi - values.phi.row(k) / values.lead[k]).norm(), kRounding * phi.norm());
    EXPECT_LT((psi - values.psi.row(k) / values.lead[k]).norm(), kRounding * psi.norm());
  }
  // No power above the degree of the numerator.
  const Index above = basis.order - basis.numerator_degree;
  EXPECT_TRUE(parts.psi.bottomRows(above).isZero(0.0));
}

TEST_P(EveryBasis, SpansAllNumeratorsOfItsDegree) {
  const Eigen::MatrixXd psi = polynomials(GetParam(), 5.0).psi;
  EXPECT_EQ(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(psi).rank(), GetParam().numerator_degree + 1);
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryBasis, ::testing::ValuesIn(bases()), [](const auto& entry) {
  return to_text(entry.param.kind) + std::to_string(entry.param.order) + "_" +
         std::to_string(entry.param.numerator_degree);
});

TEST(LocalisingBasis, IsTheProductOfTheArticleWithoutItsMisprint) {
  const Eigen::VectorXd p = break_points(0.1, 100.0, 5);
  const Eigen::VectorXd omega = break_points(0.01, 1e3, 11);
  const Eigen::MatrixXcd phi = evaluate(localising_basis(p, 4), omega).phi;
  for (Index i = 0; i < omega.size(); ++i) {
    const Complex s(0.0, omega[i]);
    Complex product = 1.0;
    for (Index k = 0; k < 5; ++k) {
      product *= s + p[k];
      const Complex literal = std::pow(s, static_cast<double>(k)) * p[k] / product;
      EXPECT_LT(std::abs(phi(i, k) - literal), kRounding * std::abs(literal));
    }
  }
}

TEST(LocalisingBasis, TelescopesToTheHighPass) {
  // phi_k = h_(k-1) - h_k with h_k = prod_{l<=k} s / (s + p_l).
  const Eigen::VectorXd p = break_points(0.1, 100.0, 6);
  const Eigen::VectorXcd s = points();
  const Eigen::VectorXcd rest = 1.0 - evaluate(localising_basis(p, 5), s).phi.rowwise().sum().array();
  for (Index i = 0; i < s.size(); ++i) {
    Complex high_pass = 1.0;
    for (const double pole : p) high_pass *= s[i] / (s[i] + pole);
    EXPECT_LT(std::abs(rest[i] - high_pass), kRounding);
  }
}

TEST(LocalisingBasis, StaysBoundedOverSixtyDecades) {
  const Eigen::MatrixXcd phi =
      evaluate(localising_basis(break_points(1.0, 1e60, 120), 119), break_points(0.1, 1e61, 300)).phi;
  ASSERT_TRUE(phi.allFinite());
  EXPECT_LE(phi.cwiseAbs().maxCoeff(), 1.0);
}

// Integrals over all frequencies become means over theta with omega = p tan(theta / 2): exact for these functions when
// there are more points than the degree.
Eigen::MatrixXcd inner_products(const RationalBasis& basis, double p) {
  constexpr Index kPoints = 400;
  Eigen::VectorXd omega(kPoints);
  Eigen::VectorXd weight(kPoints);
  for (Index k = 0; k < kPoints; ++k) {
    const double theta = std::numbers::pi * (2.0 * (static_cast<double>(k) + 0.5) / kPoints - 1.0);
    omega[k] = p * std::tan(0.5 * theta);
    weight[k] = 0.5 * p / std::pow(std::cos(0.5 * theta), 2) / kPoints;
  }
  const Eigen::MatrixXcd phi = evaluate(basis, omega).phi;
  return phi.adjoint() * weight.asDiagonal() * phi;
}

TEST(OrthonormalBases, AreOrthonormal) {
  const Eigen::MatrixXcd one = Eigen::MatrixXcd::Identity(6, 6);
  EXPECT_LT((inner_products(laguerre_basis(6, 5, 2.0), 2.0) - one).norm(), 1e-12);
  // The trapezoidal rule converges by |r|^400 with r the image of the poles, 0.6 here.
  EXPECT_LT((inner_products(kautz_basis(6, 5, 3.0, 0.5), 3.0) - one).norm(), 1e-12);
}

TEST(ChebyshevBasis, IsTheCosineOfTheMultipleAngle) {
  const Eigen::VectorXd omega = Eigen::VectorXd::LinSpaced(21, 0.0, 10.0);
  const Eigen::MatrixXcd phi = evaluate(chebyshev_basis(8, 7, 10.0), omega).phi;
  for (Index i = 0; i < omega.size(); ++i) {
    for (Index k = 0; k < 8; ++k) {
      const double cosine = std::cos(static_cast<double>(k) * std::acos(omega[i] / 10.0));
      const Complex expected = cosine * std::pow(Complex(0.0, 1.0), static_cast<double>(k));
      EXPECT_LT(std::abs(phi(i, k) - expected), kRounding);
    }
  }
}

// ---------------------------------------------------------------------------------------------- theorem 1

struct TheoremRow {
  double gamma;
  std::vector<double> conditions;  // n = 2, 4, 9, 18, 36, 72, 150, as printed in three digits at most
  double nine;
  double nine_stacked;
};

class Theorem1 : public ::testing::TestWithParam<TheoremRow> {};

double condition_of(double gamma, Index filters, bool real) {
  const problems::LocalisingDesign design = problems::welsh_goodwin_theorem1(gamma, filters);
  const Eigen::MatrixXcd phi =
      evaluate(localising_basis(design.break_points_rad_s, filters - 1), design.omega_rad_s).phi;
  return real ? squared_condition(stacked(phi)) : squared_condition(phi);
}

TEST_P(Theorem1, ConditionStaysBoundedAsDecadesGrow) {
  const std::vector<Index> filters = {2, 4, 9, 18, 36, 72, 150};
  double last = 0.0;
  for (std::size_t k = 0; k < filters.size(); ++k) {
    const double condition = condition_of(GetParam().gamma, filters[k], false);
    // Two digits are given: half of the last one is at most 5 % of the number.
    EXPECT_NEAR(condition, GetParam().conditions[k], 0.05 * condition) << filters[k] << " filters";
    EXPECT_GT(condition, last);
    last = condition;
  }
  // From 72 to 150 filters the band doubles, the condition hardly moves.
  EXPECT_LT(last, 1.03 * condition_of(GetParam().gamma, 72, false));
}

TEST_P(Theorem1, ReferenceDigitsOfNineFilters) {
  EXPECT_NEAR(condition_of(GetParam().gamma, 9, false), GetParam().nine, 1e-6 * GetParam().nine);
  EXPECT_NEAR(condition_of(GetParam().gamma, 9, true), GetParam().nine_stacked, 1e-6 * GetParam().nine_stacked);
}

INSTANTIATE_TEST_SUITE_P(
    Gammas, Theorem1,
    ::testing::Values(TheoremRow{3.38, {12.8, 124, 557, 880, 1010, 1050, 1060}, 557.20562, 6.9744688},
                      TheoremRow{4.0, {9.8, 67, 225, 321, 356, 366, 369}, 225.35407, 4.8458231},
                      TheoremRow{10.0, {3.8, 9.7, 15.8, 17.9, 18.6, 18.8, 18.9}, 15.760157, 1.7759545}));

// -------------------------------------------------------------------------------------------------- errors

TEST(BreakPoints, HaveEqualRatios) {
  const Eigen::VectorXd p = break_points(1e-4, 1e5, 10);
  for (Index k = 0; k < 10; ++k) EXPECT_NEAR(p[k] / std::pow(10.0, k - 4), 1.0, 1e-14);
  EXPECT_NEAR(break_points(1.0, 100.0, 1)[0], 10.0, 1e-14);
  EXPECT_TRUE(std::isfinite(geometric_mean(1e200, 1e200)));
}

TEST(BreakPoints, RefuseWhatIsNoBand) {
  EXPECT_THAT(BLOCKID_MESSAGE(break_points(0.0, 1.0, 3)), HasSubstr("expected 0 < low <= high, got 0 and 1 rad/s"));
  EXPECT_THAT(BLOCKID_MESSAGE(break_points(2.0, 1.0, 3)), HasSubstr("expected 0 < low <= high"));
  EXPECT_THAT(BLOCKID_MESSAGE(break_points(1.0, INFINITY, 3)), HasSubstr("expected 0 < low <= high"));
  EXPECT_THAT(BLOCKID_MESSAGE(break_points(1.0, 2.0, 0)), HasSubstr("expected at least one"));
}

TEST(RationalBasis, RefusesWhatItCannotBe) {
  const Eigen::Vector3d p(1.0, 2.0, 3.0);
  EXPECT_THAT(BLOCKID_MESSAGE(localising_basis(Eigen::VectorXd(), 0)), HasSubstr("order of at least 1"));
  EXPECT_THAT(BLOCKID_MESSAGE(localising_basis(p, 4)), HasSubstr("numerator of degree 0 .. 3"));
  EXPECT_THAT(BLOCKID_MESSAGE(localising_basis(Eigen::Vector2d(2.0, 1.0), 1)), HasSubstr("index 1 is 1 rad/s"));
  EXPECT_THAT(BLOCKID_MESSAGE(localising_basis(Eigen::Vector2d(0.0, 1.0), 1)), HasSubstr("index 0 is 0"));
  EXPECT_THAT(BLOCKID_MESSAGE(monomial_basis(2, 1, std::nan(""))), HasSubstr("expected finite and positive"));
  EXPECT_THAT(BLOCKID_MESSAGE(laguerre_basis(4, 2, 1.0)), HasSubstr("numerators of degree 3 or 4, got 2"));
  EXPECT_THAT(BLOCKID_MESSAGE(kautz_basis(3, 2, 1.0, 0.5)), HasSubstr("even order, got 3"));
  EXPECT_THAT(BLOCKID_MESSAGE(kautz_basis(4, 3, 1.0, 1.0)), HasSubstr("damping ratio below 1, got 1"));
  EXPECT_THAT(BLOCKID_MESSAGE(check(RationalBasis{BasisKind::laguerre, 2, 1, p})), HasSubstr("expected 1 points"));
  EXPECT_THAT(BLOCKID_MESSAGE(basis_kind("fourier")), HasSubstr("flbf, monomial, chebyshev, laguerre, kautz"));
  EXPECT_THAT(BLOCKID_MESSAGE(problems::welsh_goodwin_theorem1(1.0, 9)), HasSubstr("above 1, got 1"));
  EXPECT_EQ(basis_kind("kautz"), BasisKind::kautz);
}

}  // namespace
}  // namespace blockid
