// Neighbours of a model by its roots, and the search among them.
#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <blockid/estimators/fit.hpp>
#include <blockid/init/root_moves.hpp>
#include <blockid/init/root_search.hpp>
#include <blockid/init/wh_builder.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::simulated_record;
using Kind = RootGroup::Kind;

constexpr double kNoise = 0.02;
// For N = 3000 the deviation of the rmse is 1.3 % of the noise.
constexpr double kSuccess = 1.05;

Index degrees(const std::vector<RootGroup>& groups) {
  Index sum = 0;
  for (const RootGroup& group : groups) sum += group.degree();
  return sum;
}

// One pair and two real poles against one pair; a zero outside the circle, a couple that nearly cancels.
PlacedRoots placed() {
  const RootGroup pair{Kind::pair, {0.5, 0.4}};
  return {{{{Kind::real, 2.0}, {Kind::real, 0.31}}, {pair, {Kind::real, 0.3}, {Kind::real, -0.6}}},
          {{{Kind::real, -0.4}}, {{Kind::pair, {0.1, 0.7}}}}};
}

int count(const std::vector<PlacedRoots>& found, const std::string& word) {
  return static_cast<int>(std::count_if(
      found.begin(), found.end(), [&](const PlacedRoots& one) { return one.how.find(word) != std::string::npos; }));
}

TEST(RootMoves, KeepTheDegreesOfAllPolynomials) {
  const PlacedRoots start = placed();
  for (const PlacedRoots& one : neighbours(start)) {
    EXPECT_EQ(degrees(one.first.zeros), 2) << one.how;
    EXPECT_EQ(degrees(one.first.poles), 4) << one.how;
    EXPECT_EQ(degrees(one.second.zeros), 1) << one.how;
    EXPECT_EQ(degrees(one.second.poles), 2) << one.how;
  }
}

TEST(RootMoves, AreEnumerated) {
  const std::vector<PlacedRoots> found = neighbours(placed());
  // Either zero of the first filter against that of the second.
  EXPECT_EQ(count(found, "exchanged zeros"), 2);
  // The pair, or both real poles, against the pair.
  EXPECT_EQ(count(found, "exchanged poles"), 2);
  EXPECT_EQ(count(found, "reflected zero"), 3);
  // The couple 0.3, 0.31 to either side.
  EXPECT_EQ(count(found, "relocated pole"), 2);
  EXPECT_EQ(found.size(), 9U);
}

TEST(RootMoves, ReflectionKeepsTheGainUpToAConstant) {
  for (const PlacedRoots& one : neighbours(placed())) {
    if (one.how.find("reflected") == std::string::npos) continue;
    const auto gain = [](const FilterRoots& roots, double omega) {
      const std::complex<double> z = std::polar(1.0, omega);
      double value = 1.0;
      for (const std::complex<double>& zero : blockid::roots(roots.zeros)) value *= std::abs(z - zero);
      return value;
    };
    const PlacedRoots start = placed();
    for (const auto filter : {&PlacedRoots::first, &PlacedRoots::second}) {
      const double constant = gain(one.*filter, 0.0) / gain(start.*filter, 0.0);
      for (const double omega : {0.3, 1.0, 2.2, 3.0}) {
        EXPECT_NEAR(gain(one.*filter, omega) / gain(start.*filter, omega), constant, 1e-12 * constant) << one.how;
      }
    }
  }
}

TEST(RootMoves, ReadTheRootsOfAFilter) {
  // (1 - 0.5 x)(1 - 0.4 x) over 1 - 1.2 x + 0.52 x^2: poles 0.6 +- 0.4i.
  const Eigen::VectorXd theta = (Eigen::VectorXd(5) << 1.0, -0.9, 0.2, -1.2, 0.52).finished();
  const FilterRoots roots = roots_of(theta, 2);
  ASSERT_EQ(roots.zeros.size(), 2U);
  ASSERT_EQ(roots.poles.size(), 1U);
  EXPECT_NEAR(std::abs(roots.poles[0].value - std::complex<double>(0.6, 0.4)), 0.0, 1e-12);
  EXPECT_NEAR(roots.zeros[0].value.real() + roots.zeros[1].value.real(), 0.9, 1e-12);
}

// Sharp resonances at 0.5 and 2 rad a sample, zeros outside the circle in the first filter: exchanged, they are far
// from where they belong.
Model resonant() {
  return testing::model_of("G1=rational(nb=2,na=2) | f=polynomial(degree=3,range=[-4:4]) | G2=rational(nb=1,na=2)",
                           {0.4, -0.9, 0.8, -1.58, 0.81, 0.5, 3.0, 0.4, -0.5, 1.0, -0.5, 0.75, 0.81});
}

// The true filters with their pole groups exchanged, as an initialiser that is wrong in one place would give them.
Candidate poles_exchanged(const AnyBlock& chain, const DataSet& data) {
  const WienerHammersteinBuilder builder(chain, "test", data, {});
  const Model truth = resonant();
  FilterRoots first = roots_of(truth.parameters.head(5), 2);
  FilterRoots second = roots_of(truth.parameters.tail(4), 1);
  std::swap(first.poles, second.poles);
  return builder.build(filter_parameters(*builder.structure().g_w(), first.zeros, first.poles),
                       filter_parameters(*builder.structure().g_h(), second.zeros, second.poles), "wrong");
}

FitOptions quick() {
  FitOptions options;
  options.refit.covariance = false;
  options.refit.prediction.warmup = 50;
  return options;
}

class RootSearch : public ::testing::Test {
 protected:
  AnyBlock chain_ = parse("G1=rational(nb=2,na=2) | f=polynomial(degree=3) | G2=rational(nb=1,na=2)");
  Record record_ = simulated_record(resonant(), 3000, kNoise, 5);
  Initialiser wrong_ = [](const AnyBlock& chain, const DataSet& data, const InitialiserOptions&) {
    return std::vector<Candidate>{poles_exchanged(chain, data)};
  };
};

TEST_F(RootSearch, LeavesAMinimumThatRefitsCannotLeave) {
  const FitResult alone = fit(chain_, record_, wrong_, quick());
  EXPECT_GT(alone.report.rmse, 1.5 * kNoise) << "the start is no trap, the test shows nothing";
  const FitResult searched = fit(chain_, record_, root_search(wrong_), quick());
  EXPECT_LT(searched.report.rmse, kSuccess * kNoise);
  EXPECT_THAT(searched.trials.front().candidate.how, HasSubstr("exchanged poles"));
}

TEST_F(RootSearch, HandsOnAsManyAsAskedBestFirst) {
  InitialiserOptions options;
  options.prediction.warmup = 50;
  const std::vector<Candidate> found = root_search(wrong_, {.keep = 2})(chain_, record_, options);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_LE(found[0].rmse, found[1].rmse);
}

TEST_F(RootSearch, ChainsItCannotSearchGetTheirCandidatesAsTheyAre) {
  const AnyBlock wiener = parse("G=rational(nb=1,na=2) | f=polynomial(degree=3)");
  const Record record = simulated_record(testing::wiener(), 1000, kNoise, 6);
  const Initialiser split = [](const AnyBlock& chain, const DataSet&, const InitialiserOptions&) {
    return std::vector<Candidate>{{make_model(chain), 1.0, "as it is"}};
  };
  const std::vector<Candidate> found = root_search(split)(wiener, record, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].how, "as it is");
}

TEST_F(RootSearch, RefusesBadOptions) {
  EXPECT_THAT(BLOCKID_MESSAGE(root_search(wrong_, {.starts = 0})), HasSubstr("all other options >= 1"));
  EXPECT_THAT(BLOCKID_MESSAGE(root_search(wrong_, {.rounds = -1})), HasSubstr("must be >= 0"));
}

}  // namespace
}  // namespace blockid
