// fit(): what it hands back belongs together.
#include "estimators/systems.hpp"

#include <blockid/estimators/fit.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>

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

}  // namespace
}  // namespace blockid
