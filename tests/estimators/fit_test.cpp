// fit(): what it hands back belongs together.
#include "estimators/systems.hpp"

#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/estimators/candidate.hpp>
#include <blockid/estimators/fit.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace blockid {
namespace {

constexpr double kNoise = 0.01;

// The wiener() system run from the given state.
Record record_from(const Eigen::VectorXd& state, Index samples, std::uint64_t seed) {
  Model model = testing::wiener();
  model.initial_state = state;
  return testing::simulated_record(model, samples, kNoise, seed);
}

TEST(Fit, KnotsDoNotFollowStatesThatTheWarmUpHides) {
  // The start's state drives the filter's output to 50; 60 samples later 0.63^60 = 1e-12 of that is left.
  constexpr Index kWarmup = 60;
  Model start = make_model(parse("G=rational(nb=1,na=2) | f=spline(knots=8)"));
  start.parameters.head(4) = testing::wiener().parameters.head(4);
  const Record record = record_from(Eigen::Vector2d::Zero(), 2000, 3);
  start = adapt_structure(start, record.u);
  start.initial_state = Eigen::Vector2d(50.0, -30.0);
  FitOptions options;
  options.refit.prediction = {InitialState::estimated, kWarmup, 1};
  const FitResult result = fit(parse("G=rational(nb=1,na=2) | f=spline(knots=8)"), record, start_from(start), options);
  const auto* f = top_level_blocks(result.model)[1].block.target<Spline>();
  ASSERT_NE(f, nullptr);
  // The range of the true signal; a tenth for a filter that is known to a percent.
  const double largest = simulate_signals(testing::wiener(), record.u)[1].cwiseAbs().maxCoeff();
  ASSERT_LT(largest, 20.0);
  for (const double knot : f->knots()) EXPECT_LT(std::abs(knot), 1.1 * largest);
}

TEST(Fit, InitialStatesBelongToTheNormalisedModel) {
  DataSet data;
  data.records.push_back(record_from(Eigen::Vector2d(2.0, -1.0), 300, 1));
  data.records.push_back(record_from(Eigen::Vector2d(-1.0, 1.5), 300, 2));
  // Another gain of the filter: normalise() has something to do at the end.
  Model start = testing::wiener();
  start.parameters.head(2) *= 1.1;
  FitOptions options;
  options.refit.prediction.initial_state = InitialState::estimated;

  const FitResult result = fit(start.chain, data, start_from(start), options);

  ASSERT_EQ(result.model.parameters[0], 1.0);
  ASSERT_EQ(result.report.initial_states.size(), 2U);
  double sum = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    Model model = result.model;
    model.initial_state = result.report.initial_states[k];
    sum += (data.records[k].y - simulate(model, data.records[k].u)).squaredNorm();
  }
  const double rmse = std::sqrt(sum / 600.0);
  EXPECT_NEAR(rmse, result.report.rmse, 1e-9 * result.report.rmse);
  EXPECT_NEAR(rmse, kNoise, 0.1 * kNoise);
  ASSERT_TRUE(result.report.covariance.has_value());
  // s^2 = r'r / (600 - rank) is that of these residuals, too.
  EXPECT_NEAR(std::sqrt(result.report.covariance->noise_variance), rmse, 0.05 * rmse);
}

// A frozen gain is the gauge itself: it keeps its value to the last bit, and nothing is held beside it.
TEST(Fit, FrozenGainKeepsItsValueAndTakesThePlaceOfTheGauge) {
  const DataSet data(record_from(Eigen::Vector2d::Zero(), 2000, 3));
  Model start = testing::wiener();
  start.parameters.head(2) *= 1.1;
  FitOptions free_options;
  FitOptions frozen_options;
  const std::string gain = start.chain.parameter_names().front();
  frozen_options.refit.frozen = {gain};

  const FitResult free_fit = fit(start.chain, data, start_from(start), free_options);
  const FitResult frozen_fit = fit(start.chain, data, start_from(start), frozen_options);

  EXPECT_EQ(frozen_fit.model.parameters[0], start.parameters[0]);
  EXPECT_TRUE(frozen_fit.report.held.empty());
  EXPECT_EQ(frozen_fit.report.free_parameters, free_fit.report.free_parameters);
  // One minimum in two coordinates: both searches stop within their relative function tolerance.
  EXPECT_NEAR(frozen_fit.report.rmse, free_fit.report.rmse, 1e-6 * free_fit.report.rmse);
}

// The gain between the filters may run through the levels: held, or the covariance would have a direction without end.
TEST(Fit, SaturationBetweenFiltersIsWellConditioned) {
  const Model truth = testing::model_of("G1=rational(nb=1,na=2) | s=saturation | G2=rational(nb=0,na=1)",
                                        {1.0, 0.4, -1.2, 0.52, -1.5, 2.0, 0.7, -0.6});
  const DataSet data(testing::simulated_record(truth, 3000, kNoise, 4));
  Model start = truth;
  start.parameters *= 1.03;

  const FitResult result = fit(start.chain, data, start_from(start), {});

  EXPECT_EQ(result.report.status, FitStatus::converged);
  EXPECT_EQ(result.report.free_parameters, 7);
  EXPECT_EQ(result.model.parameters[0], 1.0);
  ASSERT_TRUE(result.report.covariance.has_value());
  // The truth is in normal form; four standard deviations of each number.
  for (Index k = 0; k < truth.parameters.size(); ++k) {
    EXPECT_LE(std::abs(result.model.parameters[k] - truth.parameters[k]),
              4.0 * result.report.covariance->standard_deviations[k])
        << truth.chain.parameter_names()[static_cast<std::size_t>(k)];
  }
}

// A kink at 1.5, a fiftieth wide, in front of a filter; input even over [-2, 2].
Record kinked_record() {
  testing::Noise numbers(5);
  Record record;
  record.u = Eigen::VectorXd::NullaryExpr(3000, [&](Index) { return 4.0 * numbers.uniform() - 2.0; });
  const Eigen::VectorXd bent =
      record.u.unaryExpr([](double x) { return 0.02 * std::log1p(std::exp((x - 1.5) / 0.02)); });
  record.y = simulate(testing::model_of("G=rational(nb=0,na=1)", {1.0, -0.6}), bent) + numbers.white(3000, 1e-4);
  return record;
}

FitResult kinked_fit(const std::string& spline, int knot_rounds) {
  FitOptions options;
  options.knot_rounds = knot_rounds;
  options.refit.covariance = false;
  return fit(parse("f=" + spline + " | G=rational(nb=0,na=1)"), kinked_record(), no_initialiser(), options);
}

std::vector<double> knots_of(const FitResult& result) {
  return top_level_blocks(result.model).front().block.target<Spline>()->knots();
}

// The input of f stays what it is, and so would knots that follow it alone.
TEST(Fit, KnotsLeftOpenMoveToWhereTheCurveBends) {
  const FitResult still = kinked_fit("spline(knots=12)", 0);
  const FitResult moved = kinked_fit("spline(knots=12)", 3);
  const auto near_kink = [](const FitResult& result) {
    const std::vector<double> knots = knots_of(result);
    return std::count_if(knots.begin(), knots.end(), [](double k) { return std::abs(k - 1.5) < 0.25; });
  };
  EXPECT_GT(near_kink(moved), near_kink(still));
  // Around a kink the error falls as the power 3/2 of the interval's width: a fifth for an interval of a third.
  EXPECT_LT(moved.report.rmse, 0.25 * still.report.rmse);
}

TEST(Fit, PlacementsThatAreAskedForAreKept) {
  EXPECT_EQ(knots_of(kinked_fit("spline(knots=12,placement=uniform)", 0)),
            knots_of(kinked_fit("spline(knots=12,placement=uniform)", 3)));
}

}  // namespace
}  // namespace blockid
