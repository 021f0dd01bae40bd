// The conformance suite run on the library's blocks, on blocks as users write them and on random chains.
#include "blocks/custom_blocks.hpp"
#include "blocks/random_chains.hpp"

#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/dead_zone.hpp>
#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/memoryless.hpp>
#include <blockid/blocks/offset.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/piecewise_linear.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/saturation.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/tanh_network.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include <gmock/gmock.h>

namespace blockid::testing {
namespace {

ConformanceOptions at_random_parameters(const AnyBlock& block, std::uint64_t seed) {
  UniformNumbers numbers(seed);
  ConformanceOptions options;
  options.parameters = random_parameters(block, numbers);
  options.seed = seed;
  return options;
}

struct Orders {
  Index nb;
  Index na;
  Index nk;
};

std::string name_of(const Orders& orders) {
  return "nb" + std::to_string(orders.nb) + "na" + std::to_string(orders.na) + "nk" + std::to_string(orders.nk);
}

class RationalLaws : public ::testing::TestWithParam<Orders> {};

TEST_P(RationalLaws, Hold) {
  const auto [nb, na, nk] = GetParam();
  const Rational block(nb, na, nk);
  EXPECT_THAT(block, ConformsToBlockLaws(at_random_parameters(block, 7)));
}

INSTANTIATE_TEST_SUITE_P(Orders, RationalLaws,
                         ::testing::Values(Orders{0, 0, 0}, Orders{0, 0, 1}, Orders{0, 1, 0}, Orders{1, 0, 0},
                                           Orders{1, 1, 0}, Orders{0, 3, 0}, Orders{1, 4, 1}, Orders{4, 1, 0},
                                           Orders{2, 1, 3}, Orders{3, 3, 0}, Orders{5, 5, 0}, Orders{2, 6, 0},
                                           Orders{7, 3, 0}, Orders{3, 8, 2}, Orders{9, 2, 0}, Orders{1, 9, 0},
                                           Orders{10, 10, 0}, Orders{4, 4, 7}, Orders{3, 12, 0}, Orders{12, 3, 0}),
                         [](const auto& test) { return name_of(test.param); });

TEST(RationalPoints, LawsHoldAtTheDefaultPoint) { EXPECT_THAT(Rational(3, 4), ConformsToBlockLaws()); }

TEST(RationalPoints, LawsHoldForAnUnstableFilter) {
  ConformanceOptions options;
  options.parameters = Eigen::Vector4d(1.0, -0.4, -1.5, 0.497);  // poles 1.006 and 0.494
  const ConformanceReport report = check_block(Rational(1, 2), options);
  EXPECT_TRUE(report.ok()) << report.text();
  EXPECT_THAT(report.skipped, ::testing::Contains(::testing::HasSubstr("does not die away")));
}

class PolynomialLaws : public ::testing::TestWithParam<Index> {};

TEST_P(PolynomialLaws, Hold) {
  const Polynomial settled(GetParam(), {-1.7, 2.1});
  EXPECT_THAT(settled, ConformsToBlockLaws(at_random_parameters(settled, 8)));
  EXPECT_THAT(Polynomial(GetParam()), ConformsToBlockLaws());
}

INSTANTIATE_TEST_SUITE_P(Degrees, PolynomialLaws, ::testing::Values(0, 1, 2, 3, 5, 7, 12));

TEST(PolynomialPoints, LawsHoldForTheHighestDegreeOnItsRange) {
  const Polynomial block(Polynomial::kMaxDegree, {-1.6, 1.6});
  EXPECT_THAT(block, ConformsToBlockLaws(at_random_parameters(block, 9)));
}

// Parameters at random, and adapted to a signal as well as not.
void expect_laws(const AnyBlock& block, std::uint64_t seed) {
  EXPECT_THAT(block, ConformsToBlockLaws(at_random_parameters(block, seed)));
  EXPECT_THAT(block, ConformsToBlockLaws());
  const Eigen::VectorXd v = uniform_input(300, seed);
  const AnyBlock adapted = block.adapted_to(detail::view(v));
  EXPECT_THAT(adapted, ConformsToBlockLaws(at_random_parameters(adapted, seed + 1)));
}

TEST(LibraryBlockLaws, Gain) { expect_laws(Gain{}, 20); }
TEST(LibraryBlockLaws, Offset) { expect_laws(Offset{}, 21); }

TEST(LibraryBlockLaws, Delay) {
  for (const Index samples : {0, 1, 3}) expect_laws(Delay(samples), 22);
  // Longer than a tile; two tangent counts will do, for every state is a column.
  ConformanceOptions options;
  options.upstream_counts = {0, 3};
  EXPECT_THAT(Delay(513), ConformsToBlockLaws(options));
}

TEST(LibraryBlockLaws, Fir) {
  for (const Index nb : {0, 1, 4, 9, 40}) expect_laws(Fir(nb), 23);
  expect_laws(Fir(3, 2), 24);
}

TEST(LibraryBlockLaws, Biquads) {
  for (const Index sections : {1, 2, 4}) {
    expect_laws(Biquads(sections), 25);
    expect_laws(Biquads(sections, true), 26);
  }
}

TEST(LibraryBlockLaws, BiquadsOutsideTheCircle) {
  const Biquads block(2);
  ConformanceOptions options;
  options.parameters = block.initial_parameters();
  options.parameters->segment<2>(3) = Eigen::Vector2d(-1.5, 0.497);  // a pole at 1.006
  const ConformanceReport report = check_block(block, options);
  EXPECT_TRUE(report.ok()) << report.text();
  EXPECT_THAT(report.skipped, ::testing::Contains(::testing::HasSubstr("does not die away")));
}

TEST(LibraryBlockLaws, PiecewiseLinear) {
  for (const Index knots : {2, 3, 20}) expect_laws(PiecewiseLinear(knots), 27);
  expect_laws(PiecewiseLinear(5, KnotPlacement::quantile), 28);
  expect_laws(PiecewiseLinear(4, SignalRange{-0.7, 1.1}), 29);
  expect_laws(PiecewiseLinear({-1.2, -1.0, 0.01, 0.9}), 30);
}

TEST(LibraryBlockLaws, Spline) {
  for (const Index knots : {2, 3, 20}) expect_laws(Spline(knots), 31);
  expect_laws(Spline(6, KnotPlacement::uniform), 32);
  expect_laws(Spline(4, SignalRange{-0.7, 1.1}), 33);
  expect_laws(Spline({-1.2, -1.0, 0.01, 0.9}), 34);
}

TEST(LibraryBlockLaws, Saturation) { expect_laws(Saturation{}, 35); }
TEST(LibraryBlockLaws, DeadZone) { expect_laws(DeadZone{}, 36); }

TEST(LibraryBlockLaws, TanhNetwork) {
  for (const Index units : {1, 2, 5, 9}) expect_laws(TanhNetwork(units), 37);
  expect_laws(TanhNetwork(3, {-0.5, 2.0}), 38);
}

TEST(LibraryBlockLaws, Memoryless) {
  const Memoryless cubic([](auto theta, auto u) { return theta[0] * u + theta[1] * u * u * u; }, 2);
  expect_laws(cubic, 39);
  const Memoryless fixed([](auto, auto u) { return u * u; }, 0);
  expect_laws(fixed, 40);
}

TEST(LibraryBlockLaws, HoldForInputsOfAnyUnit) {
  for (const double scale : {1e-6, 1e5}) {
    ConformanceOptions options;
    options.input_scale = scale;
    options.state_scale = scale;
    options.difference_step = 2e-7 * std::min(1.0, scale);
    EXPECT_THAT(Rational(2, 3), ConformsToBlockLaws(options)) << scale;
  }
}

TEST(CustomBlockLaws, StaticBlock) { EXPECT_THAT(CustomTanh{}, ConformsToBlockLaws()); }
TEST(CustomBlockLaws, BlockWithState) { EXPECT_THAT(CustomLag{}, ConformsToBlockLaws()); }
TEST(CustomBlockLaws, BlockWithoutParameters) { EXPECT_THAT(CustomSquare{}, ConformsToBlockLaws()); }
TEST(CustomBlockLaws, MoreParametersThanOneJetCarries) { EXPECT_THAT(CustomCosines{}, ConformsToBlockLaws()); }

TEST(SeriesLaws, OfOneBlock) {
  const Series row({{"", Rational(1, 2)}});
  EXPECT_THAT(row, ConformsToBlockLaws(at_random_parameters(row, 10)));
}

TEST(SeriesLaws, WienerHammerstein) {
  const Series row({{"G1", Rational(3, 3)}, {"f", Polynomial(5, {-5, 5})}, {"G2", Rational(2, 3, 1)}});
  EXPECT_THAT(row, ConformsToBlockLaws(at_random_parameters(row, 11)));
}

TEST(SeriesLaws, LinearBlocksKeepTheLawsOfLinearBlocks) {
  const Series row({{"", Rational(1, 2)}, {"", Parallel({{"", Rational(0, 1)}, {"", Rational(2, 0, 3)}})}});
  ASSERT_TRUE(row.is_linear());
  const ConformanceReport report = check_block(row, at_random_parameters(row, 12));
  EXPECT_TRUE(report.ok()) << report.text();
  EXPECT_THAT(report.skipped, ::testing::Not(::testing::Contains(::testing::HasSubstr("frequency"))));
}

TEST(SeriesLaws, LinearInParameters) {
  // A fixed block, one linear in its parameters, nothing behind it that would bend them.
  const Series row({{"", CustomSquare{}}, {"", Polynomial(3, {-3, 3})}});
  EXPECT_TRUE(row.is_linear_in_parameters());
  EXPECT_THAT(row, ConformsToBlockLaws());
  EXPECT_FALSE(Series({{"", Polynomial(3)}, {"", CustomSquare{}}}).is_linear_in_parameters());
  EXPECT_FALSE(Series({{"", Rational(2, 0)}, {"", Rational(1, 0)}}).is_linear_in_parameters());
  EXPECT_FALSE(Series({{"", Polynomial(2)}, {"", Rational(1, 1)}}).is_linear_in_parameters());
  EXPECT_TRUE(Parallel({{"", Polynomial(2)}, {"", Rational(1, 0)}}).is_linear_in_parameters());
}

TEST(ParallelLaws, BranchesOfUnequalSize) {
  const Parallel sum({{"a", Rational(4, 1)}, {"b", Polynomial(2)}, {"", CustomLag{}}, {"", Rational(0, 3, 2)}});
  EXPECT_THAT(sum, ConformsToBlockLaws(at_random_parameters(sum, 13)));
}

TEST(ParallelLaws, OneBranch) {
  const Parallel sum({{"", Rational(1, 3)}});
  EXPECT_THAT(sum, ConformsToBlockLaws(at_random_parameters(sum, 14)));
}

class RandomChainLaws : public ::testing::TestWithParam<int> {};

TEST_P(RandomChainLaws, Hold) {
  std::mt19937_64 engine(static_cast<std::uint64_t>(GetParam()));
  const AnyBlock chain = random_chain(engine, 1 + GetParam() % 3);
  ConformanceOptions options = at_random_parameters(chain, 1000 + static_cast<std::uint64_t>(GetParam()));
  options.upstream_counts = {0, 1, 5, 11};
  EXPECT_THAT(chain, ConformsToBlockLaws(options)) << outline(chain);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomChainLaws, ::testing::Range(0, 60));

}  // namespace
}  // namespace blockid::testing
