// Expansions with fractional exponents against plain formulas, and the block made of them against its neighbours.
#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/taylor_expansion.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include "data/message.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <vector>

namespace blockid::testing {
namespace {

using blockid::detail::view;
using ::testing::HasSubstr;
using Complex = std::complex<double>;

// Sums of a few hundred terms of order one.
constexpr double kRounding = 1e-12;

Eigen::VectorXd simulated(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& u) {
  Model model = make_model(block, 1.0);
  model.parameters = theta;
  return simulate(model, u);
}

// Coefficients of (1 - r x)^e by the binomial series, term by term.
Eigen::VectorXd binomial_series(double r, double e, Index n) {
  Eigen::VectorXd c(n + 1);
  c[0] = 1.0;
  for (Index k = 1; k <= n; ++k) c[k] = c[k - 1] * -r * (e - static_cast<double>(k - 1)) / static_cast<double>(k);
  return c;
}

Eigen::VectorXd truncated_product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(a.size());
  for (Index i = 0; i < a.size(); ++i) c.tail(a.size() - i) += a[i] * b.head(a.size() - i);
  return c;
}

TEST(TaylorExpansionTest, IsTheProductOfBinomialSeries) {
  // (1 - 0.6 x)^1.3 / ((1 - 0.9 x)^0.4 (1 + 0.5 x)^-0.7)
  const Index n = 60;
  const Eigen::VectorXd s = 0.4 * root_powers(0.9, n) - 0.7 * root_powers(-0.5, n) - 1.3 * root_powers(0.6, n);
  Eigen::VectorXd expected = truncated_product(binomial_series(0.9, -0.4, n), binomial_series(-0.5, 0.7, n));
  expected = truncated_product(expected, binomial_series(0.6, 1.3, n));
  EXPECT_LT((taylor_coefficients(s) - expected).lpNorm<Eigen::Infinity>(), kRounding);
}

TEST(TaylorExpansionTest, PairIsBothItsMembers) {
  const Complex p(0.7, 0.4);
  const Eigen::VectorXd powers = root_powers(p, 20);
  for (Index k = 1; k <= 20; ++k) {
    const Complex both = std::pow(p, static_cast<int>(k)) + std::pow(std::conj(p), static_cast<int>(k));
    EXPECT_NEAR(powers[k - 1], both.real(), kRounding);
  }
}

TEST(TaylorExpansionTest, NewtonsIdentitiesAreTheInverse) {
  UniformNumbers numbers(1);
  for (const Index n : {0, 1, 2, 5, 30}) {
    const Eigen::VectorXd s = numbers.vector(n);
    EXPECT_LT((power_sums(taylor_coefficients(s)) - s).norm(), kRounding) << n;
    // A factor on all coefficients does not matter.
    EXPECT_LT((power_sums(-3.0 * taylor_coefficients(s)) - s).norm(), kRounding) << n;
  }
}

TEST(TaylorExpansionTest, TangentIsTheDifferenceQuotient) {
  UniformNumbers numbers(2);
  const Eigen::VectorXd s = numbers.vector(12);
  const Eigen::VectorXd ds = numbers.vector(12);
  const double step = 1e-6;  // error step^2 and rounding / step, both near 1e-10
  const Eigen::VectorXd quotient =
      (taylor_coefficients(s + step * ds) - taylor_coefficients(s - step * ds)) / (2.0 * step);
  EXPECT_LT((taylor_tangent(taylor_coefficients(s), ds) - quotient).norm(), 1e-8);
}

TEST(TaylorExpansionTest, Refusals) {
  EXPECT_THROW(power_sums(Eigen::VectorXd()), Error);
  EXPECT_THROW(power_sums(Eigen::Vector3d(0.0, 1.0, 2.0)), Error);
  EXPECT_THROW(taylor_tangent(Eigen::VectorXd::Ones(3), Eigen::VectorXd::Ones(3)), Error);
}

// Structures with every feature: pairs, zeros outside and near the circle, free coefficients, delays.
std::vector<FractionalFilter> filters() {
  return {FractionalFilter({}, 0),
          FractionalFilter({{0.8}, {}}, 1),
          FractionalFilter({{0.8, {0.6, 0.5}}, {{-0.3, 0.7}}}, 30),
          FractionalFilter({{{0.9, 0.2}}, {0.5, -0.4}}, 12, 5),
          FractionalFilter({{0.7}, {1.9, -1.3, {0.9, 0.8}}}, 25, 20, 2),
          FractionalFilter({{-0.5}, {1.0, {0.0, 1.0}}}, 9, 0, 1),
          FractionalFilter({{0.97, {0.9, 0.3}}, {0.4}}, 200)};
}

TEST(FractionalFilterTest, KeepsTheLaws) {
  for (const FractionalFilter& filter : filters()) EXPECT_THAT(filter, ConformsToBlockLaws());
}

TEST(FractionalFilterTest, LawsHoldForExpansionsLongerThanATile) {
  ConformanceOptions options;
  options.upstream_counts = {0, 3, 9};
  EXPECT_THAT(FractionalFilter({{0.9}, {0.3}}, 530, 530, 3), ConformsToBlockLaws(options));
}

// The rational filter with unit exponents for some roots, none of the others.
TEST(FractionalFilterTest, ExponentsOneAndZeroPlaceTheRoots) {
  const Index n = 150;  // 0.8^150 = 3e-15
  const FractionalFilter filter({{0.8, {0.5, 0.6}}, {-0.4, {0.9, 1.1}, 1.05}}, n);
  const Eigen::VectorXd u = uniform_input(400, 3);
  for (int corner = 0; corner < 32; ++corner) {
    Eigen::VectorXd theta(5);
    for (int i = 0; i < 5; ++i) theta[i] = corner >> i & 1;
    // Factors 1 - r x, or 1 - 2 Re r x + |r|^2 x^2.
    Eigen::VectorXd a = Eigen::VectorXd::Unit(4, 0);
    Eigen::VectorXd b = Eigen::VectorXd::Unit(5, 0);
    const auto times = [](const Eigen::VectorXd& p, double c1, double c2) {
      Eigen::VectorXd q = p;
      q.tail(p.size() - 1) += c1 * p.head(p.size() - 1);
      q.tail(p.size() - 2) += c2 * p.head(p.size() - 2);
      return q;
    };
    if (theta[0] == 1.0) a = times(a, -0.8, 0.0);
    if (theta[1] == 1.0) a = times(a, -1.0, 0.61);
    if (theta[2] == 1.0) b = times(b, 0.4, 0.0);
    if (theta[3] == 1.0) b = times(b, -1.8, 2.02);
    if (theta[4] == 1.0) b = times(b, -1.05, 0.0);
    Eigen::VectorXd rational(8);
    rational << b, a.tail(3);
    const Eigen::VectorXd expected = simulated(Rational(4, 3), rational, u);
    // Roots of magnitude 1/1.05 cancel exactly in the infinite expansion and to rounding in the finite one.
    EXPECT_LT((simulated(filter, theta, u) - expected).lpNorm<Eigen::Infinity>(), 1e-10) << corner;
  }
}

TEST(FractionalFilterTest, HalfAndHalfMakeOneForRootsInside) {
  const FractionalRoots roots = {{0.8, {0.5, 0.6}}, {-0.4, {0.3, 0.7}}};
  const FractionalFilter filter(roots, 150);
  const Eigen::Vector4d theta(0.3, 1.7, -0.6, 0.45);
  const Eigen::VectorXd w = filter.coefficients(view(theta));
  const Eigen::VectorXd h = filter.coefficients(view(Eigen::VectorXd(1.0 - theta.array())));
  const Eigen::VectorXd all = filter.coefficients(view(Eigen::VectorXd::Ones(4)));
  EXPECT_LT((truncated_product(w, h) - all).norm(), kRounding);
}

TEST(FractionalFilterTest, ZerosOnTheCircleAreDrawnIn) {
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  for (const double radius : {0.995, 1.0, 1.005}) {
    const Eigen::VectorXd c = FractionalFilter({{}, {-radius}}, 3).coefficients(view(one));
    EXPECT_LT((c - Eigen::Vector4d(1.0, kLargestZeroRadius, 0.0, 0.0)).norm(), kRounding) << radius;
  }
  const Eigen::VectorXd outside = FractionalFilter({{}, {-1.02}}, 3).coefficients(view(one));
  EXPECT_LT((outside - Eigen::Vector4d(1.0, 1.02, 0.0, 0.0)).norm(), kRounding);
}

TEST(FractionalFilterTest, ExpansionOfZerosOutsideDoesNotGrow) {
  const FractionalFilter filter({{}, {1.9, {0.9, 0.8}}}, 300);
  for (const double beta : {0.25, 0.5, 0.75}) {
    EXPECT_LT(filter.coefficients(view(Eigen::VectorXd::Constant(2, beta))).tail(100).norm(), 1e-6) << beta;
  }
}

TEST(FractionalFilterTest, FreeCoefficientsStartWhereTheExpansionGoesOn) {
  const FractionalRoots roots = {{{0.9, 0.2}}, {0.5, -1.4}};
  const FractionalFilter whole(roots, 12);
  const FractionalFilter part(roots, 12, 5);
  EXPECT_EQ(part.parameter_names(),
            (std::vector<std::string>{"alpha1", "beta1", "beta2", "d6", "d7", "d8", "d9", "d10", "d11", "d12"}));
  EXPECT_LT((whole.coefficients(view(whole.initial_parameters())) - part.coefficients(view(part.initial_parameters())))
                .norm(),
            kRounding);
}

TEST(FractionalFilterTest, TextComesBack) {
  const std::string text =
      "fractional(poles=[0.8,0,0.5,0.6],zeros=[1.9,0],n=40,n1=10,nk=2) | fractional(zeros=[0.5,0.25],n=3)";
  EXPECT_EQ(to_text(parse(text)), text);
  EXPECT_EQ(parse(text).parameter_count(), 3 + 30 + 1);
}

TEST(FractionalFilterTest, Refusals) {
  EXPECT_THAT(BLOCKID_MESSAGE(parse("fractional(poles=[0.5],n=3)")), HasSubstr("odd count"));
  EXPECT_THAT(BLOCKID_MESSAGE(parse("fractional(poles=[1,0],n=3)")), HasSubstr("inside the circle"));
  EXPECT_THAT(BLOCKID_MESSAGE(parse("fractional(poles=[0.5,-0.1],n=3)")), HasSubstr("positive imaginary part"));
  EXPECT_THAT(BLOCKID_MESSAGE(parse("fractional(poles=[0.5,0],n=3,n1=4)")), HasSubstr("n1"));
  EXPECT_THROW(FractionalFilter({}, 2, 3), Error);
  EXPECT_THROW(FractionalFilter({}, 2, 2, -1), Error);
  EXPECT_THROW(FractionalFilter({{}, {std::nan("")}}, 2), Error);
}

}  // namespace
}  // namespace blockid::testing
