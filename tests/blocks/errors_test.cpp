// What blocks say to a caller's mistakes: which block, what was expected, what came.
#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/memoryless.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/piecewise_linear.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/tanh_network.hpp>
#include <blockid/data/error.hpp>

#include <gmock/gmock.h>

namespace blockid {
namespace {

using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::string complaint(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing thrown";
}

TEST(BlockErrorsTest, OrdersBelowZero) {
  EXPECT_EQ(complaint([] { Rational(-1, 2); }),
            "rational: nb, na and nk are degrees and a delay, expected >= 0, got nb=-1, na=2, nk=0");
  EXPECT_THAT(complaint([] { Rational(1, -2); }), HasSubstr("na=-2"));
  EXPECT_THAT(complaint([] { Rational(1, 2, -3); }), HasSubstr("nk=-3"));
  EXPECT_EQ(complaint([] { Fir(-1); }), "fir: nb and nk are a degree and a delay, expected >= 0, got nb=-1, nk=0");
  EXPECT_THAT(complaint([] { Fir(2, -4); }), HasSubstr("nk=-4"));
  EXPECT_EQ(complaint([] { Delay(-1); }), "delay: samples must be >= 0, got -1");
  EXPECT_EQ(complaint([] { Biquads(0); }), "biquads: expected at least 1 section, got 0");
  EXPECT_EQ(complaint([] { TanhNetwork(0); }), "tanh_network: expected at least 1 unit, got 0");
  EXPECT_EQ(complaint([] { Polynomial(-1); }), "polynomial: degree must lie in 0..60, got -1");
  EXPECT_EQ(complaint([] { Polynomial(61); }), "polynomial: degree must lie in 0..60, got 61");
  EXPECT_EQ(complaint([] { Rational(0, 0, 0); }), "nothing thrown");
}

TEST(BlockErrorsTest, RangesThatAreNone) {
  EXPECT_EQ(complaint([] {
              Polynomial(2, {1.0, 1.0});
            }),
            "polynomial: range must be two finite numbers with lower < upper, got [1, 1]");
  EXPECT_THAT(complaint([] { Polynomial(2, {2.0, -1.5}); }), HasSubstr("got [2, -1.5]"));
  EXPECT_THAT(complaint([] { Polynomial(2, {-kInfinity, 0.0}); }), HasSubstr("got [-inf, 0]"));
  EXPECT_THAT(complaint([] { Polynomial(2, {kNaN, 0.0}); }), HasSubstr("nan"));
  EXPECT_THAT(complaint([] { TanhNetwork(2, {3.0, 0.0}); }), HasSubstr("tanh_network: range must be"));
  EXPECT_THAT(complaint([] { Spline(4, SignalRange{3.0, 0.0}); }), HasSubstr("spline: range must be"));
  EXPECT_THAT(complaint([] {
                PiecewiseLinear(4, SignalRange{0.0, 0.0});
              }),
              HasSubstr("piecewise_linear: range must be"));
}

TEST(BlockErrorsTest, KnotsThatAreNone) {
  EXPECT_EQ(complaint([] { Spline(1); }), "spline: the number of knots must lie in 2..1000, got 1");
  EXPECT_EQ(complaint([] { PiecewiseLinear(1001); }),
            "piecewise_linear: the number of knots must lie in 2..1000, got 1001");
  EXPECT_THAT(complaint([] { Spline(std::vector<double>{0.0}); }), HasSubstr("must lie in 2..1000, got 1"));
  EXPECT_EQ(complaint([] { Spline({0.0, 0.5, 0.5}); }), "spline: knots must increase strictly, got 0.5 before 0.5");
  EXPECT_THAT(complaint([] { PiecewiseLinear({0.0, 1.0, -0.25}); }), HasSubstr("got 1 before -0.25"));
  EXPECT_EQ(complaint([] { Spline({0.0, kInfinity}); }), "spline: knot 2 is not finite");
  EXPECT_THAT(complaint([] { Spline({-1e308, 1e308}); }), HasSubstr("knots span an impossible width of inf"));
}

TEST(BlockErrorsTest, SignalsThatNothingCanBePlacedFor) {
  const std::vector<double> constant(5, 0.5);
  const std::vector<double> broken = {0.0, 1.0, kNaN};
  const std::vector<double> narrow = {1.0, std::nextafter(1.0, 2.0), 1.0};
  EXPECT_EQ(complaint([&] { AnyBlock(Polynomial(2)).adapted_to(constant); }),
            "polynomial: its input is constant (0.5), a range needs two different values");
  EXPECT_THAT(complaint([&] { AnyBlock(Spline(4)).adapted_to(constant); }), HasSubstr("constant (0.5)"));
  EXPECT_EQ(complaint([&] { AnyBlock(TanhNetwork(2)).adapted_to(broken); }),
            "tanh_network: its input is not finite at sample 2");
  EXPECT_THAT(complaint([&] { AnyBlock(PiecewiseLinear(4)).adapted_to(broken); }), HasSubstr("not finite at sample 2"));
  EXPECT_EQ(complaint([&] { AnyBlock(Spline(4)).adapted_to({}); }), "spline: cannot be placed for an empty signal");
  EXPECT_THAT(complaint([&] { AnyBlock(Spline(4)).adapted_to(narrow); }), HasSubstr("4 knots cannot be told apart"));
  EXPECT_EQ(complaint([&] {
              AnyBlock(Spline(4, SignalRange{0.0, 1.0})).adapted_to(constant);
            }),
            "nothing thrown")
      << "settled knots need no signal";
}

TEST(BlockErrorsTest, RowsAndSums) {
  EXPECT_EQ(complaint([] { Series({}); }), "series: expected at least one block, got none");
  EXPECT_EQ(complaint([] { Parallel({}); }), "parallel: expected at least one block, got none");
  EXPECT_EQ(complaint([] {
              Series({{"G", Gain{}}, {"f", Gain{}}, {"G", Gain{}}});
            }),
            "series: the label 'G' comes twice; labels within one row or sum must differ");
  EXPECT_THAT(complaint([] {
                Parallel({{"a", Gain{}}, {"a", Gain{}}});
              }),
              HasSubstr("parallel: the label 'a' comes twice"));
  EXPECT_EQ(complaint([] {
              Series({{"", Gain{}}, {"", Gain{}}});
            }),
            "nothing thrown")
      << "blocks without a label bear their kind and place";
}

TEST(BlockErrorsTest, LabelsThatLookLikeTheNameOfABlockWithoutOne) {
  // Both would give parameters called gain2.k.
  EXPECT_THAT(complaint([] { Series({{"gain2", Gain{}}, {"", Gain{}}}); }), HasSubstr("the label 'gain2' comes twice"));
  EXPECT_THAT(complaint([] {
                Parallel({{"", Gain{}}, {"gain1", Gain{}}});
              }),
              HasSubstr("the label 'gain1' comes twice"));
}

struct Late {
  Index parameter_count() const { return 0; }
  Index latency() const { return 3; }
  template <class T>
  void apply(std::span<const T>, std::span<T>, std::span<const T> u, std::span<T> y) const {
    std::copy(u.begin(), u.end(), y.begin());
  }
};

TEST(BlockErrorsTest, BranchesOfUnequalLatency) {
  EXPECT_EQ(complaint([] {
              Parallel({{"a", Gain{}}, {"b", Late{}}});
            }),
            "parallel: all branches must have the same latency, got 0 and 3 samples; oversample all branches alike, or "
            "the sum as a "
            "whole");
  EXPECT_EQ(complaint([] { Parallel({{"a", Late{}}, {"b", Late{}}}); }), "nothing thrown");
}

TEST(BlockErrorsTest, RootsThatAreNoRealFilter) {
  using namespace std::complex_literals;
  const Biquads block(1);
  EXPECT_EQ(complaint([&] {
              block.from_roots(1.0, {}, {0.1, 0.2, 0.3});
            }),
            "biquads: expected at most 2 poles (two a section), got 3");
  EXPECT_THAT(complaint([&] {
                block.from_roots(1.0, {0.1, 0.2, 0.3}, {});
              }),
              HasSubstr("zeros (two a section), got 3"));
  EXPECT_EQ(complaint([&] {
              block.from_roots(1.0, {}, {0.5 + 0.25i, 0.5 + 0.25i});
            }),
            "biquads: poles must be closed under conjugation, found no partner of 0.5 + 0.25j");
  EXPECT_THAT(complaint([&] {
                Biquads(1, true).from_roots(1.0, {}, {0.5, 1.0});
              }),
              HasSubstr("poles within the unit circle, got one of magnitude 1"));
  EXPECT_EQ(complaint([&] { block.from_roots(1.0, {}, {0.5, 1.0}); }), "nothing thrown");
}

TEST(BlockErrorsTest, SizesThatDoNotFit) {
  EXPECT_EQ(complaint([] { Polynomial(3).from_powers(Eigen::VectorXd::Zero(3)); }),
            "polynomial: expected 4 powers for degree 3, got 3");
  const auto f = [](auto theta, auto u) { return theta[0] * u; };
  EXPECT_EQ(complaint([&] { Memoryless(f, -1); }), "memoryless: parameter_count must be >= 0, got -1");
  EXPECT_EQ(complaint([&] { Memoryless(f, 2, {"a"}); }),
            "memoryless: expected 2 names and initial parameters, got 1 and 2");
  EXPECT_THAT(complaint([&] { Memoryless(f, 2, {"a", "b"}, Eigen::VectorXd::Zero(3)); }), HasSubstr("got 2 and 3"));
}

}  // namespace
}  // namespace blockid
