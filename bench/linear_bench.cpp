// Linear estimators: time of a sample on line, and of whole records.
//
// Contenders are first checked against each other. What scipy needs for the same is timed where it is found.

#include <blockid/estimators/continuous_fit.hpp>
#include <blockid/estimators/recursive_trends.hpp>
#include <blockid/estimators/trend_fit.hpp>
#include <blockid/problems/garnier2004.hpp>
#include <blockid/problems/gaussian.hpp>
#include <blockid/problems/janiszowski.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>

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

// ------------------------------------------------------------------------------------ continuous time, eighth order

/// cond(X'X) of exact regressors, columns of unit norm; a cubic hold keeps five digits of it.
constexpr double kCondition = 1241.8778;
constexpr double kConditionTolerance = 1e-5;
/// Tustin's rule keeps three.
constexpr double kRivalTolerance = 1e-3;

const Record& resonant() {
  static const Record kRecord = problems::garnier2004_record();
  return kRecord;
}
/// With noise at 20 dB, so that the refined method has something to iterate for.
const Record& noisy_resonant() {
  static const Record kRecord = [] {
    problems::Garnier2004Experiment experiment;
    experiment.snr_db = 20.0;
    return problems::garnier2004_record(experiment);
  }();
  return kRecord;
}
RationalBasis localising() { return localising_basis(problems::garnier2004_break_points(), 7); }

ContinuousFitOptions options_of(ContinuousMethod method) {
  ContinuousFitOptions options;
  options.method = method;
  return options;
}

void stop(const char* what, double value) {
  std::fprintf(stderr, "linear_bench: %s: %g\n", what, value);
  std::exit(1);
}

/// Largest distance of a true pole from the nearest of the model, relative to the true one.
double pole_error(const ContinuousFit& fit) {
  const Eigen::VectorXcd found = poles(fit.model);
  double worst = 0.0;
  for (const std::complex<double>& pole : problems::garnier2004_poles()) {
    worst = std::max(worst, (found.array() - pole).abs().minCoeff() / std::abs(pole));
  }
  return worst;
}

/// Stops the program when the condition number is not the exact one, or the refined method off the truth by more than
/// the slowest mode is uncertain: 3e-3 at 20 dB, five of it.
void check_continuous() {
  const ContinuousFit plain = fit_continuous(resonant(), localising(), options_of(ContinuousMethod::least_squares));
  const double off = std::abs(plain.condition_normalised / kCondition - 1.0);
  if (!(off <= kConditionTolerance)) stop("condition number is off by", off);
  if (!(pole_error(plain) <= 2e-7)) stop("least squares: poles are off by", pole_error(plain));
  const ContinuousFit refined =
      fit_continuous(noisy_resonant(), localising(), options_of(ContinuousMethod::refined_instrumental_variables));
  if (refined.flags.not_converged || !(pole_error(refined) <= 1.5e-2)) {
    stop("refined instrumental variables: poles are off by", pole_error(refined));
  }
}

void continuous_fit(benchmark::State& state, const Record& (*record)(), ContinuousMethod method) {
  static const bool kChecked = (check_continuous(), true);
  benchmark::DoNotOptimize(kChecked);
  const RationalBasis basis = localising();
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(fit_continuous(record(), basis, options_of(method)).rms);
  }
}

BENCHMARK_CAPTURE(continuous_fit, localising_least_squares, resonant, ContinuousMethod::least_squares)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(continuous_fit, refined_instrumental_variables, noisy_resonant,
                  ContinuousMethod::refined_instrumental_variables)
    ->Unit(benchmark::kMillisecond);

void write_numbers(const std::string& path, const Eigen::VectorXd& values) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * 8));
}

/// Least squares over localising filters in scipy, its best time in seconds; negative when scipy is not found.
double scipy_seconds(const std::string& script) {
  const std::string base = "/tmp/blockid_linear_bench_" + std::to_string(static_cast<long>(std::time(nullptr)));
  write_numbers(base + ".u", resonant().u);
  write_numbers(base + ".y", resonant().y);
  std::ofstream points(base + ".points");
  points.precision(17);
  points << resonant().sample_time_s << ' ' << problems::garnier2004_break_points().transpose() << '\n';
  points.close();
  double best = -1.0;
  double condition = 0.0;
  FILE* pipe = popen(("python3 '" + script + "' '" + base + "' 2>/dev/null").c_str(), "r");
  if (pipe == nullptr || std::fscanf(pipe, "%lf %lf", &best, &condition) != 2) best = -1.0;
  if (pipe != nullptr) pclose(pipe);
  for (const char* ending : {".u", ".y", ".points"}) std::remove((base + ending).c_str());
  const double off = std::abs(condition / kCondition - 1.0);
  if (best > 0.0 && !(off <= kRivalTolerance)) stop("scipy's condition number is off by", off);
  return best;
}

void report_rival(const std::string& script) {
  const double seconds = scipy_seconds(script);
  if (seconds > 0.0) {
    std::printf("least squares over localising filters, 190986 samples, scipy: %.0f ms\n", 1e3 * seconds);
  } else {
    std::printf("scipy contender skipped: python3 with numpy and scipy was not found\n");
  }
}

}  // namespace
}  // namespace blockid::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return EXIT_FAILURE;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  blockid::bench::report_rival(BLOCKID_BENCH_SCIPY_LOCALISING);
  return EXIT_SUCCESS;
}
