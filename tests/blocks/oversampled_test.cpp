// Oversampled blocks: the laws, a brute-force twin, and the circuit that the samples alone cannot follow.
#include "blocks/custom_blocks.hpp"
#include "blocks/random_chains.hpp"

#include <blockid/blocks/dead_zone.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/memoryless.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/saturation.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/tanh_network.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

namespace blockid::testing {
namespace {

using ::testing::HasSubstr;

Series wiener_hammerstein() {
  return Series({{"G1", Rational(1, 2)}, {"f", Polynomial(3, {-3, 3})}, {"G2", Rational(2, 1)}});
}

ConformanceOptions at_random_parameters(const AnyBlock& inner, std::uint64_t seed) {
  UniformNumbers numbers(seed);
  ConformanceOptions options;
  options.parameters = random_parameters(inner, numbers);
  // Every state is a column, and there are many.
  options.upstream_counts = {0, 3, 9};
  return options;
}

void expect_laws(const AnyBlock& inner, Index factor, Index half_length) {
  EXPECT_THAT(Oversampled(inner, factor, half_length), ConformsToBlockLaws(at_random_parameters(inner, 3)))
      << inner.kind() << ", factor " << factor << ", half_length " << half_length;
}

TEST(OversampledLaws, StaticBlocks) {
  expect_laws(Spline(6, SignalRange{-1.2, 1.1}), 4, 4);
  expect_laws(Spline(6), 2, 3);
  expect_laws(Polynomial(3, {-2, 2}), 3, 5);
  expect_laws(TanhNetwork(2), 9, 2);
  expect_laws(Saturation{}, 5, 3);
  expect_laws(CustomTanh{}, 17, 2);
  expect_laws(Memoryless([](auto, auto u) { return u * u; }, 0), 4, 8);
}

TEST(OversampledLaws, MoreHistoryThanOneChunk) { expect_laws(Polynomial(2, {-2, 2}), 2, 40); }

TEST(OversampledLaws, LinearBlocks) {
  expect_laws(Gain{}, 4, 4);
  expect_laws(Rational(2, 2), 3, 4);
}

TEST(OversampledLaws, Chains) {
  expect_laws(wiener_hammerstein(), 4, 4);
  expect_laws(CustomLag{}, 2, 5);
  expect_laws(Series({{"", Gain{}}, {"", Polynomial(2, {-2, 2})}}), 3, 3);
}

TEST(OversampledLaws, WithinAChain) {
  const Series row({{"G1", Rational(1, 2)}, {"f", Oversampled(Polynomial(3, {-3, 3}), 4, 4)}, {"G2", Rational(2, 1)}});
  UniformNumbers numbers(4);
  ConformanceOptions options;
  options.parameters = random_parameters(row, numbers);
  options.upstream_counts = {0, 5};
  EXPECT_THAT(row, ConformsToBlockLaws(options));
}

// ---------------------------------------------------------------------------------------------------------------
// The twin: zeros between the samples, one long convolution up, the block, one long convolution down.

Eigen::VectorXd convolved(const Eigen::VectorXd& u, const blockid::detail::Resampler& filter) {
  const Index reach = filter.factor() * filter.half_length();
  Eigen::VectorXd y = Eigen::VectorXd::Zero(u.size());
  for (Index t = 0; t < u.size(); ++t) {
    for (Index s = std::max<Index>(0, t - reach); s < std::min(u.size(), t + reach + 1); ++s) {
      y[t] += filter.tap(t - s) * u[s];
    }
  }
  return y;
}

// y aligned with u, which is zero for `margin` samples at either end: nothing beyond matters.
Eigen::VectorXd twin(const AnyBlock& inner, const Eigen::VectorXd& theta, Index factor, Index half_length,
                     const Eigen::VectorXd& u) {
  const blockid::detail::Resampler filter(factor, half_length);
  Eigen::VectorXd stuffed = Eigen::VectorXd::Zero(u.size() * factor);
  for (Index t = 0; t < u.size(); ++t) stuffed[t * factor] = u[t];
  const Eigen::VectorXd x = Eigen::VectorXd::Zero(inner.state_count());
  Eigen::VectorXd w = detail::apply_record(inner, theta, x, convolved(stuffed, filter)).y;
  if (inner.is_static()) w = convolved(w, filter) / static_cast<double>(factor);
  Eigen::VectorXd y(u.size());
  for (Index t = 0; t < u.size(); ++t) y[t] = w[t * factor];
  return y;
}

void expect_twin(const AnyBlock& inner, Index factor, Index half_length) {
  UniformNumbers numbers(11);
  const Index margin = 3 * half_length;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(500);
  u.segment(margin, 500 - 2 * margin) = numbers.vector(500 - 2 * margin);
  Model model = make_model(Oversampled(inner, factor, half_length));
  model.parameters = random_parameters(inner, numbers);
  const Eigen::VectorXd expected = twin(inner, model.parameters, factor, half_length, u);
  const Eigen::VectorXd got = simulate(model, u);
  // The twin takes the time before its record for silence of the block's *output*: f(0) is not zero everywhere.
  const Index counted = 500 - 2 * margin;
  // A few hundred terms of order one.
  EXPECT_LE((expected - got).segment(margin, counted).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff())
      << inner.kind() << ", factor " << factor << ", half_length " << half_length;
}

TEST(OversampledTest, EqualsItsBruteForceTwin) {
  for (const Index factor : {2, 3, 4, 8, 11}) {
    for (const Index half_length : {2, 5, 8}) {
      expect_twin(Polynomial(3, {-2, 2}), factor, half_length);
      expect_twin(Rational(2, 2), factor, half_length);
    }
  }
}

TEST(OversampledTest, FiltersKeepTheirPromises) {
  for (const Index half_length : {8, 12, 25}) {
    const blockid::detail::Resampler filter(4, half_length);
    const double margin = 2.5 / static_cast<double>(half_length);
    for (int step = 0; step < 400; ++step) {
      const double share = 0.01 * step;
      const double gain = filter.response(std::numbers::pi * share / 4.0) / 4.0;
      if (share <= 1.0 - margin) {
        EXPECT_NEAR(gain, 1.0, 2e-4) << half_length << " at " << share;
      }
      // Two windowed side lobes on the scale of 80 dB.
      if (share >= 1.0 + margin) {
        EXPECT_LE(std::abs(gain), 2e-4) << half_length << " at " << share;
      }
    }
  }
}

TEST(OversampledTest, ConstantsPassUnchanged) {
  Model model = make_model(Oversampled(Gain{}, 5, 3));
  model.initial_state = Eigen::VectorXd::Constant(model.chain.state_count(), 1.25);
  Simulator simulator(model);
  for (int t = 0; t < 20; ++t) EXPECT_NEAR(simulator.step(1.25), 1.25, 1e-14);
}

// ---------------------------------------------------------------------------------------------------------------
// The physical task: f acts in continuous time, the converter's filter removes what lies beyond the Nyquist frequency.

constexpr Index kPeriod = 256;

// A multisine of the first `lines` of 128 lines with quadratic phases (Schroeder) at the time t, in samples.
double multisine(double t, int lines) {
  double sum = 0.0;
  for (int line = 1; line <= lines; ++line) {
    const double phase = 2.0 * std::numbers::pi * 0.5 * line * (line - 1) / lines;
    sum += std::cos(2.0 * std::numbers::pi * line * t / kPeriod + phase) / std::sqrt(0.5 * lines);
  }
  return sum;
}

// Lines 0 .. kept of a period of f(multisine), the others removed, at the samples: by a DFT of a 64 times finer grid.
Eigen::VectorXd band_limited(const std::function<double(double)>& f, int lines, Index kept) {
  constexpr Index kFiner = 64;
  Eigen::VectorXd w(kPeriod * kFiner);
  for (Index i = 0; i < w.size(); ++i) w[i] = f(multisine(static_cast<double>(i) / kFiner, lines));
  Eigen::VectorXd y = Eigen::VectorXd::Zero(kPeriod);
  for (Index line = 0; line <= kept; ++line) {
    std::complex<double> c = 0.0;
    for (Index i = 0; i < w.size(); ++i) {
      const auto turn = static_cast<double>(line * i % w.size()) / static_cast<double>(w.size());
      c += w[i] * std::polar(1.0, -2.0 * std::numbers::pi * turn) / static_cast<double>(w.size());
    }
    for (Index t = 0; t < kPeriod; ++t) {
      const auto turn = static_cast<double>(line * t % kPeriod) / static_cast<double>(kPeriod);
      y[t] += (line == 0 ? 1.0 : 2.0) * (c * std::polar(1.0, 2.0 * std::numbers::pi * turn)).real();
    }
  }
  return y;
}

// One period of a signal with only its lines 0 .. kept.
Eigen::VectorXd low_lines(const Eigen::VectorXd& y, Index kept) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(kPeriod);
  for (Index line = 0; line <= kept; ++line) {
    std::complex<double> c = 0.0;
    for (Index t = 0; t < kPeriod; ++t) {
      c +=
          y[t] * std::polar(1.0 / kPeriod, -2.0 * std::numbers::pi * static_cast<double>(line * t % kPeriod) / kPeriod);
    }
    for (Index t = 0; t < kPeriod; ++t) {
      const std::complex<double> turn =
          std::polar(1.0, 2.0 * std::numbers::pi * static_cast<double>(line * t % kPeriod) / kPeriod);
      result[t] += (line == 0 ? 1.0 : 2.0) * (c * turn).real();
    }
  }
  return result;
}

// Error in dB of the output's standard deviation, over the lines up to 0.6 of the Nyquist frequency.
double error_db(const AnyBlock& block, const std::function<double(double)>& f, int lines) {
  constexpr Index kKept = 77;
  Eigen::VectorXd u(3 * kPeriod);
  for (Index t = 0; t < u.size(); ++t) u[t] = multisine(static_cast<double>(t), lines);
  const Eigen::VectorXd y = simulate(make_model(block), u).segment(kPeriod, kPeriod);
  const Eigen::VectorXd expected = band_limited(f, lines, kKept);
  const Eigen::VectorXd difference = low_lines(y, kKept) - expected;
  const double spread = (expected.array() - expected.mean()).matrix().norm();
  return 20.0 * std::log10(difference.norm() / spread);
}

TEST(OversampledTest, CubicFollowsTheCircuit) {
  const Memoryless cube([](auto, auto u) { return u * u * u; }, 0);
  const auto f = [](double v) { return v * v * v; };
  // Harmonics reach line 3 x 64 of 128: those beyond fold back, and twice the rate has room for all of them. What is
  // left is the filters' ripple of 80 dB, three times it through the cube.
  EXPECT_GT(error_db(cube, f, 64), -25.0);
  EXPECT_LT(error_db(Oversampled(cube, 2, 12), f, 64), -70.0);
  EXPECT_LT(error_db(Oversampled(cube, 4, 12), f, 64), -70.0);
}

TEST(OversampledTest, KinkFollowsTheCircuitBetterWithEveryDoubling) {
  using std::abs;
  const Memoryless rectifier([](auto, auto u) { return abs(u); }, 0);
  const auto f = [](double v) { return std::abs(v); };
  const double plain = error_db(rectifier, f, 40);
  const double twice = error_db(Oversampled(rectifier, 2, 12), f, 40);
  const double four_times = error_db(Oversampled(rectifier, 4, 12), f, 40);
  const double eight_times = error_db(Oversampled(rectifier, 8, 12), f, 40);
  RecordProperty("db", std::to_string(plain) + " " + std::to_string(twice) + " " + std::to_string(four_times) + " " +
                           std::to_string(eight_times));
  // Found: -25, -37, -50, -62 dB. Amplitudes of a kink's harmonics fall like 1/n^2, so every doubling takes 12 dB off
  // those that still fold back.
  EXPECT_LT(twice, plain - 10.0);
  EXPECT_LT(four_times, twice - 10.0);
  EXPECT_LT(eight_times, four_times - 10.0);
}

// ---------------------------------------------------------------------------------------------------------------

TEST(OversampledTest, ChainWhoseSignalIsSlowIsTheChainItself) {
  // A static row around which there is nothing to remove: a straight line.
  const Eigen::VectorXd u = Eigen::VectorXd::NullaryExpr(400, [](Index t) {
    const double x = (static_cast<double>(t) - 200.0) / 40.0;
    return std::exp(-x * x);
  });
  Model model = make_model(parse("oversampled(gain | gain,factor=4)"));
  model.parameters = Eigen::Vector2d(2.0, -0.5);
  // The pass band's ripple, 80 dB.
  EXPECT_LE((simulate(model, u) + u).cwiseAbs().maxCoeff(), 2e-4);
}

TEST(OversampledTest, TextForm) {
  for (const std::string text :
       {"f=oversampled(spline(knots=30),factor=4)", "oversampled(saturation,factor=2,half_length=12)",
        "oversampled((G1=rational(nb=1,na=1) | f=spline(knots=5)),factor=8)",
        "oversampled([gain + saturation],factor=3)"}) {
    EXPECT_EQ(to_text(parse(text)), text);
  }
  EXPECT_EQ(to_text(parse("oversampled(G1=rational(nb=1,na=1) | f=spline(knots=5) , factor=8)")),
            "oversampled((G1=rational(nb=1,na=1) | f=spline(knots=5)),factor=8)");
  EXPECT_EQ(to_text(parse("oversampled(rational(nb=1,na=1) | spline(knots=5),factor=8)")),
            "oversampled((rational(nb=1,na=1) | spline(knots=5)),factor=8)");
  EXPECT_EQ(parse("f=oversampled(spline(knots=3),factor=4)").parameter_names().front(), "f.c1");
}

std::string refusal(const std::string& text) {
  try {
    parse(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(OversampledTest, MistakesAreNamed) {
  EXPECT_THAT(refusal("oversampled(gain)"), HasSubstr("the key 'factor' is required"));
  EXPECT_THAT(refusal("oversampled(factor=4)"), HasSubstr("expected exactly one nested block, got 0"));
  EXPECT_THAT(refusal("oversampled(gain,gain,factor=4)"), HasSubstr("expected exactly one nested block, got 2"));
  EXPECT_THAT(refusal("oversampled(gain,factor=1)"),
              HasSubstr("factor must be a whole number in 2..64, got the number 1"));
  EXPECT_THAT(refusal("oversampled(gain,fctor=4)"), HasSubstr("has no key 'fctor'"));
  EXPECT_THAT(refusal("oversampled(oversampled(gain,factor=2),factor=2)"), HasSubstr("do not nest"));
  EXPECT_THROW(Oversampled(Gain{}, 65), Error);
  EXPECT_THROW(Oversampled(Gain{}, 4, 1), Error);
}

TEST(OversampledTest, ModelFileKeepsEveryNumber) {
  Model model = make_model(parse("G=rational(nb=1,na=2) | f=oversampled(polynomial(degree=3,range=[-2,2]),factor=3)"));
  UniformNumbers numbers(5);
  model.parameters = 0.3 * numbers.vector(model.parameters.size());
  model.initial_state = numbers.vector(model.chain.state_count());
  const Model read = model_from_json(to_json(model));
  const Eigen::VectorXd u = numbers.vector(200);
  EXPECT_EQ(simulate(read, u), simulate(model, u));
  EXPECT_THROW(to_json(make_model(Oversampled(CustomTanh{}, 2))), Error);
}

TEST(OversampledTest, KnotsArePlacedBetweenTheSamples) {
  // Samples of a fast sine miss its peaks.
  const Eigen::VectorXd u = Eigen::VectorXd::NullaryExpr(
      400, [](Index t) { return std::sin(0.5 * std::numbers::pi * static_cast<double>(t) + 0.25 * std::numbers::pi); });
  const auto range_of = [&](const std::string& text) {
    const Model model = adapt_structure(make_model(parse(text)), u);
    const std::vector<double> knots = static_block_of(model.chain.children().back().block)->target<Spline>()->knots();
    return knots.back() - knots.front();
  };
  EXPECT_LT(range_of("spline(knots=5)"), 1.5);
  EXPECT_GT(range_of("oversampled(spline(knots=5),factor=8)"), 1.9);
}

TEST(OversampledTest, AdaptsTheChainWithin) {
  const Eigen::VectorXd u = 3.0 * UniformNumbers(2).vector(500);
  const Model model = adapt_structure(make_model(parse("oversampled(gain | f=spline(knots=5),factor=2)")), u);
  const auto* block = model.chain.children().front().block.target<Oversampled>();
  ASSERT_NE(block, nullptr);
  EXPECT_GT(block->inner().children()[1].block.target<Spline>()->knots().back(), 2.5);
}

TEST(OversampledTest, PlainTwinAndBack) {
  const std::string plain = "G=rational(nb=1,na=1) | [a=spline(knots=4) + b=gain]";
  const std::string fine =
      "G=rational(nb=1,na=1) | [a=oversampled(spline(knots=4),factor=4) + b=oversampled(gain,factor=4)]";
  EXPECT_EQ(to_text(without_oversampling(parse(fine))), plain);
  EXPECT_EQ(to_text(with_oversampling_of(parse(fine), parse(plain))), fine);
  EXPECT_THROW(with_oversampling_of(parse(fine), parse("gain")), Error);
  // A chain at the higher rate has no plain form.
  const std::string chain = "oversampled(rational(nb=1,na=1),factor=4)";
  EXPECT_EQ(to_text(without_oversampling(parse(chain))), chain);
}

}  // namespace
}  // namespace blockid::testing
