#include <blockid/estimators/refit.hpp>

#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <blockid/blocks/memoryless.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/estimators/gauges.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::model_of;
using testing::Noise;
using testing::simulated_record;

// A parameter further than this many standard deviations from the truth has a probability of 7e-6.
constexpr double kDeviations = 4.5;
constexpr double kNoise = 0.05;

std::vector<Index> free_of(const Model& model, const std::vector<std::string>& frozen = {}) {
  std::vector<Index> fixed = gain_gauges(model.chain, model.parameters);
  for (const std::string& name : frozen) fixed.push_back(parameter_index(model, name));
  std::vector<Index> free;
  for (Index k = 0; k < model.parameters.size(); ++k) {
    if (std::find(fixed.begin(), fixed.end(), k) == fixed.end()) free.push_back(k);
  }
  return free;
}

// rmse of N residuals at the minimum: noise sqrt(1 - P / N), with deviation noise / sqrt(2 N).
void expect_noise_level(double rmse, double samples, double parameters) {
  EXPECT_NEAR(rmse, kNoise * std::sqrt(1.0 - parameters / samples), 3.0 * kNoise / std::sqrt(2.0 * samples));
}

void expect_truth(const RefitReport& report, const Model& truth, const std::vector<Index>& free) {
  ASSERT_TRUE(report.covariance.has_value());
  const Eigen::VectorXd& deviations = report.covariance->standard_deviations;
  EXPECT_EQ(report.model.standard_deviations, deviations);
  for (Index k = 0; k < truth.parameters.size(); ++k) {
    const std::string name = truth.chain.parameter_names()[static_cast<std::size_t>(k)];
    const double error = report.model.parameters[k] - truth.parameters[k];
    if (std::find(free.begin(), free.end(), k) == free.end()) {
      EXPECT_EQ(error, 0.0) << name << " was held";
      EXPECT_EQ(deviations[k], 0.0) << name << " was held";
    } else {
      EXPECT_GT(deviations[k], 0.0) << name;
      EXPECT_LT(std::abs(error), kDeviations * deviations[k]) << name;
    }
  }
}

struct System {
  std::string name;
  Model truth;
  std::vector<std::string> frozen = {};
};

std::vector<System> systems() {
  return {{"linear", testing::linear()},
          {"wiener", testing::wiener()},
          {"hammerstein", testing::hammerstein()},
          {"wiener_hammerstein", testing::wiener_hammerstein()},
          {"parallel", testing::parallel_branches(), {"parallel1.series2.Q.c0"}},
          {"biquads", model_of("B=biquads(sections=1) | t=tanh_network(units=1,range=[-2:2])",
                               {1.0, 0.4, 0.1, -0.9, 0.4, 0.1, 0.3, 1.5, 1.3, 0.4})}};
}

class RecoveryTest : public ::testing::TestWithParam<std::tuple<std::size_t, ResidualForm, StaticParameters>> {};

TEST_P(RecoveryTest, TruthWithinItsStandardDeviations) {
  const auto [which, form, static_parameters] = GetParam();
  const System system = systems()[which];
  const Record record = simulated_record(system.truth, 2000, kNoise, 100 + which);
  const std::vector<Index> free = free_of(system.truth, system.frozen);
  Model start = system.truth;
  start.parameters = testing::moved(system.truth.parameters, free, 0.15, 7);
  RefitOptions options;
  options.residual_form = form;
  options.static_parameters = static_parameters;
  options.frozen = system.frozen;
  const RefitReport report = refit(start, record, options);
  EXPECT_EQ(report.status, FitStatus::converged) << report.message;
  EXPECT_GT(report.initial_rmse, 2.0 * kNoise) << "the start must be off, or nothing is tested";
  EXPECT_GT(report.iterations, 1);
  EXPECT_EQ(report.free_parameters, std::ssize(free));
  EXPECT_EQ(report.covariance->rank, std::ssize(free));
  EXPECT_THAT(report.covariance->undetermined, ::testing::IsEmpty());
  EXPECT_GT(report.wall_seconds, 0.0);
  expect_noise_level(report.rmse, 2000.0, static_cast<double>(free.size()));
  expect_truth(report, system.truth, free);
}

INSTANTIATE_TEST_SUITE_P(Automatic, RecoveryTest,
                         ::testing::Combine(::testing::Range<std::size_t>(0, systems().size()),
                                            ::testing::Values(ResidualForm::automatic),
                                            ::testing::Values(StaticParameters::automatic)),
                         [](const auto& instance) { return systems()[std::get<0>(instance.param)].name; });
INSTANTIATE_TEST_SUITE_P(EveryForm, RecoveryTest,
                         ::testing::Combine(::testing::Values<std::size_t>(3),
                                            ::testing::Values(ResidualForm::full, ResidualForm::compressed,
                                                              ResidualForm::triangle),
                                            ::testing::Values(StaticParameters::joint)));

TEST(RefitTest, EveryFormFindsTheSameMinimum) {
  const Model truth = testing::wiener_hammerstein();
  const Record record = simulated_record(truth, 1000, kNoise, 21);
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.1, 22);
  RefitOptions options;
  options.static_parameters = StaticParameters::joint;
  options.residual_form = ResidualForm::full;
  const RefitReport full = refit(start, record, options);
  for (const ResidualForm form : {ResidualForm::automatic, ResidualForm::compressed, ResidualForm::triangle}) {
    options.residual_form = form;
    const RefitReport other = refit(start, record, options);
    // The same steps up to rounding amplified by the condition of the problem, see predictor_cost_test.cpp.
    EXPECT_LT((other.model.parameters - full.model.parameters).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_EQ(other.iterations, full.iterations);
  }
}

TEST(RefitTest, SeveralRecordsWithTheirOwnInitialStates) {
  const Model truth = testing::wiener_hammerstein();
  std::vector<Record> records;
  for (std::uint64_t i = 0; i < 3; ++i) {
    Model model = truth;
    model.initial_state = 3.0 * Noise(30 + i).white(truth.chain.state_count());
    records.push_back(simulated_record(model, 700, kNoise, 33 + i));
  }
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.05, 36);
  RefitOptions options;
  options.prediction.initial_state = InitialState::estimated;
  const RefitReport report = refit(start, records, options);
  EXPECT_EQ(report.status, FitStatus::converged) << report.message;
  ASSERT_EQ(report.initial_states.size(), 3u);
  EXPECT_EQ(report.model.initial_state, report.initial_states.front());
  const auto unknowns =
      static_cast<double>(free_of(truth).size()) + 3.0 * static_cast<double>(truth.chain.state_count());
  expect_noise_level(report.rmse, 2100.0, unknowns);
  expect_truth(report, truth, free_of(truth));
  // s^2 belongs to the states that were found, each record with its own.
  ASSERT_TRUE(report.covariance.has_value());
  EXPECT_NEAR(report.covariance->noise_variance, report.rmse * report.rmse * 2100.0 / (2100.0 - unknowns), 1e-6);
  options.prediction.initial_state = InitialState::zero;
  EXPECT_GT(refit(start, records, options).rmse, 2.0 * kNoise)
      << "the initial states must matter, or nothing is tested";
}

TEST(RefitTest, StatesThatTheWarmUpHidesDoNotMisleadTheSearch) {
  // Of the states at the first sample 0.72^60 = 3e-9 is left when samples begin to count: an undamped step in them
  // would be of the size of the residual times 1e8. The search has to go as if the states were not there.
  const Model truth = testing::wiener_hammerstein();
  Noise numbers(37);
  const Eigen::VectorXd u = numbers.white(2200);
  Record record;
  record.y = (simulate(truth, u) + numbers.white(2200, kNoise)).tail(2000);
  record.u = u.tail(2000);
  for (std::uint64_t seed = 38; seed < 42; ++seed) {
    Model start = truth;
    start.parameters = testing::moved(truth.parameters, free_of(truth), 0.1, seed);
    RefitOptions options;
    options.prediction.warmup = 60;
    const RefitReport from_rest = refit(start, record, options);
    options.prediction.initial_state = InitialState::estimated;
    const RefitReport estimated = refit(start, record, options);
    // When all else has settled the states are let go by a factor of ten a step: three more until nothing changes.
    EXPECT_LE(estimated.iterations, from_rest.iterations + 3);
    EXPECT_NEAR(estimated.rmse, from_rest.rmse, 1e-6 * from_rest.rmse);
  }
}

TEST(RefitTest, StatesThatMatterAreFoundAsFast) {
  // The damping of the states must not outlive its use: with all of it a search takes fifty steps here, without any
  // six, now and then twenty.
  const Model truth = testing::wiener_hammerstein();
  int steps = 0;
  for (std::uint64_t seed = 43; seed < 103; seed += 10) {
    Model other = truth;
    other.initial_state = Noise(seed).white(truth.chain.state_count());
    const Record record = simulated_record(other, 2000, kNoise, seed + 1);
    Model start = truth;
    start.parameters = testing::moved(truth.parameters, free_of(truth), 0.05, seed + 2);
    RefitOptions options;
    options.prediction.initial_state = InitialState::estimated;
    const RefitReport report = refit(start, record, options);
    EXPECT_EQ(report.status, FitStatus::converged);
    expect_noise_level(report.rmse, 2000.0, static_cast<double>(free_of(truth).size() + truth.chain.state_count()));
    steps += report.iterations;
  }
  EXPECT_LE(steps, 6 * 15);
}

TEST(RefitTest, PeriodicSteadyState) {
  const Model truth = testing::wiener();
  Noise numbers(41);
  Record record;
  record.u = numbers.white(400);
  Eigen::VectorXd repeated(1200);
  repeated << record.u, record.u, record.u;
  record.y = simulate(truth, repeated).tail(400) + numbers.white(400, kNoise);
  record.period = 400;
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.1, 42);
  RefitOptions options;
  options.prediction.initial_state = InitialState::periodic;
  const RefitReport report = refit(start, record, options);
  EXPECT_EQ(report.status, FitStatus::converged);
  expect_noise_level(report.rmse, 400.0, 7.0);
  expect_truth(report, truth, free_of(truth));
}

TEST(RefitTest, WeightsAndMissingSamples) {
  const Model truth = testing::hammerstein();
  Record record = simulated_record(truth, 2000, kNoise, 51);
  record.weights = Eigen::VectorXd::Ones(2000);
  for (Index t = 500; t < 700; ++t) {
    record.weights[t] = 0.0;
    record.y[t] = std::numeric_limits<double>::quiet_NaN();
  }
  // Ten times the noise where the weight is a tenth: the weighted residuals are alike.
  Noise numbers(52);
  for (Index t = 1000; t < 1500; ++t) {
    record.weights[t] = 0.1;
    record.y[t] += std::sqrt(99.0) * kNoise * numbers.normal();
  }
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.1, 53);
  const RefitReport report = refit(start, record);
  EXPECT_EQ(report.status, FitStatus::converged);
  expect_truth(report, truth, free_of(truth));
}

TEST(RefitTest, FrozenParametersAreKeptExactly) {
  const Model truth = testing::wiener_hammerstein();
  const Record record = simulated_record(truth, 500, kNoise, 61);
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.1, 62);
  for (const StaticParameters way : {StaticParameters::joint, StaticParameters::eliminated}) {
    RefitOptions options;
    options.static_parameters = way;
    options.frozen = {"G1.a1", "f.c2", "G2.b1", "f.c2"};
    const RefitReport report = refit(start, record, options);
    EXPECT_LT(report.rmse, report.initial_rmse);
    EXPECT_EQ(report.free_parameters, 13 - 3);
    EXPECT_TRUE(report.held.empty()) << "f.c2 and G2.b1 fix both gains";
    for (const char* name : {"G1.a1", "f.c2", "G2.b1"}) {
      const Index k = parameter_index(truth, name);
      EXPECT_EQ(report.model.parameters[k], start.parameters[k]) << name;
      EXPECT_EQ(report.covariance->standard_deviations[k], 0.0) << name;
      EXPECT_TRUE(report.covariance->parameters.row(k).isZero(0.0)) << name;
    }
  }
}

TEST(RefitTest, EverythingFrozen) {
  const Model truth = testing::linear();
  RefitOptions options;
  options.frozen = truth.chain.parameter_names();
  const RefitReport report = refit(truth, simulated_record(truth, 100, kNoise, 63), options);
  EXPECT_EQ(report.status, FitStatus::converged);
  EXPECT_EQ(report.model.parameters, truth.parameters);
  EXPECT_EQ(report.rmse, report.initial_rmse);
  EXPECT_EQ(report.free_parameters, 0);
}

ParameterBounds wide(Index count) {
  return {Eigen::VectorXd::Constant(count, -1e3), Eigen::VectorXd::Constant(count, 1e3)};
}

TEST(RefitBoundsTest, AreKept) {
  const Model truth = testing::linear();
  const Record record = simulated_record(truth, 1000, kNoise, 71);
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.1, 72);
  RefitOptions options;
  options.bounds = wide(5);
  const RefitReport loose = refit(start, record, options);
  EXPECT_EQ(loose.status, FitStatus::converged);
  expect_truth(loose, truth, free_of(truth));
  // b1 = 0.4 is kept from its value.
  start.parameters[1] = 0.2;
  options.bounds->upper[1] = 0.3;
  const RefitReport tight = refit(start, record, options);
  EXPECT_NEAR(tight.model.parameters[1], 0.3, 1e-6);
  EXPECT_LE(tight.model.parameters[1], 0.3);
  EXPECT_GT(tight.rmse, loose.rmse);
}

TEST(RefitBoundsTest, AreKeptWhenTheStartViolatesThem) {
  // The start is the truth: no point within the bounds is as good, and still the bounds come first.
  const Model truth = testing::linear();
  const Record record = simulated_record(truth, 1000, kNoise, 73);
  RefitOptions options;
  options.bounds = wide(5);
  options.bounds->lower[0] = 1.0;
  options.bounds->upper[1] = 0.3;
  const RefitReport report = refit(truth, record, options);
  EXPECT_EQ(report.status, FitStatus::converged) << report.message;
  EXPECT_GE(report.model.parameters[0], 1.0);
  EXPECT_LE(report.model.parameters[1], 0.3);
  EXPECT_LE(report.rmse, report.initial_rmse);
}

TEST(RefitBoundsTest, FrozenOutsideItsBoundsIsAContradiction) {
  const Model truth = testing::linear();
  RefitOptions options;
  options.bounds = wide(5);
  options.bounds->lower[0] = 1.0;
  options.frozen = {"G.b0"};
  EXPECT_THAT(BLOCKID_MESSAGE(refit(truth, simulated_record(truth, 100, kNoise, 74), options)),
              AllOf(HasSubstr("G.b0"), HasSubstr("0.8"), HasSubstr("[1, 1000]")));
}

TEST(RefitBoundsTest, VariableProjectionCannotKeepThem) {
  const Model truth = testing::hammerstein();
  const Record record = simulated_record(truth, 500, kNoise, 75);
  RefitOptions options;
  options.bounds = wide(8);
  options.static_parameters = StaticParameters::eliminated;
  EXPECT_THAT(BLOCKID_MESSAGE(refit(truth, record, options)), AllOf(HasSubstr("f.c0"), HasSubstr("fit jointly")));
  // Bounds on other parameters alone go with it.
  options.bounds->lower.head(4).setConstant(-std::numeric_limits<double>::infinity());
  options.bounds->upper.head(4).setConstant(std::numeric_limits<double>::infinity());
  options.bounds->upper[5] = 0.5;
  const RefitReport report = refit(truth, record, options);
  EXPECT_LE(report.model.parameters[5], 0.5);
  EXPECT_NEAR(report.model.parameters[5], 0.5, 1e-6);
  // Automatic falls back to the joint fit.
  options.static_parameters = StaticParameters::automatic;
  options.bounds = wide(8);
  options.bounds->upper[1] = 1.9;
  const RefitReport joint = refit(truth, record, options);
  EXPECT_LE(joint.model.parameters[1], 1.9);
}

TEST(RefitBoundsTest, OfTheBlocksApplyWhereNoneAreGiven) {
  struct Bounded {
    Index parameter_count() const { return 1; }
    ParameterBounds bounds() const { return {Eigen::VectorXd::Constant(1, -0.5), Eigen::VectorXd::Constant(1, 0.5)}; }
    void apply(std::span<const double> theta, std::span<double>, std::span<const double> u, std::span<double> y) const {
      for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t];
    }
    void apply(std::span<const TileJet> theta, std::span<TileJet>, std::span<const TileJet> u,
               std::span<TileJet> y) const {
      for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t];
    }
  };
  const Model truth = model_of("k=gain", {0.8});
  const Record record = simulated_record(truth, 100, kNoise, 76);
  const Model start = make_model(Bounded{});
  EXPECT_NEAR(refit(start, record).model.parameters[0], 0.5, 1e-6);
  RefitOptions options;
  options.bounds = wide(1);
  EXPECT_NEAR(refit(start, record, options).model.parameters[0], 0.8, 0.03);
}

TEST(RefitProgressTest, SeesEveryIterationAndCancels) {
  const Model truth = testing::wiener_hammerstein();
  const Record record = simulated_record(truth, 1000, kNoise, 81);
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.2, 82);
  for (const StaticParameters way : {StaticParameters::joint, StaticParameters::eliminated}) {
    std::vector<FitProgress> seen;
    RefitOptions options;
    options.static_parameters = way;
    options.progress = [&](const FitProgress& p) {
      seen.push_back(p);
      return true;
    };
    const RefitReport whole = refit(start, record, options);
    ASSERT_EQ(std::ssize(seen), whole.iterations + 1);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      EXPECT_EQ(seen[k].iteration, static_cast<int>(k));
      EXPECT_GE(seen[k].elapsed_s, 0.0);
    }
    EXPECT_NEAR(seen.back().rmse, whole.rmse, 1e-9);

    options.progress = [](const FitProgress& p) { return p.iteration < 2; };
    const RefitReport cancelled = refit(start, record, options);
    EXPECT_EQ(cancelled.status, FitStatus::cancelled);
    EXPECT_EQ(to_text(cancelled.status), "cancelled");
    EXPECT_LT(cancelled.rmse, cancelled.initial_rmse);
    EXPECT_GE(cancelled.rmse, whole.rmse);

    options.progress = [](const FitProgress&) { return false; };
    const RefitReport at_once = refit(start, record, options);
    EXPECT_EQ(at_once.status, FitStatus::cancelled);
    EXPECT_LE(at_once.rmse, at_once.initial_rmse);
  }
}

TEST(RefitStatusTest, MaxIterations) {
  const Model truth = testing::wiener_hammerstein();
  const Record record = simulated_record(truth, 500, kNoise, 83);
  Model start = truth;
  start.parameters = testing::moved(truth.parameters, free_of(truth), 0.2, 84);
  RefitOptions options;
  options.max_iterations = 2;
  const RefitReport report = refit(start, record, options);
  EXPECT_EQ(report.status, FitStatus::max_iterations);
  EXPECT_EQ(report.iterations, 2);
  EXPECT_LT(report.rmse, report.initial_rmse);
  options.max_iterations = 0;
  options.static_parameters = StaticParameters::joint;
  const RefitReport none = refit(start, record, options);
  EXPECT_EQ(none.status, FitStatus::max_iterations);
  EXPECT_EQ(none.model.parameters, start.parameters);
}

TEST(RefitStatusTest, DivergedStart) {
  const Model unstable = model_of("G=rational(nb=0,na=1)", {1.0, -3.0});
  const RefitReport report = refit(unstable, simulated_record(testing::linear(), 1000, kNoise, 85));
  EXPECT_EQ(report.status, FitStatus::diverged);
  EXPECT_EQ(report.model.parameters, unstable.parameters);
  EXPECT_TRUE(std::isinf(report.initial_rmse));
  EXPECT_THAT(report.message, HasSubstr("finite"));
}

TEST(RefitStatusTest, StartWhoseDerivativesOverflowIsRefusedInSilence) {
  // y of the order of g^t with g = 2.42: 1e153 after 400 samples, whose derivatives squared are beyond all numbers.
  Model model = model_of("G=rational(nb=0,na=1)", {1.0, -2.42});
  Record record;
  record.u = Eigen::VectorXd::Unit(400, 0);
  record.y = Eigen::VectorXd::Zero(400);
  ::testing::internal::CaptureStderr();
  const RefitReport report = refit(model, record);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(report.status, FitStatus::diverged);
  EXPECT_THAT(report.message, HasSubstr("finite derivatives"));
  EXPECT_TRUE(std::isfinite(report.initial_rmse));
  EXPECT_EQ(report.model.parameters, model.parameters);
}

TEST(RefitStatusTest, UnstableStartWithinTheRangeOfNumbersIsNoObstacle) {
  // 1.02^300 = 380: finite, and the way back leads through the circle.
  const Model truth = model_of("G=rational(nb=0,na=1)", {1.0, -0.9});
  const Model start = model_of("G=rational(nb=0,na=1)", {1.0, -1.02});
  const RefitReport report = refit(start, simulated_record(truth, 300, kNoise, 86));
  EXPECT_EQ(report.status, FitStatus::converged) << report.message;
  EXPECT_GT(report.initial_rmse, 10.0);
  expect_noise_level(report.rmse, 300.0, 2.0);
}

TEST(RefitStatusTest, UndeterminedDirectionsAreNamed) {
  // Behind the warm-up the constant of either branch is a constant at the output; before, its transient tells them
  // apart.
  const Model truth = testing::parallel_branches();
  RefitOptions options;
  options.prediction.warmup = 100;
  const RefitReport report = refit(truth, simulated_record(truth, 1000, kNoise, 87), options);
  EXPECT_EQ(report.status, FitStatus::ill_conditioned);
  ASSERT_TRUE(report.covariance.has_value());
  EXPECT_EQ(report.covariance->rank, report.covariance->free_count - 1);
  EXPECT_THAT(report.covariance->undetermined, ElementsAre("parallel1.series1.f.c0", "parallel1.series2.Q.c0"));
}

TEST(RefitStatusTest, WithoutHeldGainsTheGaugeIsNamed) {
  const Model truth = testing::wiener();
  RefitOptions options;
  options.hold_gauges = false;
  const RefitReport report = refit(truth, simulated_record(truth, 1000, kNoise, 88), options);
  EXPECT_EQ(report.status, FitStatus::ill_conditioned);
  EXPECT_EQ(report.covariance->rank, 7);
  EXPECT_THAT(report.covariance->undetermined, Contains("G.b0"));
  EXPECT_THAT(report.held, ::testing::IsEmpty());
}

TEST(RefitErrorsTest, AreNamed) {
  const Model truth = testing::wiener();
  const Record record = simulated_record(truth, 200, kNoise, 91);
  const auto message = [&](const Model& model, const Record& data, const RefitOptions& options) {
    return BLOCKID_MESSAGE(refit(model, data, options));
  };
  RefitOptions options;
  EXPECT_THAT(message(truth, slice(record, 0, 6), options), AllOf(HasSubstr("6 samples"), HasSubstr("7 free")));
  EXPECT_EQ(message(truth, slice(record, 0, 7), options), "no error");
  options.frozen = {"G.b9"};
  EXPECT_THAT(message(truth, record, options), AllOf(HasSubstr("'G.b9'"), HasSubstr("G.b0"), HasSubstr("f.c3")));
  options.frozen = {};
  options.bounds = wide(8);
  options.bounds->lower[2] = 1.0;
  options.bounds->upper[2] = -1.0;
  EXPECT_THAT(message(truth, record, options), AllOf(HasSubstr("G.a1"), HasSubstr("cross"), HasSubstr("[1, -1]")));
  options.bounds = wide(7);
  EXPECT_THAT(message(truth, record, options), AllOf(HasSubstr("8 parameters"), HasSubstr("7 lower")));
  options.bounds.reset();
  options.max_iterations = -1;
  EXPECT_THAT(message(truth, record, options), HasSubstr("max_iterations"));
  options = {};
  options.prediction.warmup = 200;
  EXPECT_THAT(message(truth, record, options), HasSubstr("warm-up of 200"));
  options = {};
  options.prediction.initial_state = InitialState::periodic;
  EXPECT_THAT(message(truth, record, options), HasSubstr("period"));
  Model wrong = truth;
  wrong.parameters.conservativeResize(7);
  EXPECT_THAT(message(wrong, record, {}), AllOf(HasSubstr("8 parameters"), HasSubstr("got 7")));
  options = {};
  options.static_parameters = StaticParameters::eliminated;
  EXPECT_THAT(message(testing::linear(), record, options), HasSubstr("nothing to eliminate"));
  Record broken = record;
  broken.u[3] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(message(truth, broken, {}), HasSubstr("3"));
}

TEST(PredictTest, IsTheSimulationFromTheModelsState) {
  Model model = testing::wiener_hammerstein();
  const Record record = simulated_record(model, 300, kNoise, 92);
  EXPECT_EQ(predict(model, record), simulate(model, record.u));
  model.initial_state = Noise(93).white(model.chain.state_count());
  EXPECT_EQ(predict(model, record, {InitialState::estimated, 0, 1}), simulate(model, record.u));
}

TEST(InitialStateTest, IsRecovered) {
  Model model = testing::linear();
  model.initial_state = Eigen::Vector2d(2.0, -1.5);
  Noise numbers(94);
  Record record;
  record.u = numbers.white(200);
  record.y = simulate(model, record.u);
  Model unknown = model;
  unknown.initial_state.resize(0);
  // Linear in the state and without noise: one step leads to the minimum, to half of the digits where r'r is small.
  EXPECT_LT((estimate_initial_state(unknown, record) - model.initial_state).norm(), 1e-6);
  // What the first samples say is gone with them, yet 0.77^5 of the transient is left.
  EXPECT_LT((estimate_initial_state(unknown, record, 5) - model.initial_state).norm(), 1e-5);

  Model nonlinear = testing::wiener_hammerstein();
  nonlinear.initial_state = 2.0 * Noise(95).white(nonlinear.chain.state_count());
  record.y = simulate(nonlinear, record.u);
  unknown = nonlinear;
  unknown.initial_state.resize(0);
  const Eigen::VectorXd found = estimate_initial_state(unknown, record);
  unknown.initial_state = found;
  EXPECT_LT((simulate(unknown, record.u) - record.y).norm(), 1e-5);
  EXPECT_EQ(estimate_initial_state(model_of("k=gain", {2.0}), record).size(), 0);
}

// Least squares with the rows of a penalty: for a model linear in its one parameter the minimum is known.
TEST(RefitTest, PenaltyPullsAsItsRowSays) {
  Model start = testing::model_of("g=gain", {0.0});
  Record record;
  record.u = testing::Noise(7).white(200);
  record.y = 3.0 * record.u + 0.1 * testing::Noise(8).white(200);
  RefitOptions options;
  options.covariance = false;
  options.static_parameters = StaticParameters::joint;
  options.penalties = {{"g.k", 1.0, 0.7}};
  const RefitReport report = refit(start, record, options);
  const double n = 200.0;
  const double expected = (record.u.dot(record.y) + n * 0.7 * 0.7 * 1.0) / (record.u.squaredNorm() + n * 0.7 * 0.7);
  // The gradient at the stop is that of a quadratic whose value changes by less than 1e-10 of itself.
  EXPECT_NEAR(report.model.parameters[0], expected, 1e-5);
  options.penalties = {{"g.k", 1.0, -1.0}};
  EXPECT_THAT(BLOCKID_MESSAGE(refit(start, record, options)), HasSubstr("g.k"));
}

TEST(RefitTest, PenaltyOnAnEliminatedParameterIsAnError) {
  RefitOptions options;
  options.static_parameters = StaticParameters::eliminated;
  options.penalties = {{"f.c1", 0.0, 1.0}};
  const Model truth = testing::wiener_hammerstein();
  EXPECT_THAT(BLOCKID_MESSAGE(refit(truth, simulated_record(truth, 300, kNoise, 1), options)), HasSubstr("f.c1"));
}

}  // namespace
}  // namespace blockid
