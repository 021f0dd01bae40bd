// Stages of rising cost: when they end, what they hand on.
#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <blockid/init/escalated.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::simulated_record;

constexpr double kNoise = 0.05;

/// A stage that counts its calls and remembers its seed.
struct Stage {
  Model model = testing::wiener_hammerstein();
  int calls = 0;
  std::uint64_t seed = 0;
};

Initialiser counted(const std::shared_ptr<Stage>& stage) {
  return [stage](const AnyBlock&, const DataSet&, const InitialiserOptions& options) {
    ++stage->calls;
    stage->seed = options.seed;
    return std::vector<Candidate>{{stage->model, 1.0, "as it is"}};
  };
}

/// The system's model a little off, which a refit mends.
Model near_truth() {
  Model model = testing::wiener_hammerstein();
  model.parameters *= 1.001;
  return model;
}

/// A filter too few, which no refit mends.
Model too_small() { return testing::wiener(); }

class Escalated : public ::testing::Test {
 protected:
  std::vector<Candidate> run(const DataSet& data, const InitialiserOptions& options = {}) const {
    return escalated({counted(first_), counted(second_)})(testing::wiener_hammerstein().chain, data, options);
  }

  std::shared_ptr<Stage> first_ = std::make_shared<Stage>();
  std::shared_ptr<Stage> second_ = std::make_shared<Stage>();
  DataSet data_{simulated_record(testing::wiener_hammerstein(), 3000, kNoise, 1)};
};

TEST_F(Escalated, EndsWithTheFirstStageThatExplainsTheData) {
  first_->model = near_truth();
  second_->model = too_small();
  const std::vector<Candidate> found = run(data_);
  EXPECT_EQ(second_->calls, 0);
  ASSERT_EQ(found.size(), 1U);
  // Refitted: 13 parameters of 3000 samples take up 0.2 % of the noise, the noise itself varies by 1.3 %.
  EXPECT_NEAR(found[0].rmse, kNoise, 0.05 * kNoise);
}

TEST_F(Escalated, GoesOnWhenMoreThanNoiseIsLeft) {
  first_->model = too_small();
  second_->model = near_truth();
  InitialiserOptions options;
  options.seed = 7;
  const std::vector<Candidate> found = run(data_, options);
  EXPECT_EQ(first_->seed, 7U);
  EXPECT_EQ(second_->calls, 1);
  EXPECT_EQ(second_->seed, 8U);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_LT(found[0].rmse, found[1].rmse);
  EXPECT_NEAR(found[0].rmse, kNoise, 0.05 * kNoise);
}

TEST_F(Escalated, NegligibleResidualsNeedNoExplanation) {
  // A fifth of `negligible`, and far from white.
  Record record = simulated_record(testing::wiener_hammerstein(), 3000, 0.0, 2);
  const double deviation = std::sqrt((record.y.array() - record.y.mean()).square().mean());
  for (Index t = 0; t < record.y.size(); ++t) {
    record.y[t] += 0.001 * deviation * std::sin(0.01 * static_cast<double>(t)) * std::sqrt(2.0);
  }
  first_->model = near_truth();
  second_->model = too_small();
  static_cast<void>(run(DataSet(record)));
  EXPECT_EQ(second_->calls, 0);
  static_cast<void>(escalated({counted(first_), counted(second_)}, {.negligible = 0.0})(
      testing::wiener_hammerstein().chain, DataSet(record), {}));
  EXPECT_EQ(second_->calls, 1);
}

TEST_F(Escalated, EndsWhenItIsCancelled) {
  first_->model = too_small();
  second_->model = near_truth();
  InitialiserOptions options;
  options.progress = [](const Progress&) { return false; };
  EXPECT_EQ(run(data_, options).size(), 1U) << "what was found so far is kept";
  EXPECT_EQ(second_->calls, 0);
}

TEST_F(Escalated, StagesWithoutCandidatesArePassedOver) {
  second_->model = near_truth();
  const Initialiser none = [](const AnyBlock&, const DataSet&, const InitialiserOptions&) {
    return std::vector<Candidate>{};
  };
  const Initialiser both = escalated({none, counted(second_)});
  EXPECT_EQ(both(testing::wiener_hammerstein().chain, data_, {}).size(), 1U);
}

TEST_F(Escalated, RefusesBadOptions) {
  EXPECT_THAT(BLOCKID_MESSAGE(escalated({}, {.refits = 0})), HasSubstr("must be >= 1"));
  EXPECT_THAT(BLOCKID_MESSAGE(escalated({}, {.negligible = -1.0})), HasSubstr("negligible >= 0"));
}

}  // namespace
}  // namespace blockid
