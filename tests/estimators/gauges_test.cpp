#include <blockid/estimators/gauges.hpp>

#include "estimators/systems.hpp"
#include "support/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::model_of;
using testing::Noise;
using ::testing::UnorderedElementsAre;

std::vector<std::string> held(const Model& model) {
  std::vector<std::string> names;
  for (const Index k : gain_gauges(model.chain, model.parameters)) {
    names.push_back(model.chain.parameter_names()[static_cast<std::size_t>(k)]);
  }
  return names;
}

TEST(GainGaugesTest, FilterBeforeAndBehindAStaticBlock) {
  EXPECT_THAT(held(testing::wiener()), ElementsAre("G.b0"));
  EXPECT_THAT(held(testing::hammerstein()), ElementsAre("G.b0"));
  EXPECT_THAT(held(testing::wiener_hammerstein()), ElementsAre("G1.b0", "G2.b0"));
  EXPECT_THAT(held(testing::linear()), IsEmpty());
}

TEST(GainGaugesTest, TheLargestNumeratorCoefficientIsHeld) {
  EXPECT_THAT(held(model_of("G=rational(nb=2,na=1) | f=polynomial(degree=1)", {0.1, -0.9, 0.3, -0.5, 0, 1})),
              ElementsAre("G.b1"));
}

TEST(GainGaugesTest, LinearBlocksInARow) {
  EXPECT_THAT(held(model_of("A=fir(nb=1) | B=gain | C=rational(nb=0,na=1)", {1, 2, 3, 4, 0.5})),
              ElementsAre("A.b1", "B.k"));
  EXPECT_THAT(held(model_of("A=fir(nb=0) | B=gain | f=polynomial(degree=1) | C=gain", {1, 2, 0, 3, 4})),
              ElementsAre("A.b0", "B.k", "C.k"));
}

TEST(GainGaugesTest, GainPassesThroughDelays) {
  EXPECT_THAT(held(model_of("A=gain | d=delay(samples=3) | f=polynomial(degree=1) | e=delay(samples=1) | B=gain",
                            {2, 0, 1, 3})),
              ElementsAre("A.k", "B.k"));
}

TEST(GainGaugesTest, BiquadsAndFir) {
  EXPECT_THAT(held(model_of("A=biquads(sections=1) | f=spline(knots=2) | B=fir(nb=1)",
                            {2, 0, 0, 0.1, 0.1, -1, -0.3, 0.3, 1, 0.5, 2})),
              ElementsAre("A.g", "B.b1"));
}

TEST(GainGaugesTest, BranchesEachByThemselves) {
  EXPECT_THAT(held(testing::parallel_branches()),
              UnorderedElementsAre("parallel1.series1.A.b0", "parallel1.series2.B.b0"));
}

TEST(GainGaugesTest, StaticBlocksOfFixedSlopePassGainOn) {
  EXPECT_THAT(held(model_of("A=gain | s=saturation | B=gain", {2, -1, 1, 3})), ElementsAre("A.k"));
  EXPECT_THAT(held(model_of("A=gain | s=saturation | f=polynomial(degree=1) | B=gain", {2, -1, 1, 0, 1, 3})),
              ElementsAre("A.k", "B.k"));
  EXPECT_THAT(held(model_of("f=polynomial(degree=1) | s=saturation | B=gain", {0, 1, -1, 1, 3})), ElementsAre("B.k"));
  EXPECT_THAT(held(model_of("A=gain | z=dead_zone", {2, -1, 1})), IsEmpty());
}

std::vector<std::string> held_beside(const Model& model, const std::vector<std::string>& frozen) {
  std::vector<Index> indices;
  for (const std::string& name : frozen) indices.push_back(parameter_index(model, name));
  std::sort(indices.begin(), indices.end());
  std::vector<std::string> names;
  for (const Index k : gain_gauges(model.chain, model.parameters, indices)) {
    names.push_back(model.chain.parameter_names()[static_cast<std::size_t>(k)]);
  }
  return names;
}

TEST(GainGaugesTest, AFrozenGainTakesThePlaceOfAHold) {
  const Model model = testing::wiener_hammerstein();
  EXPECT_THAT(held_beside(model, {"G1.b0"}), ElementsAre("G2.b0"));
  EXPECT_THAT(held_beside(model, {"G1.b0", "G1.b1"}), ElementsAre("G2.b0"));
  EXPECT_THAT(held_beside(model, {"G1.b1", "G2.b1"}), IsEmpty());
  EXPECT_THAT(held_beside(model, {"G1.a1", "G2.a1"}), ElementsAre("G1.b0", "G2.b0"));
  // One number of the static block fixes one of its two gains, two numbers fix both.
  EXPECT_THAT(held_beside(model, {"f.c1"}), ElementsAre("G2.b0"));
  EXPECT_THAT(held_beside(model, {"f.c1", "f.c2"}), IsEmpty());
  const Model saturated = model_of("A=gain | s=saturation | B=gain", {2, -1, 1, 3});
  EXPECT_THAT(held_beside(saturated, {"s.upper"}), IsEmpty());
}

std::vector<Model> models() {
  return {
      testing::wiener(),
      testing::hammerstein(),
      testing::linear(),
      testing::parallel_branches(),
      model_of("G1=rational(nb=2,na=2) | f=polynomial(degree=3) | G2=rational(nb=1,na=2)",
               {0.3, -0.7, 0.2, -1.2, 0.52, 0.5, 3.0, 0.4, -0.5, 0.1, -2.3, -0.9, 0.2}),
      model_of("A=biquads(sections=1) | f=spline(knots=3) | B=fir(nb=1) | C=gain",
               {-2, 0.1, 0.3, 0.1, 0.1, -1, -0.3, 0.3, 1, 0.8, 0.5, 2, -3}),
      model_of("A=fir(nb=1) | d=delay(samples=2) | f=piecewise_linear(knots=3) | e=delay(samples=1) | "
               "B=rational(nb=0,na=1)",
               {0.4, -0.6, -1, 0.2, 3, 0.25, -0.5}),
      model_of("A=gain | t=tanh_network(units=1) | (B=gain | (C=fir(nb=1) | g=polynomial(degree=2))) | D=gain",
               {0.5, 0.1, 0.3, 1, 2, 0.2, 4, 0.2, 0.3, 0.1, 0.5, 0.7, -2}),
      model_of("A=gain | s=saturation | B=gain", {2, -1, 1, 3}),
      model_of("A=gain | z=dead_zone | d=delay(samples=2) | B=rational(nb=0,na=1)", {-2, -0.5, 0.8, 3, 0.4}),
      model_of("f=polynomial(degree=1) | d=delay(samples=1) | s=saturation | B=gain", {0.1, 1, -0.4, 0.6, -3}),
      model_of("A=rational(nb=1,na=1) | d=delay(samples=1) | f=oversampled(spline(knots=3),factor=2,half_length=3) | "
               "B=fir(nb=1)",
               {0.5, -2, -0.4, 0.3, 0.1, -1, -0.3, 0.3, 1, 3}),
      model_of("A=gain | c=oversampled(G=rational(nb=1,na=1) | f=polynomial(degree=2) | H=gain,factor=3) | B=gain",
               {2, 0.4, -0.5, -0.3, 0.1, 0.5, 0.7, -2, 3})};
}

class NormaliseTest : public ::testing::TestWithParam<std::size_t> {};

// Each sample passes a handful of multiplications whose factors are exact inverses up to rounding.
constexpr double kRounding = 1e-12;

TEST_P(NormaliseTest, LeavesTheSimulationUnchanged) {
  const Model model = models()[GetParam()];
  const Model normalised = normalise(model);
  const Eigen::VectorXd u = Noise(3).white(300);
  const Eigen::VectorXd y = simulate(model, u);
  EXPECT_LT((simulate(normalised, u) - y).cwiseAbs().maxCoeff(), kRounding * y.cwiseAbs().maxCoeff());
  EXPECT_EQ(normalised.chain.parameter_names(), model.chain.parameter_names());
}

TEST_P(NormaliseTest, LeavesTheSimulationFromAnInitialStateUnchanged) {
  Model model = models()[GetParam()];
  model.initial_state = Noise(4).white(model.chain.state_count());
  const Model normalised = normalise(model);
  const Eigen::VectorXd u = Noise(5).white(50);
  const Eigen::VectorXd y = simulate(model, u);
  EXPECT_LT((simulate(normalised, u) - y).cwiseAbs().maxCoeff(), kRounding * y.cwiseAbs().maxCoeff());
}

TEST_P(NormaliseTest, IsIdempotentAndHoldsOnes) {
  const Model once = normalise(models()[GetParam()]);
  const Model twice = normalise(once);
  EXPECT_EQ(twice.parameters, once.parameters);
  for (const Index k : gain_gauges(once.chain, once.parameters)) EXPECT_EQ(once.parameters[k], 1.0);
}

INSTANTIATE_TEST_SUITE_P(All, NormaliseTest, ::testing::Range<std::size_t>(0, models().size()));

TEST(NormaliseOnceTest, HeldGainsAreOneToTheLastBit) {
  // 49 (1 / 49) is not 1 in binary arithmetic, and other gains share this.
  for (int whole = 1; whole < 200; ++whole) {
    const double gain = whole;
    const Model once = normalise(model_of("k=gain | f=polynomial(degree=1)", {gain, 0.5, 1.0}));
    EXPECT_EQ(once.parameters[0], 1.0);
    EXPECT_EQ(normalise(once).parameters, once.parameters);
  }
}

TEST(NormaliseOnceTest, StandardDeviationsOfOtherNumbersGo) {
  Model model = testing::wiener();
  model.standard_deviations = Eigen::VectorXd::Ones(model.parameters.size());
  EXPECT_EQ(normalise(model).standard_deviations.size(), model.parameters.size());
  model.parameters[0] = 1.5;
  EXPECT_EQ(normalise(model).standard_deviations.size(), 0);
}

}  // namespace
}  // namespace blockid
