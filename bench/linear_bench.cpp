// Linear estimators: time of a sample on line, and of whole records.
//
// Contenders are first checked against each other.

#include <blockid/estimators/recursive_trends.hpp>
#include <blockid/estimators/trend_fit.hpp>
#include <blockid/problems/gaussian.hpp>
#include <blockid/problems/janiszowski.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace blockid::bench {
namespace {

constexpr double kSampleTime = 1e-3;
constexpr Index kSamples = 100'000;
/// Batch by Householder, recursion by plane rotations: both exact up to rounding, in standard deviations.
constexpr double kAgreement = 1e-6;

const Record& servo() {
  static const Record kRecord = [] {
    Record result;
    result.u = problems::two_tones(kSamples, kSampleTime);
    result.y = problems::servo_response(result.u, kSampleTime).velocity_mm_s + problems::Gaussian(1).vector(kSamples);
    result.sample_time_s = kSampleTime;
    return result;
  }();
  return kRecord;
}

TrendStructure structure_of(TrendScheme scheme) { return full_trends(scheme, 1, 2); }

/// Stops the program when recursion and batch differ.
void check_agreement(TrendScheme scheme) {
  const Record& record = servo();
  const TrendFit batch = fit_trends(record, structure_of(scheme));
  RecursiveTrends recursion(structure_of(scheme), kSampleTime);
  for (Index k = 0; k < kSamples; ++k) recursion.update(record.u[k], record.y[k]);
  const Eigen::Vector4d expected(batch.a[1], batch.a[0], batch.b[1], batch.b[0]);
  const Eigen::Vector4d deviation = batch.covariance.diagonal().cwiseSqrt();
  const double distance = ((recursion.estimate() - expected).array() / deviation.array()).abs().maxCoeff();
  if (!(distance <= kAgreement)) {
    std::fprintf(stderr, "linear_bench: recursion and batch differ by %g standard deviations\n", distance);
    std::exit(1);
  }
}

/// One sample in, one estimate out.
void recursive_trends_sample(benchmark::State& state, TrendScheme scheme) {
  check_agreement(scheme);
  const Record& record = servo();
  RecursiveTrends recursion(structure_of(scheme), kSampleTime, 0.999);
  Eigen::VectorXd theta(4);
  Index k = 0;
  for ([[maybe_unused]] auto _ : state) {
    if (recursion.update(record.u[k], record.y[k])) recursion.least_squares().estimate({theta.data(), 4});
    benchmark::DoNotOptimize(theta.data());
    if (++k == kSamples) k = 0;
  }
}

void batch_trends(benchmark::State& state, TrendScheme scheme) {
  check_agreement(scheme);
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(fit_trends(servo(), structure_of(scheme)).a.data());
}

BENCHMARK_CAPTURE(recursive_trends_sample, goodwin, TrendScheme::goodwin);
BENCHMARK_CAPTURE(recursive_trends_sample, tustin, TrendScheme::tustin);
BENCHMARK_CAPTURE(batch_trends, goodwin, TrendScheme::goodwin)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(batch_trends, tustin, TrendScheme::tustin)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace blockid::bench

BENCHMARK_MAIN();
