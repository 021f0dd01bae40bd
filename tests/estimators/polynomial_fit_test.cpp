// Prediction-error fits against other ways to the same minimum, and predictions against brute force.
#include <blockid/estimators/polynomial_fit.hpp>

#include "data/message.hpp"
#include "estimators/polynomial_systems.hpp"
#include "estimators/systems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace blockid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

constexpr PredictionOptions kRest = {InitialState::zero, 0, 1};
// A search that ends at a relative decrease of the cost of 1e-10 is sqrt(2 N 1e-10) standard deviations from the
// minimum: 6e-4 for N = 2000, with some room for the last step not to be Newton's.
constexpr double kSearch = 2e-3;

TEST(PolynomialFitTest, ArxIsDenseLeastSquares) {
  const PolynomialModel truth = testing::arx_system();
  const Record record = testing::simulated(truth, 500, 21, 100).record;
  const Index first = 2;
  MatrixXd regressors(500 - first, 4);
  for (Index t = first; t < 500; ++t) {
    regressors.row(t - first) << -record.y[t - 1], -record.y[t - 2], record.u[t - 1], record.u[t - 2];
  }
  const VectorXd target = record.y.tail(500 - first);
  const VectorXd expected = regressors.colPivHouseholderQr().solve(target);
  PolynomialModel start = truth;
  start.theta.setZero();
  const PolynomialFit fit = refit(start, record);
  EXPECT_EQ(fit.status, FitStatus::converged);
  for (Index k = 0; k < 4; ++k) {
    EXPECT_NEAR(fit.model.theta[k], expected[k], kSearch * fit.covariance->standard_deviations[k]);
  }
  // At a minimum the sum of squares changes by the square of that.
  const double sum = (target - regressors * expected).squaredNorm();
  EXPECT_NEAR(fit.rmse, std::sqrt(sum / 500.0), kSearch * kSearch);
  // The two states explain the first two samples, whatever they are: 498 rows, 4 parameters.
  EXPECT_NEAR(fit.model.noise_variance, sum / 494.0, kSearch * kSearch);
  const MatrixXd covariance = sum / 494.0 * (regressors.transpose() * regressors).inverse();
  EXPECT_LT((fit.covariance->parameters - covariance).norm(), kSearch * covariance.norm());
}

TEST(PolynomialFitTest, OutputErrorIsTheRefitOfTheChain) {
  const PolynomialModel truth = testing::output_error_system();
  Record record = testing::simulated(truth, 2000, 22).record;
  record.weights = VectorXd::Ones(2000);
  record.weights[500] = 0.0;
  record.weights.segment(900, 100).setConstant(0.5);
  record.y[500] = std::numeric_limits<double>::quiet_NaN();
  Model chain = make_model(parse("G=rational(nb=1,na=2,nk=2)"));
  chain.parameters = truth.theta;
  const RefitReport expected = refit(chain, record);
  const PolynomialFit fit = refit(truth, record, {.prediction = kRest});
  EXPECT_NEAR(fit.rmse, expected.rmse, 1e-9 * expected.rmse);
  EXPECT_EQ(fit.counted_samples, 1999);
  for (Index k = 0; k < 4; ++k) {
    const double deviation = expected.covariance->standard_deviations[k];
    EXPECT_NEAR(fit.model.theta[k], expected.model.parameters[k], kSearch * deviation);
    // Deviations of two points so near to each other differ by as little.
    EXPECT_NEAR(fit.covariance->standard_deviations[k], deviation, kSearch * deviation);
  }
}

TEST(PolynomialFitTest, FormsOfTheResidualsAgree) {
  const PolynomialModel truth = testing::box_jenkins_system();
  const Record record = testing::simulated(truth, 1500, 23, 100).record;
  const PolynomialFit full = refit(truth, record, {.residual_form = ResidualForm::full});
  for (const ResidualForm form : {ResidualForm::compressed, ResidualForm::triangle}) {
    const PolynomialFit other = refit(truth, record, {.residual_form = form});
    EXPECT_EQ(other.status, FitStatus::converged);
    EXPECT_EQ(other.iterations, full.iterations);
    EXPECT_LT((other.model.theta - full.model.theta).norm(), 1e-7);
  }
}

TEST(PolynomialFitTest, SeveralRecordsKeepTheirOwnPast) {
  const PolynomialModel truth = testing::box_jenkins_system();
  std::vector<Record> records;
  for (std::uint64_t k = 0; k < 4; ++k) records.push_back(testing::simulated(truth, 400, 30 + k, 200).record);
  const PolynomialFit fit = refit(truth, records);
  EXPECT_EQ(fit.status, FitStatus::converged);
  ASSERT_EQ(fit.initial_states.size(), 4U);
  EXPECT_EQ(fit.initial_states.front().size(), 6);
  EXPECT_EQ(fit.unknowns, 9 + 4 * 6);
  // Outside 4.5 deviations lies 7e-6 of a normal distribution.
  for (Index k = 0; k < 9; ++k) {
    EXPECT_NEAR(fit.model.theta[k], truth.theta[k], 4.5 * fit.covariance->standard_deviations[k]);
  }
}

TEST(PolynomialFitTest, CriteriaAreTheirDefinitions) {
  const PolynomialModel truth = testing::armax_system();
  const PolynomialFit fit = refit(truth, testing::simulated(truth, 800, 24).record, {.prediction = kRest});
  const double v = fit.rmse * fit.rmse;
  EXPECT_EQ(fit.unknowns, 6);
  EXPECT_NEAR(fit.final_prediction_error, v * (1.0 + 6.0 / 800.0) / (1.0 - 6.0 / 800.0), 1e-12);
  EXPECT_NEAR(fit.aic, 800.0 * std::log(v) + 12.0, 1e-9);
  EXPECT_NEAR(fit.bic, 800.0 * std::log(v) + 6.0 * std::log(800.0), 1e-9);
  EXPECT_NEAR(fit.model.noise_variance, v * 800.0 / 794.0, 1e-12);
  // 794 degrees of freedom: the variance scatters by sqrt(2 / 794) = 5 %; five of them.
  EXPECT_NEAR(fit.model.noise_variance / truth.noise_variance, 1.0, 0.25);
}

TEST(PolynomialFitTest, FlagsWhatTheDataDoNotDetermine) {
  // C/D of white noise: one root cancels another, wherever both lie.
  const PolynomialModel start = testing::polynomial_model({.nb = 0, .nc = 1, .nd = 1}, {1.0, 0.3, 0.3}, 1.0);
  testing::Noise numbers(25);
  Record record;
  record.u = numbers.white(300);
  record.y = VectorXd::Zero(300);
  const PolynomialFit fit = refit(start, record, {.prediction = kRest, .max_iterations = 0});
  ASSERT_TRUE(fit.covariance.has_value());
  EXPECT_LT(fit.covariance->rank, 3);
}

TEST(PolynomialFitTest, CancelsAndReportsWhatItHas) {
  const PolynomialModel truth = testing::box_jenkins_system();
  PolynomialModel start = truth;
  start.theta *= 0.8;
  const Record record = testing::simulated(truth, 1000, 26).record;
  int calls = 0;
  PolynomialFitOptions options;
  options.progress = [&calls](const FitProgress&) { return ++calls < 3; };
  const PolynomialFit fit = refit(start, record, options);
  EXPECT_EQ(fit.status, FitStatus::cancelled);
  EXPECT_EQ(calls, 3);
  EXPECT_LE(fit.rmse, fit.initial_rmse);
}

TEST(PolynomialFitTest, AStartThatIsNotFiniteIsAResult) {
  PolynomialModel start = testing::box_jenkins_system();
  const Record record = testing::simulated(start, 3000, 27).record;
  start.theta[4] = 2.0;
  const PolynomialFit fit = refit(start, record, {.prediction = kRest});
  EXPECT_EQ(fit.status, FitStatus::diverged);
  EXPECT_THAT(fit.message, HasSubstr("finite"));
}

// y_t as the system would give it if e were zero after sample t - k.
VectorXd brute_force(const PolynomialModel& model, const testing::SimulatedPolynomial& data, Index k) {
  VectorXd yhat(data.e.size());
  for (Index t = 0; t < yhat.size(); ++t) {
    VectorXd known = data.e;
    for (Index s = std::max<Index>(t - k + 1, 0); s < known.size(); ++s) known[s] = 0.0;
    yhat[t] = testing::simulated(model, data.record.u, known).record.y[t];
  }
  return yhat;
}

TEST(PolynomialPredictionTest, IsTheOutputWithoutNoiseToCome) {
  for (PolynomialModel model : {testing::arx_system(), testing::armax_system(), testing::output_error_system(),
                                testing::box_jenkins_system()}) {
    model.u_mean = 0.4;
    model.y_mean = 2.0;
    const testing::SimulatedPolynomial data = testing::simulated(model, 60, 28);
    for (const Index k : {1, 2, 5, 200}) {
      EXPECT_LT((predict(model, data.record, k, kRest) - brute_force(model, data, k)).norm(), 1e-10) << k;
    }
    EXPECT_LT((predict(model, data.record, kSimulation, kRest) - simulate(model, data.record.u)).norm(), 1e-10);
    EXPECT_LT(
        (predict(model, data.record, 1, kRest) + prediction_errors(model, data.record, kRest) - data.record.y).norm(),
        1e-10);
  }
}

TEST(PolynomialPredictionTest, SimulationIsTheLimitOfLongHorizons) {
  for (const PolynomialModel& model : {testing::arx_system(), testing::armax_system(), testing::box_jenkins_system()}) {
    const Record record = testing::simulated(model, 80, 29, 100).record;
    // From the fitted past, not from rest.
    EXPECT_LT((predict(model, record, 80) - predict(model, record, kSimulation)).norm(), 1e-9);
    EXPECT_GT((predict(model, record, kSimulation) - simulate(model, record.u)).norm(), 1e-3);
  }
}

TEST(PolynomialPredictionTest, ErrorsGrowWithTheHorizonAsTheNoiseModelSays) {
  // var(y_t - yhat_{t|t-k}) = lambda (h_0^2 + ... + h_{k-1}^2); 50 000 samples correlated over about ten: 2 %.
  const PolynomialModel model = testing::box_jenkins_system();
  const Record record = testing::simulated(model, 50000, 30, 100).record;
  const VectorXd h = noise_impulse_response(model, 20);
  for (const Index k : {1, 3, 10}) {
    const double variance = (record.y - predict(model, record, k)).squaredNorm() / 50000.0;
    EXPECT_NEAR(variance / (model.noise_variance * h.head(k).squaredNorm()), 1.0, 0.06) << k;
  }
}

TEST(PolynomialPredictionTest, SaysWhereMissingSamplesReach) {
  const PolynomialModel model = testing::arx_system();
  Record record = testing::simulated(model, 40, 31).record;
  record.weights = VectorXd::Ones(40);
  record.weights[10] = 0.0;
  const VectorXd yhat = predict(model, record, 2, kRest);
  for (Index t = 0; t < 40; ++t) EXPECT_EQ(std::isnan(yhat[t]), t >= 10 && t <= 13) << t;
  EXPECT_TRUE(predict(testing::output_error_system(), record, 1, kRest).allFinite());
}

TEST(PolynomialPredictionTest, ErrorsSayWhatIsExpected) {
  const PolynomialModel model = testing::arx_system();
  const Record record = testing::simulated(model, 40, 32).record;
  EXPECT_THAT(BLOCKID_MESSAGE(predict(model, record, 0)), HasSubstr("at least one sample, got 0"));
  EXPECT_THAT(BLOCKID_MESSAGE(refit(model, slice(record, 0, 5))), HasSubstr("fewer than the 6 unknowns"));
  EXPECT_THAT(BLOCKID_MESSAGE(refit(model, record, {.max_iterations = -1})), HasSubstr("max_iterations"));
  PolynomialModel wrong = model;
  wrong.theta.conservativeResize(2);
  EXPECT_THAT(BLOCKID_MESSAGE(refit(wrong, record)), HasSubstr("expected 4 parameters, got 2"));
  EXPECT_THAT(BLOCKID_MESSAGE(predict(wrong, record, 1)), HasSubstr("expected 4 parameters"));
  EXPECT_THAT(BLOCKID_MESSAGE(prediction_errors(wrong, record)), HasSubstr("expected 4 parameters"));
}

}  // namespace
}  // namespace blockid
