#include <blockid/init/bla.hpp>

#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <vector>

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::model_of;
using testing::Noise;
using testing::simulated_record;

// A number further than this many standard deviations from the truth has a probability of 7e-6.
constexpr double kDeviations = 4.5;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(ArxTest, IsExactWithoutNoise) {
  // Least squares of rows of size one: rounding times the squared condition number, below 1e4.
  constexpr double kExact = 1e-9;
  const Model truth = model_of("G=rational(nb=2,na=3,nk=1)", {0.8, 0.4, -0.3, -1.5, 0.9, -0.2});
  const Record record = simulated_record(truth, 500, 0.0, 1);
  EXPECT_LT((arx(record, {2, 3, 1}).parameters - truth.parameters).norm(), kExact);
  // Two records, and missing samples of which nothing may leak in.
  Record gap = simulated_record(truth, 300, 0.0, 2);
  gap.weights = Eigen::VectorXd::Ones(300);
  for (const Index t : {50, 51, 120, 299}) {
    gap.weights[t] = 0.0;
    gap.y[t] = kNan;
  }
  EXPECT_LT((arx(std::vector<Record>{record, gap}, {2, 3, 1}).parameters - truth.parameters).norm(), kExact);
  EXPECT_LT((arx(gap, {2, 3, 1}).parameters - truth.parameters).norm(), kExact);
  EXPECT_LT((steiglitz_mcbride(record, {2, 3, 1}, {}, 5).parameters - truth.parameters).norm(), kExact);
}

TEST(ArxTest, FirIsPlainRegression) {
  const Model truth = model_of("G=rational(nb=3,na=0,nk=2)", {0.5, 1.0, -0.3, 0.2});
  EXPECT_LT((arx(simulated_record(truth, 200, 0.0, 3), {3, 0, 2}).parameters - truth.parameters).norm(), 1e-10);
}

double rmse_of(const Model& model, const Record& record) {
  return std::sqrt((record.y - simulate(model, record.u)).squaredNorm() / static_cast<double>(record.y.size()));
}

TEST(SteiglitzMcBrideTest, BeatsArxWhenTheNoiseIsAtTheOutput) {
  const Model truth = testing::linear();
  double arx_error = 0.0;
  double sm_error = 0.0;
  for (std::uint64_t seed = 10; seed < 15; ++seed) {
    const Record record = simulated_record(truth, 2000, 0.5, seed);
    arx_error += (arx(record, {2, 2}).parameters - truth.parameters).norm();
    const Model refined = steiglitz_mcbride(record, {2, 2}, {}, 20);
    sm_error += (refined.parameters - truth.parameters).norm();
    EXPECT_LT(rmse_of(refined, record), rmse_of(arx(record, {2, 2}), record));
  }
  EXPECT_LT(sm_error, 0.3 * arx_error);
}

TEST(SteiglitzMcBrideTest, PassesOverMissingSamples) {
  const Model truth = testing::linear();
  Record record = simulated_record(truth, 1000, 0.1, 16);
  record.weights = Eigen::VectorXd::Ones(1000);
  for (Index t = 300; t < 310; ++t) {
    record.weights[t] = 0.0;
    record.y[t] = kNan;
  }
  EXPECT_LT((steiglitz_mcbride(record, {2, 2}, {}, 20).parameters - truth.parameters).norm(), 0.1);
}

void expect_truth(const BestLinearApproximation& bla, const Eigen::VectorXd& truth) {
  ASSERT_TRUE(bla.refit.covariance.has_value());
  for (Index k = 0; k < truth.size(); ++k) {
    const double deviation = bla.refit.covariance->standard_deviations[k];
    EXPECT_GT(deviation, 0.0);
    EXPECT_LT(std::abs(bla.model.parameters[k] - truth[k]), kDeviations * deviation) << "parameter " << k;
  }
}

BlaOptions with_covariance() {
  BlaOptions options;
  options.covariance = true;
  return options;
}

TEST(BestLinearApproximationTest, RecoversALinearSystem) {
  constexpr double kNoise = 0.3;
  const Model truth = testing::linear();
  const Record record = simulated_record(truth, 4000, kNoise, 20);
  const BestLinearApproximation bla = best_linear_approximation(record, {2, 2}, with_covariance());
  EXPECT_EQ(bla.refit.status, FitStatus::converged);
  EXPECT_NEAR(bla.rmse, kNoise, 3.0 * kNoise / std::sqrt(8000.0));
  expect_truth(bla, truth.parameters);
  EXPECT_LT(bla.refit.covariance->standard_deviations.maxCoeff(), 0.05);
  ASSERT_EQ(bla.poles.size(), 1u);
  EXPECT_LT(std::abs(bla.poles[0].value - std::complex<double>(0.65, std::sqrt(0.6 - 0.4225))), 0.05);
  EXPECT_EQ(roots(bla.zeros).size(), 2u);
  EXPECT_TRUE(bla.how == "ARX" || bla.how == "Steiglitz-McBride") << bla.how;
}

TEST(BestLinearApproximationTest, TakesMeansOffAndPassesOverMissingSamples) {
  const Model truth = testing::linear();
  Record record = simulated_record(truth, 4000, 0.1, 21);
  // G(1) = 0.9 / 0.3 = 3: a constant 5 at the input is 15 at the output; 100 is an offset of the sensor.
  record.u.array() += 5.0;
  record.y.array() += 15.0 + 100.0;
  record.weights = Eigen::VectorXd::Ones(4000);
  for (Index t = 1000; t < 1100; ++t) {
    record.weights[t] = 0.0;
    record.y[t] = kNan;
  }
  record.input_name = "valve";
  const BestLinearApproximation bla = best_linear_approximation(record, {2, 2}, with_covariance());
  EXPECT_NEAR(bla.input_mean, record.u.mean(), 1e-12);
  EXPECT_NEAR(bla.output_mean, 115.0, 0.5);
  expect_truth(bla, truth.parameters);
  EXPECT_EQ(bla.model.input_name, "valve");
}

TEST(BestLinearApproximationTest, OfAStaticNonlinearityIsBussgangsGain) {
  // f(u) = u + 0.3 u^3, u ~ N(0, 1): E f'(u) = 1.9. What is left, 0.3 (u^3 - 3 u), is not independent of u:
  // N var(b0) = E (residual u)^2 = 0.09 E (u^4 - 3 u^2)^2 = 0.09 (105 - 6 * 15 + 9 * 3) = 3.78.
  constexpr Index kSamples = 20000;
  Record record;
  record.u = Noise(22).white(kSamples);
  record.y = record.u.array() + 0.3 * record.u.array().cube();
  const BestLinearApproximation bla = best_linear_approximation(record, {0, 0});
  EXPECT_NEAR(bla.model.parameters[0], 1.9, kDeviations * std::sqrt(3.78 / kSamples));
}

TEST(BestLinearApproximationTest, OfAWienerHammersteinSystemIsTheProductOfItsFilters) {
  // v = G1 u is Gaussian, so that BLA = E f'(v) G1 G2. f = v + 0.1 v^3; var v from the impulse response.
  const Model g1 = model_of("G=rational(nb=0,na=1)", {1.0, -0.6});
  const Model g2 = model_of("G=rational(nb=1,na=1)", {1.0, 0.4, 0.5});
  Record record;
  record.u = Noise(23).white(100000);
  const Eigen::VectorXd v = simulate(g1, record.u);
  record.y = simulate(g2, v.array() + 0.1 * v.array().cube());
  const double gain = 1.0 + 0.3 / (1.0 - 0.36);
  const BestLinearApproximation bla = best_linear_approximation(record, {1, 2});
  const Eigen::Vector4d expected(gain, 0.4 * gain, -0.1, -0.3);
  // 1e5 samples with a distortion of a fifth of the signal: deviations of 2e-3, the gain's five times as much.
  EXPECT_LT((bla.model.parameters - expected).cwiseAbs().maxCoeff(), 0.03);
}

TEST(BestLinearApproximationTest, MistakesAreNamed) {
  const Record record = simulated_record(testing::linear(), 100, 0.1, 24);
  EXPECT_THAT(BLOCKID_MESSAGE(best_linear_approximation(record, {-1, 2})), HasSubstr("nb=-1"));
  EXPECT_THAT(BLOCKID_MESSAGE(arx(record, {1, 1, -2})), HasSubstr("nk=-2"));
  Record constant = record;
  constant.u.setConstant(2.0);
  EXPECT_THAT(BLOCKID_MESSAGE(best_linear_approximation(constant, {2, 2})), HasSubstr("2"));
  EXPECT_THAT(BLOCKID_MESSAGE(best_linear_approximation(slice(record, 0, 4), {2, 2})),
              AllOf(HasSubstr("4"), HasSubstr("5")));
}

TEST(BestLinearApproximationTest, CanBeCancelled) {
  const Record record = simulated_record(testing::linear(), 1000, 0.1, 25);
  BlaOptions options;
  options.progress = [](const Progress& p) {
    EXPECT_THAT(p.stage, HasSubstr("best linear approximation"));
    return false;
  };
  const BestLinearApproximation bla = best_linear_approximation(record, {2, 2}, options);
  EXPECT_EQ(bla.refit.status, FitStatus::cancelled);
  EXPECT_TRUE(std::isfinite(bla.rmse));
}

TEST(OrderTableTest, BayesFindsTheOrder) {
  // Degrees 2/2 and a delay of 1: the table's smallest model that holds the truth.
  const Model truth = model_of("G=rational(nb=2,na=2,nk=1)", {0.8, 0.4, -0.3, -1.3, 0.6});
  const Record train = simulated_record(truth, 1500, 0.2, 26);
  const Record test = simulated_record(truth, 1000, 0.2, 27);
  const std::vector<BlaScore> table = bla_order_table(train, test, 4, 2);
  ASSERT_EQ(table.size(), 12u);
  const auto best =
      std::min_element(table.begin(), table.end(), [](const BlaScore& a, const BlaScore& b) { return a.bic < b.bic; });
  EXPECT_EQ(best->orders.na, 2);
  EXPECT_EQ(best->orders.nb, 2);
  EXPECT_EQ(best->orders.nk, 1);
  EXPECT_NEAR(best->validation_rmse, 0.2, 0.02);
  const double n = 1500.0;
  for (const BlaScore& score : table) {
    const double p = static_cast<double>(score.orders.nb + score.orders.na + 1);
    EXPECT_NEAR(score.aic, n * std::log(score.rmse * score.rmse) + 2.0 * p, 1e-6);
    EXPECT_NEAR(score.bic, n * std::log(score.rmse * score.rmse) + p * std::log(n), 1e-6);
  }
  const std::vector<BlaScore> parallel = bla_order_table(train, {}, 4, 2, {}, 2);
  for (std::size_t k = 0; k < table.size(); ++k) {
    EXPECT_EQ(parallel[k].rmse, table[k].rmse);
    EXPECT_TRUE(std::isnan(parallel[k].validation_rmse));
  }
  EXPECT_THAT(BLOCKID_MESSAGE(bla_order_table(train, test, 0, 0)), HasSubstr("max_order"));
}

TEST(OrderTableTest, CountsTheSamplesBehindTheWarmup) {
  BlaOptions options;
  options.prediction.warmup = 200;
  const Record record = simulated_record(testing::linear(), 500, 0.2, 28);
  const BlaScore score = bla_order_table(record, {}, 1, 0, options).front();
  EXPECT_NEAR(score.bic, 300.0 * std::log(score.rmse * score.rmse) + 3.0 * std::log(300.0), 1e-6);
}

TEST(OrderTableTest, EstimatesTheStateOfValidationRecordsWhereThoseOfTheTrainingRecordsAre) {
  // Both records begin in mid-run: at rest, the model would miss the transient, far larger than the noise of 0.1.
  constexpr double kNoise = 0.1;
  const Model truth = model_of("G=rational(nb=0,na=1)", {1.0, -0.9});
  const Record whole = simulated_record(truth, 1400, kNoise, 29);
  BlaOptions options;
  options.prediction.initial_state = InitialState::estimated;
  const DataSet validation = std::vector<Record>{slice(whole, 1100, 1200), slice(whole, 1250, 1400)};
  const BlaScore score = bla_order_table(slice(whole, 100, 1100), validation, 1, 0, options).front();
  EXPECT_NEAR(score.validation_rmse, kNoise, 0.2 * kNoise);
  options.prediction.initial_state = InitialState::zero;
  EXPECT_GT(bla_order_table(slice(whole, 100, 1100), validation, 1, 0, options).front().validation_rmse, 3.0 * kNoise);
}

}  // namespace
}  // namespace blockid
