// Fits of noisy responses beside relaxed vector fitting, AAA and maximum likelihood that starts at the truth.
#include <blockid/estimators/frequency_fit.hpp>

#include "support/rational_rivals.hpp"

#include <blockid/problems/welsh_goodwin.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace blockid {
namespace {

using problems::ResonantProblem;

constexpr double kNoise = 0.01;
constexpr int kRuns = 50;
constexpr Index kOrder = 18;
constexpr int kVectorFittingIterations = 20;
/// Paired sign test against the truth: were vector fitting as near to it as maximum likelihood, each of 50 runs would
/// be a coin, and 16 or fewer runs in which ours is nearer have a probability of 0.8 %.
constexpr int kLeastNearer = 17;

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

/// Errors of models against the truth on a dense grid.
class Judge {
 public:
  explicit Judge(const ResonantProblem& problem)
      : grid_(break_points(problem.data.omega_rad_s[0], problem.data.omega_rad_s.tail(1)[0], 1000)),
        truth_(problems::response_at(problem.modes, grid_)) {}

  const Eigen::VectorXd& grid() const { return grid_; }
  /// sqrt(mean |Ghat / G - 1|^2)
  double operator()(const Eigen::VectorXcd& g) const {
    return std::sqrt(((g - truth_).array() / truth_.array()).abs2().mean());
  }

 private:
  Eigen::VectorXd grid_;
  Eigen::VectorXcd truth_;
};

TEST(Rivals, FindTheSystemWithoutNoise) {
  // What they are worth as rivals: both are exact but for rounding, which over nine decades costs them some digits.
  const ResonantProblem problem = problems::welsh_goodwin();
  const Judge judge(problem);
  const Eigen::VectorXd weights = problem.data.response.cwiseAbs().cwiseInverse();
  const testing::VectorFitting vector =
      testing::vector_fitting(problem.data, weights, kOrder, kVectorFittingIterations);
  EXPECT_LT(judge(testing::response_at(vector.model, judge.grid())), 1e-7);
  EXPECT_LT(judge(testing::response_at(testing::aaa(problem.data, 1e-12, 40), judge.grid())), 1e-9);
  EXPECT_LT(judge(response_at(fit_frequency_response(problem.data, kOrder - 1, kOrder).model, judge.grid())), 1e-12);
}

class AgainstRivals : public ::testing::TestWithParam<Index> {};

TEST_P(AgainstRivals, OnePercentOfNoise) {
  const ResonantProblem problem = problems::welsh_goodwin(GetParam());
  const RationalBasis basis = localising_basis(problem.break_points_rad_s, kOrder - 1);
  const Judge judge(problem);
  FrequencyFitOptions plain;
  plain.method = FrequencyMethod::least_squares;
  plain.weighting = FrequencyWeighting::none;
  const FrequencyFit exact = fit_frequency_response(problem.data, basis, plain);
  FrequencyFitOptions from_truth;
  from_truth.start.resize(2 * kOrder);
  from_truth.start << exact.model.denominator, exact.model.numerator;

  std::map<std::string, std::vector<double>> errors;
  for (int run = 1; run <= kRuns; ++run) {
    const FrequencyResponse data = problems::with_relative_noise(problem.data, kNoise, static_cast<std::uint64_t>(run));
    const auto fitted = [&](FrequencyMethod method) {
      FrequencyFitOptions options;
      options.method = method;
      const FrequencyFit fit = fit_frequency_response(data, basis, options);
      EXPECT_FALSE(fit.flags.unstable) << to_text(method) << ", run " << run;
      errors[to_text(method)].push_back(judge(response_at(fit.model, judge.grid())));
      return fit.cost;
    };
    fitted(FrequencyMethod::sanathanan_koerner);
    fitted(FrequencyMethod::instrumental_variables);
    const double cost = fitted(FrequencyMethod::maximum_likelihood);
    errors["oracle"].push_back(judge(response_at(fit_frequency_response(data, basis, from_truth).model, judge.grid())));
    const Eigen::VectorXd weights = data.response.cwiseAbs().cwiseInverse();
    const testing::VectorFitting rival = testing::vector_fitting(data, weights, kOrder, kVectorFittingIterations);
    errors["rival"].push_back(judge(testing::response_at(rival.model, judge.grid())));
    const Eigen::VectorXcd residual =
        weights.asDiagonal() * (testing::response_at(rival.model, data.omega_rad_s) - data.response);
    // Both have the same number of parameters; ours is at a minimum, whose rounding is far below 1e-9 of the cost.
    EXPECT_LE(cost, (1.0 + 1e-9) * residual.squaredNorm()) << "run " << run;
  }
  const double oracle = median(errors["oracle"]);
  for (const char* method : {"sk", "iv", "ml"}) {
    EXPECT_NEAR(median(errors[method]), oracle, 0.03 * oracle) << method;
  }
  int nearer = 0;
  for (std::size_t run = 0; run < errors["ml"].size(); ++run)
    nearer += errors["ml"][run] < errors["rival"][run] ? 1 : 0;
  EXPECT_GE(nearer, kLeastNearer);
}

INSTANTIATE_TEST_SUITE_P(Tones, AgainstRivals, ::testing::Values(36, 360));

}  // namespace
}  // namespace blockid
