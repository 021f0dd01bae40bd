// From data alone to ARX, ARMAX, output-error and Box-Jenkins models.
#include <blockid/init/polynomial_starts.hpp>

#include "data/message.hpp"
#include "estimators/polynomial_systems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace blockid {
namespace {

using Eigen::VectorXd;
using ::testing::AllOf;
using ::testing::HasSubstr;

// A number further than this many standard deviations from the truth has a probability of 7e-6.
constexpr double kDeviations = 4.5;

void expect_truth(const PolynomialIdentification& found, const PolynomialModel& truth) {
  EXPECT_EQ(found.fit.status, FitStatus::converged);
  ASSERT_TRUE(found.fit.covariance.has_value());
  const std::vector<std::string> names = parameter_names(truth.orders);
  for (Index k = 0; k < truth.theta.size(); ++k) {
    const double deviation = found.fit.covariance->standard_deviations[k];
    EXPECT_NEAR(found.fit.model.theta[k], truth.theta[k], kDeviations * deviation)
        << names[static_cast<std::size_t>(k)];
    EXPECT_LT(deviation, 0.2) << "nothing would be tested";
  }
  EXPECT_TRUE(is_stable(found.fit.model));
  EXPECT_TRUE(has_stationary_noise(found.fit.model));
  EXPECT_TRUE(has_stable_predictor(found.fit.model));
}

std::vector<PolynomialModel> named_systems() {
  return {testing::arx_system(), testing::armax_system(), testing::output_error_system(),
          testing::box_jenkins_system()};
}

TEST(PolynomialStartsTest, RecoversEveryStructureFromDataAlone) {
  for (const PolynomialModel& truth : named_systems()) {
    for (std::uint64_t seed = 40; seed < 43; ++seed) {
      SCOPED_TRACE(parameter_names(truth.orders).front() + ", seed " + std::to_string(seed));
      const Record record = testing::simulated(truth, 3000, seed, 100).record;
      expect_truth(identify_polynomial(record, truth.orders), truth);
    }
  }
}

TEST(PolynomialStartsTest, TakesOutMeansAndRecordsAndRest) {
  PolynomialModel truth = testing::box_jenkins_system();
  truth.u_mean = 5.0;
  truth.y_mean = -3.0;
  std::vector<Record> records;
  for (std::uint64_t seed = 50; seed < 53; ++seed) records.push_back(testing::simulated(truth, 1500, seed, 100).record);
  const PolynomialIdentification found = identify_polynomial(records, truth.orders);
  expect_truth(found, truth);
  // Mean of 4500 inputs of deviation one.
  EXPECT_NEAR(found.fit.model.u_mean, 5.0, kDeviations / std::sqrt(4500.0));
  const PolynomialIdentification from_rest = identify_polynomial(
      testing::simulated(testing::box_jenkins_system(), 3000, 54).record, truth.orders, {.prediction = {}});
  expect_truth(from_rest, testing::box_jenkins_system());
}

TEST(PolynomialStartsTest, PassesOverMissingSamplesWhereItCan) {
  for (const PolynomialModel& truth :
       {testing::arx_system(), testing::output_error_system(),
        testing::polynomial_model({.nb = 1, .nd = 2, .nf = 2, .nk = 1}, {1.0, 0.5, -1.2, 0.5, -1.4, 0.7}, 0.25)}) {
    Record record = testing::simulated(truth, 3000, 60, 100).record;
    record.weights = VectorXd::Ones(3000);
    for (Index t = 100; t < 3000; t += 150) {
      record.weights.segment(t, 3).setZero();
      record.y.segment(t, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    expect_truth(identify_polynomial(record, truth.orders), truth);
  }
}

TEST(PolynomialStartsTest, FiniteResponsesAndMixedNoiseModels) {
  for (const PolynomialModel& truth :
       {testing::polynomial_model({.nb = 3, .nk = 1}, {0.5, 1.0, -0.3, 0.2}, 0.25),
        testing::polynomial_model({.nb = 1, .nc = 2}, {0.5, 1.0, -0.5, 0.3}, 0.25),
        testing::polynomial_model({.na = 1, .nb = 1, .nd = 1}, {-0.8, 0.5, 1.0, 0.6}, 0.25)}) {
    expect_truth(identify_polynomial(testing::simulated(truth, 3000, 70, 100).record, truth.orders), truth);
  }
}

TEST(PolynomialStartsTest, WhiteningHelpsWhereTheNoiseIsStrongAndColoured) {
  // Noise of 25 times the power of the undisturbed output, concentrated where the system amplifies least. Each trial
  // starts nearer to its own minimum from whitened data; what counts is that the start alone is better.
  PolynomialModel truth = testing::polynomial_model({.nb = 1, .nc = 1, .nd = 2, .nf = 2, .nk = 1},
                                                    {1.0, 0.5, 0.5, -1.9, 0.95, -1.4, 0.7}, 1.0);
  double plain = 0.0;
  double whitened = 0.0;
  for (std::uint64_t seed = 80; seed < 90; ++seed) {
    const Record record = testing::simulated(truth, 2000, seed, 200).record;
    const std::vector<PolynomialStart> starts = polynomial_starts(record, truth.orders, {});
    ASSERT_EQ(starts.size(), 2U);
    EXPECT_THAT(starts[1].how, HasSubstr("whitened"));
    plain += (starts[0].model.theta.tail(2) - truth.theta.tail(2)).norm();
    whitened += (starts[1].model.theta.tail(2) - truth.theta.tail(2)).norm();
  }
  EXPECT_LT(whitened, 0.5 * plain);
}

TEST(PolynomialStartsTest, StartsAreStable) {
  // A noise model with roots near the circle and few samples: least squares alone leaves the circle now and then.
  const PolynomialModel truth =
      testing::polynomial_model({.nb = 0, .nc = 2, .nd = 2}, {1.0, -1.9, 0.97, -1.8, 0.95}, 1.0);
  for (std::uint64_t seed = 100; seed < 130; ++seed) {
    const Record record = testing::simulated(truth, 100, seed).record;
    for (const PolynomialStart& start : polynomial_starts(record, truth.orders, {})) {
      EXPECT_TRUE(has_stable_predictor(start.model));
      EXPECT_TRUE(has_stationary_noise(start.model));
    }
  }
}

TEST(PolynomialStartsTest, TellsOfItsTrials) {
  const PolynomialModel truth = testing::box_jenkins_system();
  const PolynomialIdentification found = identify_polynomial(testing::simulated(truth, 1000, 91).record, truth.orders);
  ASSERT_GE(found.trials.size(), 2U);
  double best = std::numeric_limits<double>::infinity();
  for (const PolynomialTrial& trial : found.trials) {
    EXPECT_LE(trial.rmse, trial.start_rmse);
    best = std::min(best, trial.rmse);
  }
  EXPECT_EQ(found.fit.rmse, best);
  EXPECT_THAT(found.how, HasSubstr("Steiglitz-McBride"));
}

TEST(PolynomialStartsTest, CancellationEndsTheTrials) {
  const PolynomialModel truth = testing::box_jenkins_system();
  PolynomialFitOptions options;
  options.progress = [](const FitProgress&) { return false; };
  const PolynomialIdentification found =
      identify_polynomial(testing::simulated(truth, 1000, 92).record, truth.orders, options);
  EXPECT_EQ(found.fit.status, FitStatus::cancelled);
  EXPECT_EQ(found.trials.size(), 1U);
}

TEST(PolynomialStartsTest, ErrorsSayWhatIsExpected) {
  Record record = testing::simulated(testing::arx_system(), 100, 93).record;
  EXPECT_THAT(BLOCKID_MESSAGE(identify_polynomial(record, {.na = 1, .nf = 2})),
              AllOf(HasSubstr("na = 0 or nf = 0"), HasSubstr("nf=2")));
  EXPECT_THAT(BLOCKID_MESSAGE(identify_polynomial(record, {.nb = -2})), HasSubstr("nb=-2"));
  EXPECT_THAT(BLOCKID_MESSAGE(identify_polynomial(slice(record, 0, 3), {.nb = 5})), HasSubstr("fewer samples"));
  record.u.setConstant(2.0);
  EXPECT_THAT(BLOCKID_MESSAGE(identify_polynomial(record, {.na = 1})), HasSubstr("constant"));
}

}  // namespace
}  // namespace blockid
