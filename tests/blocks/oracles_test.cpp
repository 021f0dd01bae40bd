// Linear blocks against their dense twin: impulse response by long division, output by O(N^2) convolution.
#include "blocks/random_chains.hpp"

#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>

#include <gmock/gmock.h>

namespace blockid::testing {
namespace {

constexpr Index kSamples = 700;
// Both ways add up at most 700 terms of order one.
constexpr double kRounding = 1e-11;

// First n coefficients of the power series b(q^-1) / a(q^-1); a_0 = 1.
Eigen::VectorXd long_division(const Eigen::VectorXd& b, const Eigen::VectorXd& a, Index n) {
  Eigen::VectorXd remainder = Eigen::VectorXd::Zero(n + a.size());
  remainder.head(std::min(n, b.size())) = b.head(std::min(n, b.size()));
  Eigen::VectorXd quotient(n);
  for (Index t = 0; t < n; ++t) {
    quotient[t] = remainder[t];
    remainder.segment(t, a.size()) -= quotient[t] * a;
  }
  return quotient;
}

// The first h.size() samples of h * u.
Eigen::VectorXd convolution(const Eigen::VectorXd& h, const Eigen::VectorXd& u) {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(h.size());
  for (Index t = 0; t < y.size(); ++t) {
    for (Index k = std::max<Index>(0, t - u.size() + 1); k <= t; ++k) y[t] += h[k] * u[t - k];
  }
  return y;
}

Eigen::VectorXd product(const Eigen::VectorXd& p, const Eigen::VectorXd& q) {
  Eigen::VectorXd longer = Eigen::VectorXd::Zero(p.size() + q.size() - 1);
  longer.head(p.size()) = p;
  return convolution(longer, q);
}

// y = b/a u + z/a: what a filter in transposed direct form II does from the state z.
Eigen::VectorXd dense(const Eigen::VectorXd& b, const Eigen::VectorXd& a, const Eigen::VectorXd& z,
                      const Eigen::VectorXd& u) {
  Eigen::VectorXd y = convolution(long_division(b, a, u.size()), u);
  if (z.size() > 0) y += long_division(z, a, u.size());
  return y;
}

double distance(const Eigen::VectorXd& expected, const Eigen::VectorXd& got) {
  return (expected - got).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

Eigen::VectorXd run(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& x0,
                    const Eigen::VectorXd& u) {
  return detail::apply_record(block, theta, x0, u).y;
}

TEST(ConvolutionTest, RationalOfEveryShape) {
  UniformNumbers numbers(1);
  for (const Index nb : {0, 1, 3, 5, 11}) {
    for (const Index na : {0, 1, 2, 4, 7, 12}) {
      for (const Index nk : {0, 1, 4}) {
        const Rational block(nb, na, nk);
        const Eigen::VectorXd theta = random_parameters(block, numbers);
        const Eigen::VectorXd x0 = numbers.vector(block.state_count());
        const Eigen::VectorXd u = numbers.vector(kSamples);
        Eigen::VectorXd b = Eigen::VectorXd::Zero(nb + nk + 1);
        b.tail(nb + 1) = theta.head(nb + 1);
        Eigen::VectorXd a = Eigen::VectorXd::Ones(na + 1);
        a.tail(na) = theta.tail(na);
        EXPECT_LE(distance(dense(b, a, x0, u), run(block, theta, x0, u)), kRounding)
            << "nb " << nb << ", na " << na << ", nk " << nk;
        EXPECT_EQ(block.numerator(detail::view(theta)), b);
        EXPECT_EQ(block.denominator(detail::view(theta)), a);
      }
    }
  }
}

TEST(ConvolutionTest, Fir) {
  UniformNumbers numbers(2);
  for (const Index nb : {0, 1, 6, 40}) {
    for (const Index nk : {0, 3}) {
      const Fir block(nb, nk);
      const Eigen::VectorXd theta = numbers.vector(nb + 1);
      const Eigen::VectorXd x0 = numbers.vector(nb + nk);
      const Eigen::VectorXd u = numbers.vector(kSamples);
      Eigen::VectorXd b = Eigen::VectorXd::Zero(nb + nk + 1);
      b.tail(nb + 1) = theta;
      EXPECT_LE(distance(dense(b, Eigen::VectorXd::Ones(1), x0, u), run(block, theta, x0, u)), kRounding)
          << "nb " << nb << ", nk " << nk;
    }
  }
}

TEST(ConvolutionTest, Delay) {
  UniformNumbers numbers(3);
  for (const Index samples : {0, 1, 5, 512, 600, 900}) {
    const Eigen::VectorXd x0 = numbers.vector(samples);
    const Eigen::VectorXd u = numbers.vector(kSamples);
    Eigen::VectorXd before_and_after(samples + kSamples);
    before_and_after << x0, u;
    EXPECT_EQ(run(Delay(samples), {}, x0, u), before_and_after.head(kSamples)) << samples;
  }
}

TEST(ConvolutionTest, BiquadsAreTheProductOfTheirSections) {
  UniformNumbers numbers(4);
  for (const bool stable : {false, true}) {
    for (const Index sections : {1, 2, 3, 5}) {
      const Biquads block(sections, stable);
      const Eigen::VectorXd theta = block.initial_parameters() + 0.2 * numbers.vector(1 + 4 * sections);
      const Eigen::VectorXd u = numbers.vector(kSamples);
      Eigen::VectorXd b = Eigen::VectorXd::Constant(1, theta[0]);
      Eigen::VectorXd a = Eigen::VectorXd::Ones(1);
      for (Index i = 0; i < sections; ++i) {
        const Eigen::Vector4d own = theta.segment<4>(1 + 4 * i);
        const double a2 = stable ? std::tanh(own[3]) : own[3];
        const double a1 = stable ? (1.0 + a2) * std::tanh(own[2]) : own[2];
        b = product(b, Eigen::Vector3d(1.0, own[0], own[1]));
        a = product(a, Eigen::Vector3d(1.0, a1, a2));
      }
      EXPECT_LE(distance(dense(b, a, {}, u), run(block, theta, Eigen::VectorXd::Zero(2 * sections), u)), kRounding)
          << sections << " sections, stable " << stable;
    }
  }
}

TEST(ConvolutionTest, RowsMultiplyAndSumsAdd) {
  UniformNumbers numbers(5);
  const Rational first(2, 3);
  const Rational second(1, 2, 2);
  const Gain gain;
  const Eigen::VectorXd p = random_parameters(first, numbers);
  const Eigen::VectorXd q = random_parameters(second, numbers);
  const Eigen::VectorXd u = numbers.vector(kSamples);
  const Eigen::VectorXd h1 =
      long_division(first.numerator(detail::view(p)), first.denominator(detail::view(p)), kSamples);
  const Eigen::VectorXd h2 =
      long_division(second.numerator(detail::view(q)), second.denominator(detail::view(q)), kSamples);

  const Series row({{"", first}, {"", gain}, {"", second}});
  Eigen::VectorXd theta(p.size() + 1 + q.size());
  theta << p, -1.7, q;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(row.state_count());
  EXPECT_LE(distance(-1.7 * convolution(convolution(h1, h2), u), run(row, theta, rest, u)), kRounding);

  const Parallel sum({{"", first}, {"", gain}, {"", second}});
  EXPECT_LE(distance(convolution(h1 + h2, u) - 1.7 * u, run(sum, theta, rest, u)), kRounding);
}

}  // namespace
}  // namespace blockid::testing
