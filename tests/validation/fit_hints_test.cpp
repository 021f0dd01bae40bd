// Signs of too many parameters or too few.
#include "support/signals.hpp"

#include <blockid/blocks/text.hpp>
#include <blockid/validation/fit_hints.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <complex>
#include <numbers>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(CancellingPairs, ChangeIsTheLargestOverAllFrequencies) {
  const FilterRoots roots{"G", {{0.61, 0.30}, {0.61, -0.30}, {0.2, 0.0}}, {{0.6, 0.3}, {0.6, -0.3}, {-0.5, 0.0}}};
  const std::vector<CancellingPair> pairs = cancelling_pairs(roots);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].pole, std::complex<double>(0.6, 0.3));
  EXPECT_EQ(pairs[0].zero, std::complex<double>(0.61, 0.3));
  double largest = 0.0;
  for (int k = 0; k < 100000; ++k) {
    const std::complex<double> delay = std::polar(1.0, -2.0 * std::numbers::pi * k / 1e5);
    largest = std::max(largest, std::abs((1.0 - pairs[0].zero * delay) / (1.0 - pairs[0].pole * delay) - 1.0));
  }
  // The grid misses the peak by (2 pi 1e-5 / 0.33)^2 of it at most.
  EXPECT_NEAR(pairs[0].change, largest, 1e-8);
}

TEST(CancellingPairs, EachRootIsInOnePair) {
  const FilterRoots roots{"G", {{0.9, 0.0}, {0.901, 0.0}}, {{0.9005, 0.0}}};
  EXPECT_EQ(cancelling_pairs(roots).size(), 1U);
  EXPECT_THAT(cancelling_pairs({"G", {{1.5, 0.0}}, {{1.5, 0.0}}}), IsEmpty()) << "an unstable pole does not cancel";
}

/// Residual tests of a least-squares fit of P taps to n samples, and of the result on as many others.
struct Pair {
  ResidualTests training;
  ResidualTests test;
};

Pair fit_and_test(std::uint64_t seed, Index n, Index taps, double test_noise) {
  testing::Noise noise(seed);
  const auto record_of = [&](double deviation) {
    ResidualRecord record;
    record.u = noise.white(n);
    record.fitted_here = MatrixXd::Zero(n, taps);
    for (Index k = 0; k < taps; ++k) record.fitted_here.col(k).tail(n - k) = record.u.head(n - k);
    record.residual = record.u + noise.white(n, deviation);
    return record;
  };
  ResidualRecord training = record_of(1.0);
  const VectorXd theta = training.fitted_here.colPivHouseholderQr().solve(training.residual);
  ResidualRecord test = record_of(test_noise);
  for (ResidualRecord* record : {&training, &test}) {
    record->yhat = record->fitted_here * theta;
    record->residual -= record->yhat;
  }
  test.fitted_here.resize(n, 0);
  return {residual_tests({&training, 1}), residual_tests({&test, 1})};
}

TEST(ErrorComparison, ExpectsWhatTheParametersExplain) {
  // 40 parameters on 200 samples: sqrt(1.2 / 0.8) = 1.22. Mean of 50 records: deviation of each 0.09.
  double ratio = 0.0;
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Pair pair = fit_and_test(seed, 200, 40, 1.0);
    const ErrorComparison errors = compare_errors(pair.training, pair.test);
    EXPECT_NEAR(errors.expected, std::sqrt(1.2 / 0.8), 1e-12);
    ratio += errors.ratio / 50.0;
    alarms += errors.p_value < 0.01 ? 1 : 0;
  }
  // 1.25: an inverse Wishart matrix makes parameter errors larger by 200 / (200 - 41).
  EXPECT_NEAR(ratio, 1.25, 4 * 0.09 / std::sqrt(50.0));
  EXPECT_LE(alarms, 4);
}

TEST(OverFitHints, TestErrorFarAboveTheTrainingError) {
  const Pair pair = fit_and_test(1, 500, 3, 1.5);
  OverFitEvidence evidence{.model = make_model(parse("G=gain()")), .filters = {}, .undetermined = {}};
  evidence.training = &pair.training;
  evidence.test = &pair.test;
  EXPECT_THAT(over_fit_hints(evidence), Contains(HasSubstr("times the training error")));
  const Pair alike = fit_and_test(1, 500, 3, 1.0);
  evidence.test = &alike.test;
  EXPECT_THAT(over_fit_hints(evidence), IsEmpty());
}

TEST(OverFitHints, ParametersDirectionsAndRoots) {
  OverFitEvidence evidence{
      .model = make_model(parse("G=rational(nb=1,na=1)")), .filters = {}, .undetermined = {"f.c2"}};
  evidence.model.parameters << 1.0, 0.02, -0.9;
  evidence.model.standard_deviations = (VectorXd(3) << 0.0, 0.05, 0.01).finished();
  evidence.filters = {{"G", {{0.9001, 0.0}}, {{0.9, 0.0}}}};
  const std::vector<std::string> hints = over_fit_hints(evidence);
  EXPECT_THAT(hints, Contains(HasSubstr("in doubt are f.c2")));
  EXPECT_THAT(hints, Contains(HasSubstr("standard deviation above the value: G.b1")));
  EXPECT_THAT(hints, Contains(HasSubstr("G: the zero 0.9001 and the pole 0.9 nearly cancel; without them the response "
                                        "changes by at most 0.1 %")));
}

TEST(UnderFitHints, OneForEachFailedTest) {
  ResidualTests tests;
  tests.tests.resize(2);
  tests.tests[0].kind = ResidualTestKind::input;
  tests.tests[0].passed = false;
  tests.tests[1].kind = ResidualTestKind::squared_input;
  const std::vector<std::string> hints = under_fit_hints(tests);
  ASSERT_EQ(hints.size(), 1U);
  EXPECT_THAT(hints[0], HasSubstr("input: the residual follows the input linearly"));
}

}  // namespace
}  // namespace blockid
