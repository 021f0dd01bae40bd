// Properties that the generators of systems promise.
#include <blockid/blocks/rational.hpp>
#include <blockid/data/error.hpp>
#include <blockid/problems/catalogue.hpp>
#include <blockid/problems/giordano_sjoberg.hpp>
#include <blockid/problems/random_wh.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace blockid::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::uint64_t kSeeds = 40;

/// |roots| of c_0 + c_1 q^-1 + ... by the companion matrix.
Eigen::VectorXd radii(const Eigen::VectorXd& c) {
  const Eigen::Index n = c.size() - 1;
  if (n == 0) return {};
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  companion.row(0) = -c.tail(n).transpose() / c[0];
  companion.diagonal(-1).setOnes();
  return Eigen::EigenSolver<Eigen::MatrixXd>(companion, false).eigenvalues().cwiseAbs();
}

struct Radii {
  Eigen::VectorXd poles;
  Eigen::VectorXd zeros;
};

Radii filter_radii(const Model& model, std::size_t child) {
  const ChildParameters part = top_level_blocks(model)[child];
  const auto* filter = part.block.target<Rational>();
  const std::span<const double> theta(part.parameters.data(), static_cast<std::size_t>(part.parameters.size()));
  return {radii(filter->denominator(theta)), radii(filter->numerator(theta))};
}

double variance(const Eigen::VectorXd& x) { return (x.array() - x.mean()).square().mean(); }

RandomWienerHammersteinOptions options_of(StaticKind kind, std::uint64_t seed) {
  RandomWienerHammersteinOptions options;
  options.order = 2 + static_cast<Eigen::Index>(seed % 3);
  options.static_kind = kind;
  options.seed = seed;
  return options;
}

class RandomWienerHammerstein : public ::testing::TestWithParam<StaticKind> {};

// Roots of a polynomial of degree 4 come out of an eigenvalue solver to about eps^(1/4) when all coincide.
constexpr double kRootTolerance = 1e-3;

TEST_P(RandomWienerHammerstein, RootsKeepToTheirRadii) {
  int outside = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Model truth = random_wiener_hammerstein(options_of(GetParam(), seed)).truth.value();
    for (const std::size_t child : {0U, 2U}) {
      const Radii r = filter_radii(truth, child);
      EXPECT_LE(r.poles.maxCoeff(), 0.9 + kRootTolerance) << seed;
      EXPECT_GE(r.poles.minCoeff(), 0.3 - kRootTolerance) << seed;
      EXPECT_LE(r.zeros.maxCoeff(), 1.0 / 0.3 + 10.0 * kRootTolerance) << seed;
      EXPECT_EQ((r.zeros.array() > 0.91 && r.zeros.array() < 1.1).count(), 0) << seed;
      outside += static_cast<int>((r.zeros.array() > 1.0).count());
    }
  }
  EXPECT_GT(outside, 0) << "some zeros lie outside the circle";
}

TEST_P(RandomWienerHammerstein, StaticBlockIsNonlinearOverItsSignal) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Problem problem = random_wiener_hammerstein(options_of(GetParam(), seed));
    const std::vector<Eigen::VectorXd> signals = simulate_signals(*problem.truth, problem.train.records[0].u);
    const Eigen::VectorXd v = signals[1].array() - signals[1].mean();
    const Eigen::VectorXd w = signals[2].array() - signals[2].mean();
    const double slope = v.dot(w) / v.squaredNorm();
    EXPECT_GT(variance(w - slope * v), 0.01 * variance(w)) << seed;
    EXPECT_GT(std::abs(slope), 0.1) << seed;
    // Effective number of independent samples: 5000 over a correlation length below 1 / (1 - 0.9) = 10, four deviations
    // of the sample variance: 4 sqrt(2 / 500).
    EXPECT_NEAR(variance(v), 1.0, 0.26) << seed;
  }
}

TEST_P(RandomWienerHammerstein, NoiseHasTheWantedLevel) {
  // The sample deviation of 5000 numbers: 1 / sqrt(2 * 5000) = 0.01; five of these.
  constexpr double kTolerance = 0.05;
  for (const double snr_db : {20.0, 40.0}) {
    RandomWienerHammersteinOptions options = options_of(GetParam(), 7);
    options.snr_db = snr_db;
    const Problem problem = random_wiener_hammerstein(options);
    for (const DataSet& data : {problem.train, problem.test}) {
      const Eigen::VectorXd clean = simulate(*problem.truth, data.records[0].u);
      const double noise = std::sqrt(variance(data.records[0].y - clean));
      EXPECT_NEAR(noise / problem.noise_std, 1.0, kTolerance);
    }
    const Eigen::VectorXd clean = simulate(*problem.truth, problem.train.records[0].u);
    EXPECT_NEAR(10.0 * std::log10(variance(clean)) - 20.0 * std::log10(problem.noise_std), snr_db, 1e-9);
  }
}

TEST_P(RandomWienerHammerstein, SeedsDecide) {
  const Problem a = random_wiener_hammerstein(options_of(GetParam(), 3));
  const Problem b = random_wiener_hammerstein(options_of(GetParam(), 3));
  RandomWienerHammersteinOptions other = options_of(GetParam(), 3);
  other.seed = 4;
  const Problem c = random_wiener_hammerstein(other);
  EXPECT_EQ(a.train.records[0].y, b.train.records[0].y);
  EXPECT_EQ(a.truth->parameters, b.truth->parameters);
  EXPECT_NE(a.truth->parameters, c.truth->parameters);
  EXPECT_NE(a.train.records[0].u, a.test.records[0].u);
}

INSTANTIATE_TEST_SUITE_P(Kinds, RandomWienerHammerstein, ::testing::ValuesIn(static_kinds()),
                         [](const auto& kind) { return to_text(kind.param); });

TEST(RandomWienerHammersteinErrors, NameWhatCame) {
  RandomWienerHammersteinOptions options;
  options.order = 0;
  EXPECT_THAT([&] { random_wiener_hammerstein(options); }, ThrowsMessage<Error>(HasSubstr("got 0")));
  options = {};
  options.samples = 0;
  EXPECT_THAT([&] { random_wiener_hammerstein(options); }, ThrowsMessage<Error>(HasSubstr("got 0 and 5000")));
  options = {};
  options.snr_db = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT([&] { random_wiener_hammerstein(options); }, ThrowsMessage<Error>(HasSubstr("not a number")));
}

TEST(ShortWienerHammerstein, IsNoiseFreeNormalisedAndStable) {
  for (std::uint64_t index = 0; index < 256; ++index) {
    const Problem problem = short_wiener_hammerstein(index);
    const Record& train = problem.train.records[0];
    ASSERT_EQ(train.u.size(), 400);
    EXPECT_NEAR(variance(train.y), 1.0, 1e-10) << index;
    // Scaling after simulation and simulation of the scaled model differ by rounding of a few hundred operations.
    EXPECT_LT((simulate(*problem.truth, train.u) - train.y).cwiseAbs().maxCoeff(), 1e-10) << index;
    for (const std::size_t child : {0U, 2U}) {
      EXPECT_LT(filter_radii(*problem.truth, child).poles.maxCoeff(), 0.95) << index;
    }
  }
}

TEST(TrueStructure, HasTheParametersOfTheTruth) {
  for (const StaticKind kind : static_kinds()) {
    const Problem problem = random_wiener_hammerstein(options_of(kind, 2));
    EXPECT_EQ(true_structure(problem).parameter_names(), problem.truth->chain.parameter_names());
  }
  Problem unknown;
  unknown.name = "unknown";
  EXPECT_THAT([&] { true_structure(unknown); }, ThrowsMessage<Error>(HasSubstr("'unknown' has no known truth")));
}

TEST(GiordanoSjoberg, HasThePapersSignals) {
  const Problem problem = giordano_sjoberg();
  const Record& train = problem.train.records[0];
  ASSERT_EQ(train.u.size(), 3000);
  // Five deviations of a sample deviation: 5 / sqrt(2 * 3000) = 0.065.
  EXPECT_NEAR(std::sqrt(variance(train.u)) / 5.0, 1.0, 0.065);
  EXPECT_NEAR(std::sqrt(variance(train.y - simulate(*problem.truth, train.u))) / 0.1, 1.0, 0.065);
  const Radii g1 = filter_radii(*problem.truth, 0);
  EXPECT_NEAR(g1.zeros[0], 0.5, 1e-12);
  EXPECT_NEAR(g1.poles.maxCoeff(), std::hypot(0.5, 0.4), 1e-12);
  EXPECT_NEAR(filter_radii(*problem.truth, 2).poles.maxCoeff(), std::hypot(0.2, 0.6), 1e-12);
}

TEST(Catalogue, SyntheticEntriesLoadAndPassTheirChecks) {
  for (const CatalogueEntry& entry : catalogue()) {
    if (entry.measured) continue;
    const Problem problem = entry.load();
    EXPECT_NO_THROW(check(problem.train)) << entry.name;
    EXPECT_NO_THROW(check(problem.test)) << entry.name;
    EXPECT_TRUE(problem.truth) << entry.name;
  }
}

TEST(Catalogue, UnknownNamesAreErrorsThatListTheKnown) {
  EXPECT_EQ(catalogue_entry("silverbox").name, "silverbox");
  EXPECT_THAT([] { catalogue_entry("goldbox"); }, ThrowsMessage<Error>(HasSubstr("'goldbox'; expected wh2009, ")));
}

}  // namespace
}  // namespace blockid::problems
