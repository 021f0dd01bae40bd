// fit(): what it hands back belongs together.
#include "estimators/systems.hpp"

#include <blockid/estimators/fit.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <string>

namespace blockid {
namespace {

constexpr double kNoise = 0.01;

// The wiener() system run from the given state.
Record record_from(const Eigen::VectorXd& state, Index samples, std::uint64_t seed) {
  Model model = testing::wiener();
  model.initial_state = state;
  return testing::simulated_record(model, samples, kNoise, seed);
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

}  // namespace
}  // namespace blockid
