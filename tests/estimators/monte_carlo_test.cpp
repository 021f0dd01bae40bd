// Standard deviations against the spread over many noisy experiments.
#include "estimators/dense_twin.hpp"
#include "estimators/systems.hpp"

#include <blockid/estimators/gauges.hpp>
#include <blockid/estimators/refit.hpp>

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace blockid {
namespace {

using testing::Noise;

// A deviation estimated from R runs has the relative deviation 1 / sqrt(2 R): 4 % for 300.
constexpr int kRuns = 300;
// Six of these deviations.
constexpr double kSpread = 0.25;
// Mean of the stated deviations against the bound: their own scatter is averaged out, what is left is the curvature of
// the model at this noise level.
constexpr double kBound = 0.1;

struct Experiments {
  Eigen::VectorXd mean;
  // Empirical deviation of each parameter.
  Eigen::VectorXd spread;
  // Root mean square of the stated deviations.
  Eigen::VectorXd plain;
  Eigen::VectorXd robust;
};

Experiments run(const Model& truth, Index samples, Index batch,
                const std::function<Eigen::VectorXd(Noise&, Index)>& noise) {
  const Index count = truth.parameters.size();
  Noise input(1);
  Record record;
  record.u = input.white(samples);
  const Eigen::VectorXd clean = simulate(truth, record.u);
  Eigen::MatrixXd estimates(kRuns, count);
  Experiments result{Eigen::VectorXd::Zero(count), {}, Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count)};
  for (int i = 0; i < kRuns; ++i) {
    Noise numbers(1000 + static_cast<std::uint64_t>(i));
    record.y = clean + noise(numbers, samples);
    const RefitReport report = refit(truth, record);
    EXPECT_EQ(report.status, FitStatus::converged) << "run " << i << ": " << report.message;
    estimates.row(i) = report.model.parameters.transpose();
    result.plain += report.covariance->standard_deviations.cwiseAbs2() / kRuns;
    CovarianceOptions options;
    options.robust = true;
    options.batch = batch;
    result.robust += covariance(report.model, record, options).standard_deviations.cwiseAbs2() / kRuns;
  }
  result.mean = estimates.colwise().mean();
  result.spread =
      ((estimates.rowwise() - result.mean.transpose()).cwiseAbs2().colwise().sum() / (kRuns - 1)).cwiseSqrt();
  result.plain = result.plain.cwiseSqrt();
  result.robust = result.robust.cwiseSqrt();
  return result;
}

// Deviations of the Cramer-Rao bound from the truth's own Jacobian, zero for held parameters.
Eigen::VectorXd bound(const Model& truth, Index samples, double noise) {
  Record record;
  record.u = Noise(1).white(samples);
  record.y = Eigen::VectorXd::Zero(samples);
  const std::vector<Index> held = gain_gauges(truth.chain, truth.parameters);
  std::vector<Index> free;
  for (Index k = 0; k < truth.parameters.size(); ++k) {
    if (std::find(held.begin(), held.end(), k) == held.end()) free.push_back(k);
  }
  const Eigen::MatrixXd j =
      testing::dense_residuals(truth.chain, record, {}, truth.parameters).jacobian(Eigen::all, free);
  Eigen::VectorXd deviations = Eigen::VectorXd::Zero(truth.parameters.size());
  deviations(free) = noise * (j.transpose() * j).inverse().diagonal().cwiseSqrt();
  return deviations;
}

class WhiteNoiseTest : public ::testing::TestWithParam<int> {};

TEST_P(WhiteNoiseTest, SpreadMeetsTheStatedDeviationsAndTheBound) {
  constexpr double kNoise = 0.05;
  constexpr Index kSamples = 400;
  const Model truth = GetParam() == 0   ? testing::linear()
                      : GetParam() == 1 ? testing::hammerstein()
                                        : testing::wiener_hammerstein();
  const Experiments found = run(truth, kSamples, 20, [](Noise& numbers, Index n) { return numbers.white(n, kNoise); });
  const Eigen::VectorXd expected = bound(truth, kSamples, kNoise);
  for (Index k = 0; k < expected.size(); ++k) {
    SCOPED_TRACE(truth.chain.parameter_names()[static_cast<std::size_t>(k)]);
    if (expected[k] == 0.0) {
      EXPECT_EQ(found.spread[k], 0.0);
      EXPECT_EQ(found.plain[k], 0.0);
      continue;
    }
    EXPECT_NEAR(found.spread[k] / expected[k], 1.0, kSpread);
    EXPECT_NEAR(found.spread[k] / found.plain[k], 1.0, kSpread);
    EXPECT_NEAR(found.plain[k] / expected[k], 1.0, kBound);
    // The sandwich knows less and is right as well; its bias from few batches is below a tenth.
    EXPECT_NEAR(found.spread[k] / found.robust[k], 1.0, kSpread + 0.1);
    EXPECT_NEAR(found.mean[k], truth.parameters[k], 6.0 * expected[k] / std::sqrt(1.0 * kRuns));
  }
}

INSTANTIATE_TEST_SUITE_P(All, WhiteNoiseTest, ::testing::Values(0, 1, 2), [](const auto& instance) {
  return std::string(instance.param == 0 ? "linear" : instance.param == 1 ? "hammerstein" : "wiener_hammerstein");
});

TEST(ColouredNoiseTest, TheSandwichIsCloserToTheSpread) {
  // Noise that lasts ten samples hits the constant hardest: its variance grows by (1 + pole) / (1 - pole) = 19. Its
  // true value 0 keeps the uncertainty of the filter's gain out of it.
  const Model truth =
      testing::model_of("f=polynomial(degree=1,range=[-4:4]) | G=rational(nb=1,na=2)", {0.0, 2.0, 1.0, 0.6, -1.2, 0.5});
  const Experiments found =
      run(truth, 2000, 100, [](Noise& numbers, Index n) { return numbers.coloured(n, 0.9, 0.05); });
  const Index constant = parameter_index(truth, "f.c0");
  EXPECT_GT(found.spread[constant], 2.0 * found.plain[constant]) << "the colour must matter, or nothing is tested";
  double plain = 0.0;
  double robust = 0.0;
  for (Index k = 0; k < truth.parameters.size(); ++k) {
    if (found.plain[k] == 0.0) continue;
    plain += std::abs(std::log(found.plain[k] / found.spread[k]));
    robust += std::abs(std::log(found.robust[k] / found.spread[k]));
    // Twenty batches for five directions leave a bias of about a tenth on top of the scatter of the spread.
    EXPECT_NEAR(found.robust[k] / found.spread[k], 1.0, 0.35) << "parameter " << k;
  }
  EXPECT_LT(robust, 0.5 * plain);
}

}  // namespace
}  // namespace blockid
