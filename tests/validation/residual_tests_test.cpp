// Residual tests: how often they cry wolf, and whether they see what is missing.
#include "support/signals.hpp"

#include <blockid/data/error.hpp>
#include <blockid/validation/residual_tests.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <vector>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Kind = ResidualTestKind;

/// (n, taps) u_{t-k}, zero before the record.
MatrixXd delays(const VectorXd& u, Index taps) {
  MatrixXd x = MatrixXd::Zero(u.size(), taps);
  for (Index k = 0; k < taps; ++k) x.col(k).tail(u.size() - k) = u.head(u.size() - k);
  return x;
}

/// y fitted by x: the estimator with the shortest proof.
ResidualRecord fitted(const VectorXd& u, const VectorXd& y, const MatrixXd& x) {
  const VectorXd theta = x.colPivHouseholderQr().solve(y);
  ResidualRecord record;
  record.u = u;
  record.yhat = x * theta;
  record.residual = y - record.yhat;
  record.fitted_here = x;
  return record;
}

ResidualTests tested(const ResidualRecord& record, const ResidualTestOptions& options) {
  return residual_tests({&record, 1}, options);
}

/// y_t = sum b_k u_{t-k}
const VectorXd kTaps = (VectorXd(4) << 1.0, 0.7, -0.4, 0.2).finished();

/// False alarms of each kind in `runs` records.
std::map<Kind, int> alarms(int runs, const std::function<ResidualTests(std::uint64_t)>& run) {
  std::map<Kind, int> count;
  for (int k = 0; k < runs; ++k) {
    for (const ResidualTest& test : run(static_cast<std::uint64_t>(k) + 1).tests)
      count[test.kind] += test.passed ? 0 : 1;
  }
  return count;
}

constexpr double kLevel = 0.05;
constexpr int kRuns = 400;
/// 20 of 400 expected at 5 %, deviation sqrt(400 * 0.05 * 0.95) = 4.36; 3.3 deviations, one in a thousand for each of
/// the tests.
constexpr int kFewest = 6;
constexpr int kMost = 34;

void expect_size(const std::map<Kind, int>& count, const std::vector<Kind>& kinds) {
  for (const Kind kind : kinds) {
    const auto found = count.find(kind);
    ASSERT_NE(found, count.end()) << to_text(kind);
    EXPECT_GE(found->second, kFewest) << to_text(kind);
    EXPECT_LE(found->second, kMost) << to_text(kind);
  }
}

const std::vector<Kind> kOfTheModel = {Kind::input,          Kind::later_input,    Kind::squared_input,
                                       Kind::absolute_input, Kind::squared_output, Kind::cubed_output};

const ResidualTestOptions kShort{.covariance = {}, .lags = 10, .significance = kLevel, .noise_order = 10};

TEST(ResidualTestSize, ColouredInputAndColouredNoiseParametersFittedHere) {
  const auto count = alarms(kRuns, [](std::uint64_t seed) {
    testing::Noise noise(seed);
    const VectorXd u = noise.coloured(1500, 0.8, 1.0);
    const VectorXd y = delays(u, 4) * kTaps + noise.coloured(1500, 0.7, 0.5);
    return tested(fitted(u, y, delays(u, 4)), kShort);
  });
  expect_size(count, kOfTheModel);
  expect_size(count, {Kind::offset});
  EXPECT_EQ(count.at(Kind::whiteness), kRuns) << "a coloured residual is not white";
}

TEST(ResidualTestSize, WhitenessWithManyParameters) {
  // 25 parameters on 500 samples: without the correction each r_k is off by up to 25 / 500, a whole standard deviation.
  const auto count = alarms(kRuns, [](std::uint64_t seed) {
    testing::Noise noise(seed);
    const VectorXd u = noise.coloured(500, 0.8, 1.0);
    const MatrixXd x = delays(u, 25);
    return tested(fitted(u, x.leftCols(4) * kTaps + noise.white(500), x), kShort);
  });
  expect_size(count, {Kind::whiteness});
}

/// A record whose parameters come from a short one.
ResidualRecord from_elsewhere(std::uint64_t seed, MatrixXd& covariance) {
  testing::Noise noise(seed);
  const VectorXd u1 = noise.coloured(150, 0.8, 1.0);
  const MatrixXd x1 = delays(u1, 4);
  const VectorXd y1 = x1 * kTaps + noise.white(150);
  const VectorXd theta = x1.colPivHouseholderQr().solve(y1);
  const double variance = (y1 - x1 * theta).squaredNorm() / 146.0;
  covariance = variance * (x1.transpose() * x1).inverse();
  ResidualRecord record;
  record.u = noise.coloured(1500, 0.8, 1.0);
  record.fitted_elsewhere = delays(record.u, 4);
  record.yhat = record.fitted_elsewhere * theta;
  record.residual = record.fitted_elsewhere * kTaps + noise.white(1500) - record.yhat;
  return record;
}

TEST(ResidualTestSize, ParametersFittedElsewhere) {
  const auto count = alarms(kRuns, [](std::uint64_t seed) {
    ResidualTestOptions options = kShort;
    const ResidualRecord record = from_elsewhere(seed, options.covariance);
    return tested(record, options);
  });
  expect_size(count,
              {Kind::later_input, Kind::squared_input, Kind::absolute_input, Kind::squared_output, Kind::cubed_output});
  // The covariance itself has 146 degrees of freedom: statistics of the four directions that it rules are F rather than
  // chi-square, their variance larger by 1 + 4 / 146.
  expect_size(count, {Kind::input});
}

TEST(ResidualTestSize, ParameterErrorsThatAreNotToldLookLikeMissingDynamics) {
  const auto count = alarms(100, [](std::uint64_t seed) {
    MatrixXd covariance;
    ResidualRecord record = from_elsewhere(seed, covariance);
    record.fitted_elsewhere.resize(1500, 0);
    return tested(record, kShort);
  });
  // Ten times as many samples as the parameters came from: their errors are three times the noise in four directions.
  EXPECT_GT(count.at(Kind::input), 80);
}

TEST(ResidualTestSize, SeveralRecordsWithGapsAndWeights) {
  const auto count = alarms(kRuns, [](std::uint64_t seed) {
    testing::Noise noise(seed);
    std::vector<ResidualRecord> records;
    MatrixXd x(1400, 4);
    VectorXd y(1400);
    VectorXd w(1400);
    for (int k = 0; k < 2; ++k) {
      ResidualRecord record;
      record.u = noise.coloured(700, 0.8, 1.0);
      record.fitted_here = delays(record.u, 4);
      record.weights = VectorXd::NullaryExpr(700, [](Index t) { return t % 13 == 0 ? 0.0 : (t % 2 == 0 ? 2.0 : 1.0); });
      x.middleRows(700 * k, 700) = record.fitted_here;
      y.segment(700 * k, 700) = record.fitted_here * kTaps + noise.coloured(700, 0.7, 0.5);
      w.segment(700 * k, 700) = record.weights;
      records.push_back(record);
    }
    const VectorXd theta = (w.asDiagonal() * x).colPivHouseholderQr().solve(w.asDiagonal() * y);
    for (int k = 0; k < 2; ++k) {
      ResidualRecord& record = records[static_cast<std::size_t>(k)];
      record.yhat = record.fitted_here * theta;
      record.residual = y.segment(700 * k, 700) - record.yhat;
      for (Index t = 0; t < 700; t += 13) record.residual[t] = std::numeric_limits<double>::quiet_NaN();
    }
    ResidualTests tests = residual_tests(records, kShort);
    EXPECT_LT(tests.distance_from_minimum, 1e-9);
    EXPECT_EQ(tests.samples, 2 * (700 - 54));
    return tests;
  });
  expect_size(count, kOfTheModel);
}

/// How many of 20 records the test of `kind` rejects at 1 %.
struct Power {
  std::map<Kind, int> rejected;
  int operator[](Kind kind) const {
    const auto found = rejected.find(kind);
    return found == rejected.end() ? -1 : found->second;
  }
};

constexpr int kPowerRuns = 20;

Power power(const std::function<VectorXd(const VectorXd& u, testing::Noise& noise)>& system) {
  return {alarms(kPowerRuns, [&](std::uint64_t seed) {
    testing::Noise noise(seed);
    const VectorXd u = noise.coloured(2000, 0.5, 1.0);
    return tested(fitted(u, system(u, noise), delays(u, 4)), {});
  })};
}

/// At 1 %, three alarms or more of 20 have a probability of 1e-3 for each test.
constexpr int kByChance = 2;

TEST(ResidualTestPower, MissingDynamics) {
  const Power found = power([](const VectorXd& u, testing::Noise& noise) {
    const MatrixXd x = delays(u, 8);
    return VectorXd(x.leftCols(4) * kTaps + 0.2 * x.col(7) + noise.white(u.size(), 0.5));
  });
  EXPECT_EQ(found[Kind::input], kPowerRuns);
  EXPECT_LE(found[Kind::squared_input], kByChance);
  EXPECT_LE(found[Kind::later_input], kByChance);
}

TEST(ResidualTestPower, EvenNonlinearities) {
  const Power square = power([](const VectorXd& u, testing::Noise& noise) {
    return VectorXd(delays(u, 4) * kTaps + 0.1 * delays(u.cwiseAbs2(), 3).col(2) + noise.white(u.size(), 0.5));
  });
  EXPECT_EQ(square[Kind::squared_input], kPowerRuns);
  EXPECT_LE(square[Kind::input], kByChance);
  const Power magnitude = power([](const VectorXd& u, testing::Noise& noise) {
    return VectorXd(delays(u, 4) * kTaps + 0.2 * u.cwiseAbs() + noise.white(u.size(), 0.5));
  });
  EXPECT_EQ(magnitude[Kind::absolute_input], kPowerRuns);
  const Power behind = power([](const VectorXd& u, testing::Noise& noise) {
    const VectorXd x = delays(u, 4) * kTaps;
    return VectorXd(x + 0.1 * x.cwiseAbs2() + noise.white(u.size(), 0.5));
  });
  EXPECT_EQ(behind[Kind::squared_output], kPowerRuns);
}

TEST(ResidualTestPower, OddNonlinearity) {
  const Power found = power([](const VectorXd& u, testing::Noise& noise) {
    const VectorXd x = delays(u, 4) * kTaps;
    return VectorXd(2.0 * (0.5 * x).array().tanh().matrix() + noise.white(u.size(), 0.1));
  });
  EXPECT_EQ(found[Kind::cubed_output], kPowerRuns);
}

TEST(ResidualTestPower, FeedbackShowsAtLaterInputs) {
  const auto count = alarms(kPowerRuns, [](std::uint64_t seed) {
    testing::Noise noise(seed);
    const VectorXd r = noise.white(2000);
    const VectorXd v = noise.white(2000, 0.5);
    VectorXd u(2000);
    VectorXd y(2000);
    for (Index t = 0; t < 2000; ++t) {
      u[t] = r[t] - (t > 0 ? 0.5 * y[t - 1] : 0.0);
      y[t] = (t > 0 ? 0.8 * u[t - 1] : 0.0) + v[t];
    }
    return tested(fitted(u, y, delays(u, 3)), {});
  });
  EXPECT_EQ(count.at(Kind::later_input), kPowerRuns);
}

TEST(ResidualTestPower, OffsetIsSeenUnlessTheModelHasOne) {
  const Power found = power([](const VectorXd& u, testing::Noise& noise) {
    return VectorXd((delays(u, 4) * kTaps + noise.white(u.size(), 0.5)).array() + 0.1);
  });
  EXPECT_EQ(found[Kind::offset], kPowerRuns);
  testing::Noise noise(5);
  const VectorXd u = noise.white(500);
  MatrixXd x(500, 2);
  x << u, VectorXd::Ones(500);
  const ResidualTests tests = tested(fitted(u, noise.white(500), x), {});
  EXPECT_EQ(tests.find(Kind::offset), nullptr) << "the parameters own the mean";
}

TEST(ResidualTests, BandsAndCorrelationsOfWhiteSignalsAreThoseOfTheTextbook) {
  // Exact parameters, white residual and white input: 2.58 / sqrt(N), up to the ends of the record (lag / N), the
  // autoregression that Akaike's criterion takes (order p: sqrt(p / N)) and its variance.
  testing::Noise noise(6);
  ResidualRecord record;
  record.u = noise.white(5000);
  record.residual = noise.white(5000, 2.0);
  record.yhat = record.u;
  const ResidualTests tests = tested(record, {});
  const ResidualTest& input = *tests.find(Kind::input);
  ASSERT_EQ(input.lags.size(), 26);
  EXPECT_EQ(input.lags[25], 25.0);
  EXPECT_EQ(input.degrees_of_freedom, 26);
  for (Index k = 0; k < 26; ++k)
    EXPECT_NEAR(input.bands[k], 2.5758 / std::sqrt(5000.0), 0.04 * 2.5758 / std::sqrt(5000.0));
  EXPECT_NEAR(input.correlations[0], record.u.dot(record.residual) / (record.u.norm() * record.residual.norm()), 1e-3);
  EXPECT_TRUE(tests.model_passed());
  EXPECT_NEAR(tests.deviation, 2.0, 0.1);
  EXPECT_EQ(tests.rank, 0);
}

TEST(ResidualTests, CorrelationPeaksAtTheLagOfWhatIsMissing) {
  testing::Noise noise(7);
  ResidualRecord record;
  record.u = noise.white(1000);
  record.yhat = record.u;
  record.residual = noise.white(1000, 0.1) + delays(record.u, 6).col(5);
  const ResidualTests tests = tested(record, {});
  const ResidualTest& test = *tests.find(Kind::input);
  Index place = 0;
  EXPECT_GT(test.correlations.cwiseAbs().maxCoeff(&place), 0.98);
  EXPECT_EQ(test.lags[place], 5.0);
  EXPECT_THAT(explanation(test), HasSubstr("follows the input linearly"));
}

TEST(ResidualTests, DirectionsOfTheParametersAreNotTested) {
  // The instruments u_t .. u_{t-3} lie within the four sensitivities (but for the mean): 11 lags leave 7 directions.
  testing::Noise noise(8);
  VectorXd u = noise.white(1000);
  u.array() -= u.mean();
  const VectorXd y = delays(u, 4) * kTaps + noise.white(1000);
  MatrixXd x(1000, 5);
  x << delays(u, 4), VectorXd::Ones(1000);
  const ResidualTests tests = tested(fitted(u, y, x), kShort);
  EXPECT_EQ(tests.find(Kind::input)->degrees_of_freedom, 7);
  EXPECT_EQ(tests.rank, 5);
  EXPECT_LT(tests.distance_from_minimum, 1e-10);
}

TEST(ResidualTests, ModelFromElsewhereIsNotAtTheMinimumHere) {
  MatrixXd covariance;
  ResidualRecord record = from_elsewhere(9, covariance);
  record.fitted_here = record.fitted_elsewhere;
  record.fitted_elsewhere.resize(1500, 0);
  EXPECT_GT(tested(record, kShort).distance_from_minimum, 0.5);
}

TEST(ResidualTests, UnitsDoNotMatter) {
  testing::Noise noise(10);
  const VectorXd u = noise.coloured(800, 0.6, 1.0);
  const VectorXd y = delays(u, 4) * kTaps + noise.coloured(800, 0.5, 0.5);
  const ResidualTests one = tested(fitted(u, y, delays(u, 4)), {});
  const ResidualTests other = tested(fitted(1e-4 * u, 1e5 * y, delays(1e-4 * u, 4)), {});
  ASSERT_EQ(one.tests.size(), other.tests.size());
  for (std::size_t k = 0; k < one.tests.size(); ++k) {
    // Statistics divide by eigenvalues down to 1e-6 of the largest, which rounding knows to 1e-10.
    EXPECT_NEAR(one.tests[k].statistic, other.tests[k].statistic, 1e-8 * one.tests[k].statistic)
        << to_text(one.tests[k].kind);
  }
}

TEST(ResidualTests, WordsForEveryKind) {
  for (const Kind kind : {Kind::offset, Kind::whiteness, Kind::input, Kind::later_input, Kind::squared_input,
                          Kind::absolute_input, Kind::squared_output, Kind::cubed_output}) {
    ResidualTest test;
    test.kind = kind;
    EXPECT_TRUE(explanation(test).empty());
    test.passed = false;
    EXPECT_FALSE(explanation(test).empty());
    EXPECT_NE(to_text(kind), "unknown");
  }
}

/// Expects the error `part` when `change` is made to a good record and good options.
void expect_error(const std::function<void(ResidualRecord&, ResidualTestOptions&)>& change, const char* part) {
  testing::Noise noise(11);
  ResidualRecord record{noise.white(200), noise.white(200), noise.white(200), {}, {}, {}};
  ResidualTestOptions options;
  EXPECT_NO_THROW(static_cast<void>(tested(record, options)));
  change(record, options);
  EXPECT_THAT([&] { static_cast<void>(tested(record, options)); }, ThrowsMessage<Error>(HasSubstr(part)));
}

TEST(ResidualTests, BadInputIsRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  expect_error([](auto& r, auto&) { r.u.resize(10); }, "expected u of 200 samples, got 10");
  expect_error([](auto& r, auto&) { r.yhat.resize(10); }, "expected yhat of 200 samples, got 10");
  expect_error([](auto& r, auto&) { r.weights = VectorXd::Ones(3); }, "expected weights of 200 samples, got 3");
  expect_error([](auto& r, auto&) { r.weights = -VectorXd::Ones(200); }, "weights of zero or more");
  expect_error([](auto& r, auto&) { r.fitted_here = MatrixXd::Ones(5, 1); }, "sensitivities of 200 samples, got 5");
  expect_error([&](auto& r, auto&) { r.fitted_here = MatrixXd::Constant(200, 1, kNan); }, "finite sensitivities");
  expect_error([&](auto& r, auto&) { r.u[3] = kNan; }, "finite inputs");
  expect_error([&](auto& r, auto&) { r.yhat[3] = kNan; }, "finite outputs");
  expect_error([&](auto& r, auto&) { r.residual[3] = kNan; }, "finite residuals");
  expect_error([](auto& r, auto&) { r.residual.setConstant(0.5); }, "does not vary");
  expect_error([](auto& r, auto&) { r.fitted_elsewhere = MatrixXd::Ones(200, 2); }, "covariance of 2 x 2, got 0 x 0");
  expect_error([](auto&, auto& o) { o.lags = 0; }, "at least 1 lag, got 0");
  expect_error([](auto&, auto& o) { o.lags = 60; }, "at least 244 scored samples");
  expect_error([](auto&, auto& o) { o.significance = 1.5; }, "significance in (0, 1), got 1.5");
  expect_error([](auto&, auto& o) { o.noise_order = -1; }, "noise order of 0 or more, got -1");
  EXPECT_THAT([] { static_cast<void>(residual_tests({}, {})); },
              ThrowsMessage<Error>(HasSubstr("at least one record")));
  testing::Noise noise(12);
  std::vector<ResidualRecord> records(2,
                                      ResidualRecord{noise.white(200), noise.white(200), noise.white(200), {}, {}, {}});
  records[1].fitted_here = noise.matrix(200, 2);
  EXPECT_THAT([&] { static_cast<void>(residual_tests(records, {})); },
              ThrowsMessage<Error>(HasSubstr("record 2: expected sensitivities of 0 parameters")));
}

}  // namespace
}  // namespace blockid
