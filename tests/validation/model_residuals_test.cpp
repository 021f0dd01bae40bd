// Residual tests of fitted block models.
#include "support/signals.hpp"

#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/validation/model_residuals.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace blockid {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Kind = ResidualTestKind;

constexpr const char* kHammerstein = "f=polynomial(degree=3,range=[-5,5]) | G=rational(nb=1,na=1)";

/// x = u + 0.3 u^2 - 0.1 u^3, y_t = 0.8 y_{t-1} + x_t + 0.5 x_{t-1} + noise, from rest.
Record measured(std::uint64_t seed, Index n, double deviation) {
  testing::Noise noise(seed);
  Record record;
  record.u = noise.coloured(n, 0.5, 1.0);
  const VectorXd x = record.u.array() + 0.3 * record.u.array().square() - 0.1 * record.u.array().cube();
  record.y.resize(n);
  double state = 0.0;
  for (Index t = 0; t < n; ++t) record.y[t] = state = 0.8 * state + x[t] + (t > 0 ? 0.5 * x[t - 1] : 0.0);
  record.y += noise.coloured(n, 0.6, deviation);
  return record;
}

Model fitted(const char* chain, const DataSet& data) {
  const Model start = adapt_structure(make_model(parse(chain)), data.records.front().u);
  return refit(start, data).model;
}

TEST(ModelResiduals, SensitivitiesAreDerivatives) {
  const DataSet data(measured(1, 200, 0.1));
  Model model = fitted(kHammerstein, data);
  const PredictionOptions prediction{.initial_state = InitialState::zero, .warmup = 20, .run_in_periods = 1};
  const std::vector<Index> held = {0};
  const ResidualRecord record =
      training_residuals(model, data, prediction, {.held = held, .initial_states = {}}).front();
  ASSERT_EQ(record.fitted_here.cols(), model.parameters.size() - 1);
  EXPECT_EQ(record.weights.head(20).norm(), 0.0);
  for (Index k = 1; k < model.parameters.size(); ++k) {
    const double step = 1e-6;
    Model moved = model;
    moved.parameters[k] += step;
    const VectorXd up = simulate(moved, data.records.front().u);
    moved.parameters[k] -= 2.0 * step;
    const VectorXd difference = (up - simulate(moved, data.records.front().u)) / (2.0 * step);
    // Central differences: third derivative times step^2, and rounding 1e-16 / step, of numbers up to a hundred.
    const double scale = std::max(1.0, difference.cwiseAbs().maxCoeff());
    EXPECT_LT((record.fitted_here.col(k - 1) - difference).tail(180).cwiseAbs().maxCoeff(), 1e-7 * scale) << k;
  }
  EXPECT_LT((record.residual - (data.records.front().y - record.yhat)).tail(180).norm(), 1e-12);
}

TEST(ModelResiduals, RightModelPassesOnTrainingAndTestData) {
  const DataSet training(measured(2, 2000, 0.3));
  const DataSet test(measured(3, 2000, 0.3));
  const Model model = fitted(kHammerstein, training);
  const ResidualTests on_training = residual_tests(training_residuals(model, training));
  EXPECT_TRUE(on_training.model_passed());
  EXPECT_FALSE(on_training.find(Kind::whiteness)->passed);
  EXPECT_LT(on_training.distance_from_minimum, 0.01);
  EXPECT_EQ(on_training.rank, 6);  // seven parameters, one gain between the blocks is a gauge

  ResidualTestOptions options;
  CovarianceOptions settings;
  settings.robust = true;
  settings.batch = 20;
  options.covariance = covariance(model, training, settings).parameters;
  const ResidualTests on_test = residual_tests(test_residuals(model, test), options);
  EXPECT_TRUE(on_test.model_passed());
  EXPECT_EQ(on_test.rank, 0);
  EXPECT_NEAR(on_test.deviation, 0.3, 0.03);
}

TEST(ModelResiduals, LinearModelFailsWhereItIsNotLinear) {
  const DataSet training(measured(4, 2000, 0.3));
  const ResidualTests tests = residual_tests(training_residuals(fitted("G=rational(nb=2,na=2)", training), training));
  EXPECT_FALSE(tests.find(Kind::squared_input)->passed);
  EXPECT_FALSE(tests.find(Kind::squared_output)->passed);
  EXPECT_FALSE(tests.model_passed());
}

TEST(ModelResiduals, ModelOfTooLowOrderFailsTheInputTest) {
  testing::Noise noise(5);
  Record record;
  record.u = noise.white(1500);
  record.y = simulate(
      [] {
        Model second = make_model(parse("G=rational(nb=1,na=2)"));
        second.parameters << 1.0, 0.5, -1.2, 0.7;
        return second;
      }(),
      record.u);
  record.y += noise.white(1500, 0.5);
  const DataSet data(record);
  EXPECT_FALSE(
      residual_tests(training_residuals(fitted("G=rational(nb=1,na=1)", data), data)).find(Kind::input)->passed);
  EXPECT_TRUE(residual_tests(training_residuals(fitted("G=rational(nb=1,na=2)", data), data)).model_passed());
}

TEST(ModelResiduals, EstimatedInitialStatesAreUnknownsOfTheirRecord) {
  const Record whole = measured(6, 1300, 0.3);
  const DataSet data(slice(whole, 300, 1300));
  const PredictionOptions prediction{.initial_state = InitialState::estimated, .warmup = 0, .run_in_periods = 1};
  RefitOptions options;
  options.prediction = prediction;
  const RefitReport report =
      refit(adapt_structure(make_model(parse(kHammerstein)), data.records.front().u), data, options);
  const ParameterKnowledge knowledge{.held = {}, .initial_states = report.initial_states};
  const std::vector<ResidualRecord> here = training_residuals(report.model, data, prediction, knowledge);
  EXPECT_EQ(here.front().fitted_here.cols(), 7 + report.model.chain.state_count());
  EXPECT_LT(residual_tests(here).distance_from_minimum, 0.01);
  const std::vector<ResidualRecord> there = test_residuals(report.model, data, prediction, knowledge);
  EXPECT_EQ(there.front().fitted_here.cols(), report.model.chain.state_count());
  EXPECT_EQ(there.front().fitted_elsewhere.cols(), 7);
  EXPECT_THAT([&] { static_cast<void>(training_residuals(report.model, data, prediction)); },
              ThrowsMessage<Error>(HasSubstr("an initial state for each of 1 records, got 0")));
}

TEST(ModelResiduals, UnstablePredictionIsRefused) {
  Model model = make_model(parse("G=rational(nb=0,na=1)"));
  model.parameters << 1.0, -3.0;
  EXPECT_THAT([&] { static_cast<void>(training_residuals(model, DataSet(measured(7, 2000, 0.1)))); },
              ThrowsMessage<Error>(HasSubstr("the prediction of the model is not finite")));
}

}  // namespace
}  // namespace blockid
