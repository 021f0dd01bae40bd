// Continuous-time blocks: holds against Poisson's sum, exponentials against long double, banks against their formulas.
#include "blocks/custom_blocks.hpp"

#include <blockid/blocks/continuous_bank.hpp>
#include <blockid/blocks/continuous_rational.hpp>
#include <blockid/blocks/detail/hold.hpp>
#include <blockid/blocks/localising_basis.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <numbers>

namespace blockid::testing {
namespace {

using ::testing::HasSubstr;
using Complex = std::complex<double>;

std::string complaint(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing thrown";
}

struct HoldCase {
  Hold hold;
  Index degree;
};

std::vector<HoldCase> hold_cases() {
  return {{Hold::zero_order, 0}, {Hold::first_order, 1}, {Hold::cubic, 3},
          {Hold::quintic, 5},    {Hold::septic, 7},      {Hold::band_limited, 11}};
}

/// Three poles, two zeros, one resonance; sample time 0.1 s.
ContinuousRational third_order(Hold hold) { return {2, 3, {0.1, hold}, {0.5, 2.0, 8.0}}; }
Eigen::VectorXd third_order_parameters(const ContinuousRational& block) {
  return block.from_roots(6.0, {{-1.0, 0.0}, {4.0, 0.0}}, {{-0.3, 5.0}, {-0.3, -5.0}, {-2.0, 0.0}});
}

/// The centred B-spline's Fourier transform over its samples' is that of the interpolation's kernel.
double kernel_transform(Index degree, double wh, double w0h) {
  const double sinc = wh == 0.0 ? 1.0 : std::sin(wh / 2.0) / (wh / 2.0);
  if (degree == 1) return sinc * sinc;
  double samples = 0.0;
  // Poisson's sum of the same transform gives the samples of the spline: no table of its values is needed.
  for (int l = -2000; l <= 2000; ++l) {
    const double x = (w0h + 2.0 * std::numbers::pi * l) / 2.0;
    samples += std::pow(x == 0.0 ? 1.0 : std::sin(x) / x, static_cast<double>(degree + 1));
  }
  return std::pow(sinc, static_cast<double>(degree + 1)) / samples;
}

// The sampled filter's response is the sum over all aliases of kernel times G. Oracle: no exponential, no state.
TEST(HeldFilters, ResponseIsPoissonsSumOverTheAliases) {
  for (const auto& [hold, degree] : hold_cases()) {
    const ContinuousRational block = third_order(hold);
    const Eigen::VectorXd theta = third_order_parameters(block);
    const double h = 0.1;
    for (const double wh : {0.05, 0.4, 1.1, 2.5}) {
      Complex expected = 0.0;
      const int aliases = degree == 0 ? 20000 : 400;
      for (int l = -aliases; l <= aliases; ++l) {
        const double each = wh + 2.0 * std::numbers::pi * l;
        const Complex response = block.transfer_function(detail::view(theta), Complex(0.0, each / h));
        const Complex kernel = degree == 0 ? (1.0 - std::polar(1.0, -each)) / Complex(0.0, each)
                                           : Complex(kernel_transform(degree, each, wh));
        expected += kernel * response;
      }
      const Complex lag = std::polar(1.0, -wh * static_cast<double>(block.latency()));
      const Complex found = block.frequency_response(detail::view(theta), wh);
      // What is left of the sums: about (2 pi aliases)^-(degree + 1); and the prefilter, truncated at 1e-10.
      const double tolerance = degree == 0 ? 1e-5 : degree == 1 ? 1e-6 : 1e-8;
      EXPECT_NEAR(std::abs(found - lag * expected), 0.0, tolerance * std::abs(expected)) << to_text(hold) << ' ' << wh;
    }
  }
}

// What the table in hold.hpp says about accuracy, at 20 samples a period.
TEST(HeldFilters, HigherDegreesComeNearerToTheContinuousFilter) {
  const double wh = 2.0 * std::numbers::pi / 20.0;
  double before = 1.0;
  for (const auto& [hold, degree] : hold_cases()) {
    const ContinuousRational block = third_order(hold);
    const Eigen::VectorXd theta = third_order_parameters(block);
    const Complex exact = block.transfer_function(detail::view(theta), Complex(0.0, wh / 0.1)) *
                          std::polar(1.0, -wh * static_cast<double>(block.latency()));
    const double error = std::abs(block.frequency_response(detail::view(theta), wh) / exact - 1.0);
    EXPECT_LT(error, 0.2 * before) << to_text(hold);
    before = std::max(error, 1e-8);  // beyond that the truncation of the prefilter rules
  }
  const ContinuousRational first = third_order(Hold::first_order);
  const Eigen::VectorXd theta = third_order_parameters(first);
  const Complex exact = first.transfer_function(detail::view(theta), Complex(0.0, wh / 0.1));
  // sinc^2(wh/2) = 1 - (wh)^2/12 + O((wh)^4)
  EXPECT_NEAR(std::abs(first.frequency_response(detail::view(theta), wh) / exact), 1.0 - wh * wh / 12.0, 2e-4);
}

TEST(HeldFilters, ZeroOrderHoldStepResponseIsTheContinuousOne) {
  // 1/(s + 2): y(t) = (1 - e^{-2t})/2 at the samples, whatever the sample time.
  const ContinuousRational block(0, 1, {0.7, Hold::zero_order}, {5.0});
  const Eigen::VectorXd theta = block.from_roots(1.0, {}, {{-2.0, 0.0}});
  const std::vector<double> u(10, 1.0);
  std::vector<double> x(1, 0.0);
  std::vector<double> y(10);
  block.apply(detail::view(theta), std::span<double>(x), std::span<const double>(u), std::span<double>(y));
  for (std::size_t t = 0; t < y.size(); ++t) {
    EXPECT_NEAR(y[t], 0.5 * (1.0 - std::exp(-2.0 * 0.7 * static_cast<double>(t))), 1e-14);
  }
}

TEST(MatrixExponential, AgreesWithTheSeriesInLongDouble) {
  UniformNumbers numbers(3);
  for (const double scale : {1e-3, 1.0, 30.0}) {
    const Eigen::MatrixXd m =
        LocalisingBasis(logarithmic_break_points(1e-3 * scale, scale, 8)).matrix<double>(0.2 * numbers.vector(8));
    const Eigen::MatrixXd expected =
        blockid::detail::exponential_by_series<long double>(m.cast<long double>().eval()).cast<double>();
    // Rounding 1e-16 times the squarings (up to 8) and the order.
    EXPECT_LT((blockid::detail::matrix_exponential(m) - expected).cwiseAbs().maxCoeff(), 2e-14 * expected.norm())
        << scale;
    EXPECT_LT((blockid::detail::exponential_by_series<double>(m) - expected).cwiseAbs().maxCoeff(),
              2e-14 * expected.norm());
  }
}

TEST(MatrixExponential, OfNumbersThatAreNotFiniteIsNotFinite) {
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(2, 2);
  m(0, 1) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(blockid::detail::matrix_exponential(m).allFinite());
}

// The three properties that define the not-a-knot spline: it interpolates, it has no knot next to its ends, and so it
// reproduces polynomials up to its degree everywhere.
TEST(InterpolationCoefficients, DefineTheNotAKnotSpline) {
  for (const HoldCase& each : hold_cases()) {
    const Hold hold = each.hold;
    const Index degree = each.degree;
    if (degree < 2) continue;
    const blockid::detail::HoldPieces& pieces = blockid::detail::hold_pieces(hold);
    const Index count = 60;
    const Eigen::VectorXd noise = uniform_input(count, 5);
    const Eigen::VectorXd c = blockid::detail::interpolation_coefficients(noise, hold);
    ASSERT_EQ(c.size(), count + 2 * pieces.reach);
    for (Index t = 0; t + 1 < count; ++t) {
      // weights.row(0): value at t from c_{t+1+reach} downwards; c_{t+1+reach-j} is entry t + 1 + 2 reach - j.
      double value = 0.0;
      for (Index j = 0; j < pieces.taps(); ++j) value += pieces.weights(0, j) * c[t + 1 + 2 * pieces.reach - j];
      EXPECT_NEAR(value, noise[t], 1e-9 * c.cwiseAbs().maxCoeff()) << to_text(hold) << ' ' << t;
    }
    const auto power = [&](double t) { return std::pow(t / 30.0 - 1.0, static_cast<double>(degree)); };
    const Eigen::VectorXd samples =
        Eigen::VectorXd::NullaryExpr(count, [&](Index t) { return power(static_cast<double>(t)); });
    const Eigen::VectorXd p = blockid::detail::interpolation_coefficients(samples, hold);
    for (const Index t : {Index{0}, Index{1}, Index{29}, count - 2}) {
      double value = 0.0;
      double factor = 1.0;
      for (Index m = 0; m <= degree; ++m) {
        double derivative = 0.0;
        for (Index j = 0; j < pieces.taps(); ++j) derivative += pieces.weights(m, j) * p[t + 1 + 2 * pieces.reach - j];
        value += factor * derivative;
        factor *= 0.5 / static_cast<double>(m + 1);
      }
      // Rounding 1e-16 through end conditions of order degree + 1: differences with binomials up to 924.
      EXPECT_NEAR(value, power(static_cast<double>(t) + 0.5), 1e-9) << to_text(hold) << ' ' << t;
    }
  }
}

TEST(LocalisingBasisTest, KeepsRootsOverNineDecades) {
  const LocalisingBasis basis(logarithmic_break_points(1e-4, 1e5, 18));
  std::vector<Complex> poles;
  for (int k = 0; k < 9; ++k) {
    const double w = std::pow(10.0, -3.7 + 8.4 / 8.0 * k);
    poles.push_back(std::polar(w, std::acos(-0.01)));
    poles.push_back(std::conj(poles.back()));
  }
  const Eigen::VectorXd a = basis.denominator_from_poles(poles);
  const Eigen::VectorXcd found = basis.poles(a);
  for (const Complex& pole : poles) {
    const double nearest = (found.array() - pole).abs().minCoeff();
    EXPECT_LT(nearest, 1e-12 * std::abs(pole)) << pole;
  }
}

TEST(LocalisingBasisTest, LowDegreesLieInTheSpan) {
  const LocalisingBasis basis({0.5, 2.0, 2.0, 40.0});
  const Eigen::MatrixXd low = basis.low_degree(2);
  for (const double w : {0.01, 1.0, 300.0}) {
    const Complex s(0.0, w);
    const Complex tail = 2.0 / (s + 2.0) * 40.0 / (s + 40.0);
    const Eigen::VectorXcd f = basis.at(s);
    for (Index k = 0; k < 2; ++k) {
      const Complex found = (low.col(k).cast<Complex>().transpose() * f).value();
      EXPECT_LT(std::abs(found - f[k] * tail), 1e-14) << w;
    }
  }
}

TEST(ContinuousRationalTest, FromRootsGivesTheProductOfTheRoots) {
  const std::vector<Complex> poles = {{-0.2, 3.0}, {-0.2, -3.0}, {-40.0, 0.0}, {-400.0, 0.0}};
  const std::vector<Complex> zeros = {{-1.0, 1.0}, {-1.0, -1.0}, {25.0, 0.0}, {-7.0, 0.0}};
  for (Index count = 0; count <= 4; ++count) {
    if (count == 1) continue;  // half a pair
    for (Index nb = count; nb <= 4; ++nb) {
      const ContinuousRational block(nb, 4, {1e-3, Hold::first_order}, {1.0, 5.0, 30.0, 500.0});
      const std::vector<Complex> some(zeros.begin(), zeros.begin() + count);
      const Eigen::VectorXd theta = block.from_roots(3.0, some, poles);
      EXPECT_EQ(block.parameter_count(), nb + 5);
      for (const double w : {0.0, 0.7, 11.0, 900.0}) {
        const Complex s(0.0, w);
        Complex expected = 3.0;
        for (const Complex& zero : some) expected *= s - zero;
        for (const Complex& pole : poles) expected /= s - pole;
        const Complex found = block.transfer_function(detail::view(theta), s);
        // Relative to the largest of the sum: a small G is a difference of numbers b_k F_k.
        EXPECT_LT(std::abs(found - expected), 1e-12 * (std::abs(expected) + theta.head(nb + 1).cwiseAbs().maxCoeff()))
            << count << " zeros, nb = " << nb << ", w = " << w;
      }
    }
  }
}

TEST(ContinuousRationalTest, AnotherBasisOrSampleTimeIsTheSameSystem) {
  const std::vector<Complex> poles = {{-0.5, 2.0}, {-0.5, -2.0}};
  const ContinuousRational one(1, 2, {0.2, Hold::zero_order}, {1.0, 3.0});
  const ContinuousRational other(1, 2, {0.1, Hold::zero_order}, {0.2, 20.0});
  const Eigen::VectorXd theta_one = one.from_roots(2.0, {{-3.0, 0.0}}, poles);
  const Eigen::VectorXd theta_other = other.from_roots(2.0, {{-3.0, 0.0}}, poles);
  const Eigen::VectorXd u = uniform_input(40, 2);
  Eigen::VectorXd slow(40);
  Eigen::VectorXd twice(80);
  for (Index t = 0; t < 80; ++t) twice[t] = u[t / 2];
  Eigen::VectorXd fast(80);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(2);
  one.apply(detail::view(theta_one), detail::view(x), detail::view(std::as_const(u)), detail::view(slow));
  x.setZero();
  other.apply(detail::view(theta_other), detail::view(x), detail::view(std::as_const(twice)), detail::view(fast));
  for (Index t = 0; t < 40; ++t) EXPECT_NEAR(fast[2 * t], slow[t], 1e-12) << t;
}

TEST(ContinuousBankTest, FunctionsAreTheirFormulas) {
  const Sampling sampling{0.01, Hold::first_order};
  const ContinuousBank svf = ContinuousBank::svf(4, 3.0, sampling);
  const ContinuousBank laguerre = ContinuousBank::laguerre(4, 3.0, sampling);
  const ContinuousBank kautz = ContinuousBank::kautz(2, 5.0, 0.2, sampling);
  const ContinuousBank flbf = ContinuousBank::flbf({1.0, 4.0, 20.0}, sampling);
  const double b = 2.0;
  const double c = 25.0;
  for (const double w : {0.1, 2.0, 5.0, 60.0}) {
    const Complex s(0.0, w);
    for (Index k = 0; k < 4; ++k) {
      const double order = static_cast<double>(k);
      EXPECT_LT(std::abs(svf.at(s)[k] - std::pow(s, order) * std::pow(3.0, 4.0 - order) / std::pow(s + 3.0, 4.0)),
                1e-13);
      EXPECT_LT(std::abs(laguerre.at(s)[k] - std::sqrt(6.0) / (s + 3.0) * std::pow((s - 3.0) / (s + 3.0), order)),
                1e-13);
    }
    const Complex d = s * s + b * s + c;
    for (Index i = 0; i < 2; ++i) {
      const Complex pass = i == 0 ? 1.0 : (s * s - b * s + c) / d;
      EXPECT_LT(std::abs(kautz.at(s)[2 * i] - std::sqrt(2.0 * b) * s / d * pass), 1e-13);
      EXPECT_LT(std::abs(kautz.at(s)[2 * i + 1] - std::sqrt(2.0 * b * c) / d * pass), 1e-13);
    }
    EXPECT_LT((flbf.at(s) - LocalisingBasis({1.0, 4.0, 20.0}).at(s)).norm(), 1e-13);
  }
}

// Orthonormal: the controllability Gramian is the identity, A + A' + B B' = 0.
TEST(ContinuousBankTest, LaguerreAndKautzAreOrthonormal) {
  for (const ContinuousBank& bank : {ContinuousBank::laguerre(6, 7.0, {0.01, Hold::zero_order}),
                                     ContinuousBank::kautz(3, 7.0, 0.1, {0.01, Hold::zero_order})}) {
    const Eigen::MatrixXd residual =
        bank.state_matrix() + bank.state_matrix().transpose() + bank.input_vector() * bank.input_vector().transpose();
    EXPECT_LT(residual.cwiseAbs().maxCoeff(), 1e-13) << bank.kind();
  }
}

// Regressors come from the own columns: column k is F_k u.
TEST(ContinuousBankTest, OwnColumnsAreTheSignals) {
  const ContinuousBank bank = ContinuousBank::flbf({1.0, 4.0, 20.0}, {0.05, Hold::first_order});
  const Eigen::VectorXd u = uniform_input(300, 4);
  const Eigen::VectorXd theta = Eigen::Vector3d(0.3, -2.0, 1.0);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(3);
  Eigen::VectorXd y(300);
  std::vector<double> memory(static_cast<std::size_t>(bank.tangent_memory(0, OwnColumns::parameters)));
  std::vector<double> tile(300 * 8);
  bank.push_forward(detail::view(theta), detail::view(x), memory, detail::view(u), detail::view(y),
                    {tile.data(), 300, 8, 0}, OwnColumns::parameters);
  for (Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd one = Eigen::VectorXd::Unit(3, k);
    x.setZero();
    bank.apply(detail::view(one), detail::view(x), detail::view(u), detail::view(y));
    for (Index t = 0; t < 300; ++t) EXPECT_NEAR(tile[static_cast<std::size_t>(8 * t + k)], y[t], 1e-14);
  }
}

struct Orders {
  Index nb;
  Index na;
};

class ContinuousRationalLaws : public ::testing::TestWithParam<Orders> {};

TEST_P(ContinuousRationalLaws, Hold) {
  for (const auto& [hold, degree] : hold_cases()) {
    // A slow pole's transition 1 - p h is rounded, which adds up over the samples. Against the tangents, differences of
    // order 9 are off by 1.3e-5, 1.3e-6, 9e-8 and 1e-8 of the column with steps of 2e-8, 2e-7, 2e-6 and 2e-5: like 1 /
    // step, so that it is rounding. The tangents themselves agree with Jets to 1e-10.
    ConformanceOptions options;
    options.difference_step = 2e-6;
    if (degree > 1) options.upstream_counts = {0, 3, 11};
    EXPECT_THAT(ContinuousRational(GetParam().nb, GetParam().na, {0.1, hold}), ConformsToBlockLaws(options))
        << to_text(hold);
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, ContinuousRationalLaws,
                         ::testing::Values(Orders{0, 1}, Orders{0, 3}, Orders{3, 3}, Orders{2, 5}, Orders{7, 8},
                                           Orders{8, 9}),
                         [](const auto& test) {
                           return "nb" + std::to_string(test.param.nb) + "na" + std::to_string(test.param.na);
                         });

TEST(ContinuousRationalPoints, LawsHoldForAnUnstableFilter) {
  const ContinuousRational block(1, 2, {0.01, Hold::first_order}, {1.0, 3.0});
  ConformanceOptions options;
  options.parameters = block.from_roots(2.0, {{-1.0, 0.0}}, {{0.1, 2.0}, {0.1, -2.0}});
  const ConformanceReport report = check_block(block, options);
  EXPECT_TRUE(report.ok()) << report.text();
  EXPECT_THAT(report.skipped, ::testing::Contains(HasSubstr("does not die away")));
}

TEST(ContinuousBankLaws, Hold) {
  for (const auto& [hold, degree] : hold_cases()) {
    ConformanceOptions options;
    if (degree > 1) options.upstream_counts = {0, 3};
    EXPECT_THAT(ContinuousBank::svf(3, 2.0, {0.1, hold}), ConformsToBlockLaws(options));
    EXPECT_THAT(ContinuousBank::laguerre(4, 2.0, {0.1, hold}), ConformsToBlockLaws(options));
    EXPECT_THAT(ContinuousBank::kautz(2, 2.0, 0.3, {0.1, hold}), ConformsToBlockLaws(options));
    EXPECT_THAT(ContinuousBank::flbf({0.5, 3.0, 9.0}, {0.1, hold}), ConformsToBlockLaws(options));
  }
}

TEST(ContinuousChains, KeepTheLawsAroundAStaticBlock) {
  EXPECT_THAT(parse("G1=continuous_rational(nb=1,na=2,sample_time=0.1) | f=polynomial(degree=3,range=[-1,1]) | "
                    "G2=continuous_rational(nb=0,na=2,sample_time=0.1,hold=spline3)"),
              ConformsToBlockLaws());
}

TEST(ContinuousText, RoundTripKeepsTheText) {
  for (const std::string text :
       {"continuous_rational(nb=1,na=2,sample_time=0.1,hold=foh,break_points=[0.5,3])",
        "G=continuous_rational(nb=2,na=2,sample_time=1e-05,hold=band_limited,break_points=[10,1000])",
        "flbf(break_points=[1,2.5,40],sample_time=0.01,hold=zoh)", "svf(order=3,pole=2,sample_time=0.1,hold=spline3)",
        "laguerre(order=4,pole=2.5,sample_time=0.1,hold=spline5)",
        "kautz(pairs=2,frequency=5,damping=0.1,sample_time=0.1,hold=spline7)"}) {
    EXPECT_EQ(to_text(parse(text)), text);
  }
}

TEST(ContinuousText, DefaultsAreWrittenOut) {
  EXPECT_THAT(to_text(parse("continuous_rational(nb=0,na=1,sample_time=0.1)")),
              HasSubstr("hold=foh,break_points=[0.8833"));
}

TEST(ContinuousErrors, SayWhatWasExpected) {
  const Sampling sampling{0.1, Hold::zero_order};
  EXPECT_THAT(complaint([&] { ContinuousRational(3, 2, sampling); }), HasSubstr("from 0 to na=2, got nb=3"));
  EXPECT_THAT(complaint([&] { ContinuousRational(0, 0, sampling); }), HasSubstr("at least 1, got 0"));
  EXPECT_THAT(complaint([&] { ContinuousRational(0, 2, sampling, {1.0}); }), HasSubstr("na=2 break points, got 1"));
  EXPECT_THAT(complaint([&] { ContinuousRational(0, 2, sampling, {1.0, -3.0}); }), HasSubstr("rad/s, got -3"));
  EXPECT_EQ(complaint([&] {
              ContinuousRational(0, 1, {0.0, Hold::zero_order});
            }),
            "continuous_rational: expected a positive sample time in seconds, got 0");
  const ContinuousRational block(1, 2, sampling);
  EXPECT_THAT(complaint([&] { block.from_roots(1.0, {}, {{-1.0, 0.0}}); }), HasSubstr("2 poles"));
  EXPECT_THAT(complaint([&] { block.from_roots(1.0, {}, {{-1.0, 2.0}, {-3.0, 0.0}}); }), HasSubstr("conjugation"));
  EXPECT_THAT(complaint([&] { block.from_roots(1.0, {1.0, 2.0}, {-1.0, -3.0}); }), HasSubstr("nb=1 zeros, got 2"));
  EXPECT_THAT(complaint([&] { ContinuousBank::svf(0, 1.0, sampling); }), HasSubstr("svf: order"));
  EXPECT_THAT(complaint([&] { ContinuousBank::laguerre(2, -1.0, sampling); }),
              HasSubstr("positive pole in rad/s, got -1"));
  EXPECT_THAT(complaint([&] { ContinuousBank::kautz(1, 1.0, 0.0, sampling); }), HasSubstr("positive damping, got 0"));
  EXPECT_THAT(complaint([&] { ContinuousBank::flbf({}, sampling); }), HasSubstr("at least one"));
  EXPECT_THAT(complaint([] { parse("flbf(break_points=[1,2])"); }), HasSubstr("sample_time"));
  EXPECT_THAT(complaint([] { parse("svf(order=2,pole=1,sample_time=1,hold=linear)"); }), HasSubstr("spline7"));
  EXPECT_THAT(complaint([] { parse("flbf(break_points=[],sample_time=1)"); }), HasSubstr("1 to 60"));
  EXPECT_THAT(complaint([] { logarithmic_break_points(2.0, 1.0, 3); }), HasSubstr("lower <= upper"));
  EXPECT_THAT(complaint([] { logarithmic_break_points(1.0, 2.0, 0); }), HasSubstr("at least one"));
  EXPECT_THAT(complaint([] { blockid::detail::interpolation_coefficients(Eigen::VectorXd::Zero(7), Hold::cubic); }),
              HasSubstr("at least 8 samples"));
}

}  // namespace
}  // namespace blockid::testing
