// Blocks whose parameters follow fewer numbers.
#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/saturation.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/blocks/tied.hpp>
#include <blockid/data/error.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include "data/message.hpp"

#include <gmock/gmock.h>

#include <vector>

namespace blockid::testing {
namespace {

using blockid::detail::view;
using ::testing::HasSubstr;

// Two filters that share their poles, the second with an exponent of 1 minus that of the first.
Tied shared_poles(const AnyBlock& f) {
  const FractionalFilter filter({{0.8, {0.6, 0.5}}, {-0.4, 1.6}}, 30, 28, 1);
  std::vector<Tie> ties;
  for (Index k = 0; k < 6; ++k) ties.push_back({k});
  for (Index k = 0; k < f.parameter_count(); ++k) ties.push_back({8 + k});
  for (Index k = 0; k < 4; ++k) ties.push_back({k, -1.0, 1.0});
  for (Index k = 0; k < 2; ++k) ties.push_back({6 + k});
  return {Series({{"W", filter}, {"f", f}, {"H", filter}}), ties};
}

TEST(TiedTest, KeepsTheLaws) {
  EXPECT_THAT(Tied(Gain{}, {{0, -2.0, 0.5}}), ConformsToBlockLaws());
  EXPECT_THAT(Tied(Saturation{}, {{0, -1.0}, {0}}), ConformsToBlockLaws());
  EXPECT_THAT(Tied(Rational(2, 2, 1), {{1}, {0, 3.0}, {0, -1.0, 0.2}, {2, 0.1}, {3, 0.1}}), ConformsToBlockLaws());
  EXPECT_THAT(shared_poles(Polynomial(3, {-4.0, 4.0})), ConformsToBlockLaws());
  EXPECT_THAT(shared_poles(Spline(5, SignalRange{-3.0, 3.0})), ConformsToBlockLaws());
}

TEST(TiedTest, LawsHoldInARowAndNested) {
  const Tied inner(Rational(1, 1), {{0}, {1}, {1, -0.5}});
  const Series row({{"a", inner}, {"f", Polynomial(2, {-2.0, 2.0})}, {"b", inner}});
  EXPECT_THAT(row, ConformsToBlockLaws());
  EXPECT_THAT(Tied(row, {{0}, {1}, {2}, {3}, {4}, {0}, {1}}), ConformsToBlockLaws());
}

TEST(TiedTest, SimulatesLikeTheInnerBlock) {
  const Tied tied(Rational(1, 1), {{0}, {1, 2.0}, {0, -0.5, 0.1}});
  const Eigen::Vector2d theta(0.6, -0.3);
  const Eigen::VectorXd inner = tied.inner_parameters(view(theta));
  EXPECT_EQ(inner, Eigen::Vector3d(0.6, -0.6, -0.5 * 0.6 + 0.1));
  EXPECT_LT((tied.from_inner(view(inner)) - theta).norm(), 1e-15);
  Model a = make_model(tied, 1.0);
  a.parameters = theta;
  Model b = make_model(Rational(1, 1), 1.0);
  b.parameters = inner;
  const Eigen::VectorXd u = uniform_input(100, 1);
  EXPECT_EQ(simulate(a, u), simulate(b, u));
}

TEST(TiedTest, NamesStartAndBoundsComeFromTheInnerBlock) {
  const Tied tied(Series({{"G", Rational(1, 1)}, {"k", Gain{}}}), {{2}, {0}, {0, -1.0}, {1, 0.5, 0.25}});
  EXPECT_EQ(tied.parameter_names(), (std::vector<std::string>{"G.b1", "k.k", "G.b0"}));
  EXPECT_EQ(tied.initial_parameters(), Eigen::Vector3d(0.0, 1.5, 1.0));
  EXPECT_EQ(tied.bounds().lower.size(), 3);
}

TEST(TiedTest, TextComesBack) {
  const AnyBlock block = shared_poles(Spline(4, SignalRange{-3.0, 3.0}));
  const std::string text = to_text(block);
  EXPECT_THAT(text, HasSubstr("tied((W=fractional("));
  const AnyBlock again = parse(text);
  EXPECT_EQ(to_text(again), text);
  Model a = make_model(block, 1.0);
  Model b = make_model(again, 1.0);
  a.parameters += 0.1 * UniformNumbers(2).vector(a.parameters.size());
  b.parameters = a.parameters;
  const Eigen::VectorXd u = uniform_input(80, 3);
  EXPECT_EQ(simulate(a, u), simulate(b, u));
  EXPECT_EQ(to_text(parse("tied(gain)")), "tied(gain,to=[0])");
}

TEST(TiedTest, KnotsWithinArePlaced) {
  Model model = make_model(shared_poles(Spline(6)), 1.0);
  const Eigen::VectorXd u = uniform_input(500, 4);
  model.parameters.head(4) << 0.9, 0.2, 0.6, 0.3;
  const Model placed = adapt_structure(model, u);
  const auto* tied = placed.chain.target<Tied>();
  ASSERT_NE(tied, nullptr);
  EXPECT_THAT(to_text(tied->inner()), HasSubstr("knots=["));
  EXPECT_LT((placed.parameters.head(4) - model.parameters.head(4)).norm(), 1e-15);
}

TEST(TiedTest, Refusals) {
  EXPECT_THAT(BLOCKID_MESSAGE(parse("tied(gain,to=[1])")), HasSubstr("to"));
  EXPECT_THAT(BLOCKID_MESSAGE(parse("tied(gain,to=[0.5])")), HasSubstr("whole numbers"));
  EXPECT_THAT(BLOCKID_MESSAGE(parse("tied(gain,to=[0,0])")), HasSubstr("as many numbers"));
  EXPECT_THAT(BLOCKID_MESSAGE(parse("tied(gain,scale=[0])")), HasSubstr("not 0"));
  EXPECT_THAT(BLOCKID_MESSAGE(parse("tied(rational(nb=1,na=0),to=[1,1])")),
              HasSubstr("no inner parameter follows number 0"));
  EXPECT_THROW(Tied(Gain{}, {}), Error);
  EXPECT_THROW(Tied(Gain{}, {{-1}}), Error);
  EXPECT_THROW(Tied(Gain{}, {{7}}), Error);
}

}  // namespace
}  // namespace blockid::testing
