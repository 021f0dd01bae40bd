// Fits of a noisy frequency response over nine decades: ours beside relaxed vector fitting and AAA.
//
// Counters tell the accuracy over 50 noise draws of 1 %: median of the relative error on a dense grid, and the share of
// unstable models. Ours must not have a larger cost than vector fitting on any draw.

#include "support/rational_rivals.hpp"

#include <blockid/estimators/frequency_fit.hpp>
#include <blockid/problems/welsh_goodwin.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

namespace blockid::bench {
namespace {

constexpr Index kOrder = 18;
constexpr double kNoise = 0.01;
constexpr int kRuns = 50;
constexpr int kVectorFittingIterations = 20;
/// Rounding of a cost.
constexpr double kSlack = 1.0 + 1e-9;

/// A fitted model: its response, and whether all poles lie in the left half plane.
struct Fitted {
  std::function<Eigen::VectorXcd(const Eigen::VectorXd& omega)> response;
  bool stable = true;
};
using Contender = std::function<Fitted(const problems::ResonantProblem&, const FrequencyResponse& data)>;

Contender ours(FrequencyMethod method) {
  return [method](const problems::ResonantProblem& problem, const FrequencyResponse& data) -> Fitted {
    FrequencyFitOptions options;
    options.method = method;
    const FrequencyFit fit =
        fit_frequency_response(data, localising_basis(problem.break_points_rad_s, kOrder - 1), options);
    return {[model = fit.model](const Eigen::VectorXd& omega) { return response_at(model, omega); },
            !fit.flags.unstable};
  };
}

Fitted vector_fitting(const problems::ResonantProblem&, const FrequencyResponse& data) {
  const testing::VectorFitting fit =
      testing::vector_fitting(data, data.response.cwiseAbs().cwiseInverse(), kOrder, kVectorFittingIterations);
  return {[model = fit.model](const Eigen::VectorXd& omega) { return testing::response_at(model, omega); },
          (fit.model.poles.real().array() < 0.0).all()};
}

/// Degree at which AAA ends at the latest: its cost grows like the cube.
constexpr Index kMostDegree = 79;

/// Down to the noise, as its users set the tolerance.
Fitted aaa(const problems::ResonantProblem&, const FrequencyResponse& data) {
  const testing::BarycentricModel model = testing::aaa(data, kNoise, std::min(data.response.size() - 2, kMostDegree));
  return {[model](const Eigen::VectorXd& omega) { return testing::response_at(model, omega); },
          (testing::poles(model).real().array() < 0.0).all()};
}

FrequencyResponse drawn(const problems::ResonantProblem& problem, int run) {
  return problems::with_relative_noise(problem.data, kNoise, static_cast<std::uint64_t>(run));
}

double relative_cost(const Fitted& fitted, const FrequencyResponse& data) {
  return ((fitted.response(data.omega_rad_s) - data.response).array() / data.response.array()).abs2().sum();
}

/// Stops the program when vector fitting comes nearer to the data.
void check_costs(const problems::ResonantProblem& problem) {
  for (int run = 1; run <= kRuns; ++run) {
    const FrequencyResponse data = drawn(problem, run);
    const double own = relative_cost(ours(FrequencyMethod::maximum_likelihood)(problem, data), data);
    const double rival = relative_cost(vector_fitting(problem, data), data);
    if (own <= kSlack * rival) continue;
    std::fprintf(stderr, "linear_bench: cost %.9g of ours above %.9g of vector fitting, draw %d\n", own, rival, run);
    std::exit(1);
  }
}

void count_accuracy(benchmark::State& state, const problems::ResonantProblem& problem, const Contender& contender) {
  const Eigen::VectorXd grid = break_points(problem.data.omega_rad_s[0], problem.data.omega_rad_s.tail(1)[0], 1000);
  const Eigen::VectorXcd truth = problems::response_at(problem.modes, grid);
  std::vector<double> errors;
  int unstable = 0;
  for (int run = 1; run <= kRuns; ++run) {
    const Fitted fitted = contender(problem, drawn(problem, run));
    errors.push_back(std::sqrt(((fitted.response(grid) - truth).array() / truth.array()).abs2().mean()));
    unstable += fitted.stable ? 0 : 1;
  }
  std::sort(errors.begin(), errors.end());
  state.counters["relative_error"] = 0.5 * (errors[kRuns / 2 - 1] + errors[kRuns / 2]);
  state.counters["unstable"] = static_cast<double>(unstable) / kRuns;
}

void noisy_response(benchmark::State& state, const Contender& contender) {
  const problems::ResonantProblem problem = problems::welsh_goodwin(state.range(0));
  check_costs(problem);
  const FrequencyResponse data = drawn(problem, 1);
  for ([[maybe_unused]] auto _ : state) {
    const Fitted fitted = contender(problem, data);
    benchmark::DoNotOptimize(&fitted);
  }
  count_accuracy(state, problem, contender);
}

void tones(benchmark::internal::Benchmark* benchmark) { benchmark->Arg(36)->Arg(360)->Unit(benchmark::kMillisecond); }

BENCHMARK_CAPTURE(noisy_response, sanathanan_koerner, ours(FrequencyMethod::sanathanan_koerner))->Apply(tones);
BENCHMARK_CAPTURE(noisy_response, instrumental_variables, ours(FrequencyMethod::instrumental_variables))->Apply(tones);
BENCHMARK_CAPTURE(noisy_response, maximum_likelihood, ours(FrequencyMethod::maximum_likelihood))->Apply(tones);
BENCHMARK_CAPTURE(noisy_response, relaxed_vector_fitting, vector_fitting)->Apply(tones);
BENCHMARK_CAPTURE(noisy_response, aaa, aaa)->Apply(tones);

}  // namespace
}  // namespace blockid::bench
