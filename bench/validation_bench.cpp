// Closed-loop tests: time of the closed form, of a verdict, of the smallest uncertainty to seven digits, beside CSDP.
//
// The programme is first checked against CSDP, where that is installed, and by its own certificate.

#include <blockid/data/error.hpp>
#include <blockid/validation/coprime_factors.hpp>
#include <blockid/validation/csdp_back_end.hpp>
#include <blockid/validation/noise_free_bound.hpp>
#include <blockid/validation/verdict.hpp>

#include <benchmark/benchmark.h>

#include <sys/resource.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

namespace blockid::bench {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kSamples = 500;
/// CSDP ends at a relative gap of 1e-8, ours at 1e-7.
constexpr double kAgreement = 1e-6;

/// An integrator under PI control and its model with a pole at exp(-0.05), after Crowder and de Callafon, section V;
/// the weight makes the uncertainty 0.952 (gain 0.70) or 1.111 (gain 0.60).
UncertaintySignals loop_signals(double gain) {
  const auto polynomial = [](std::initializer_list<double> c) {
    return VectorXd(Eigen::Map<const VectorXd>(c.begin(), static_cast<Index>(c.size())));
  };
  const double pole = std::exp(-0.05);
  const DiscreteTransferFunction plant{polynomial({0.0, 0.1}), polynomial({1.0, -1.0})};
  const DiscreteTransferFunction model{polynomial({0.0, 2.0 * (1.0 - pole)}), polynomial({1.0, -pole})};
  const DiscreteTransferFunction controller{polynomial({1.05, -0.95}), polynomial({1.0, -1.0})};
  const DiscreteTransferFunction weight{polynomial({gain * 0.18 * 0.18}), polynomial({1.0, -1.64, 0.6724})};
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  const VectorXd r = VectorXd::NullaryExpr(kSamples, [&] { return normal(generator); });
  const ClosedLoopRecord record = simulate_closed_loop(plant, controller, r, VectorXd::Zero(kSamples));
  return uncertainty_signals({coprime_factors(model, pole), coprime_factors(controller, pole), weight}, record.u,
                             record.y);
}

const UncertaintySignals& enough() {
  static const UncertaintySignals kSignals = loop_signals(0.70);
  return kSignals;
}

const UncertaintySignals& too_little() {
  static const UncertaintySignals kSignals = loop_signals(0.60);
  return kSignals;
}

double noise_bound() { return 1e-3 * enough().w.cwiseAbs().maxCoeff(); }

/// n samples of v up to the last one, w on the last 200 or fewer.
UncertaintyWindow window_with_past(Index n) {
  const Index count = std::min<Index>(n / 2, 200);
  return cut_window(enough().v, enough().w, kSamples - count, count, n - count);
}

[[noreturn]] void stop(const char* what, double a, double b) {
  std::fprintf(stderr, "validation_bench: %s: %.12g and %.12g\n", what, a, b);
  std::exit(1);
}

/// Stops the program when the certificate does not confirm the value.
double certified(const UncertaintyProgramme& programme, const ProgrammeSolution& solution) {
  const double proven = certified_alpha(programme, noise_bound(), solution.certificate);
  if (!(proven >= solution.value * (1.0 - 2e-7))) stop("value and certificate differ", solution.value, proven);
  return solution.value;
}

/// Stops the program when CSDP finds another value, at 100 parameters.
void check_agreement() {
  static const bool kChecked = [] {
    const UncertaintyProgramme programme = uncertainty_programme(window_with_past(100));
    const double ours = certified(programme, smallest_alpha(programme, noise_bound()));
    if (!csdp_available()) {
      std::fprintf(stderr,
                   "validation_bench: CSDP is not installed, its times and the comparison with it are skipped\n");
      return false;
    }
    const double other = solve_with_csdp(hankel_form(programme, noise_bound())).dual;
    if (!(std::abs(ours - other) <= kAgreement * other)) stop("programme and CSDP differ", ours, other);
    return true;
  }();
  benchmark::DoNotOptimize(kChecked);
}

void closed_form(benchmark::State& state) {
  const VectorXd v = enough().v.head(state.range(0));
  const VectorXd w = enough().w.head(state.range(0));
  const double norm = noise_free_bound(v, w);
  if (std::abs(norm - schur_bound(v, w)) > 1e-3 * norm) stop("triangle and Schur test differ", norm, schur_bound(v, w));
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(noise_free_bound(v, w));
}

void schur(benchmark::State& state) {
  const VectorXd v = enough().v.head(state.range(0));
  const VectorXd w = enough().w.head(state.range(0));
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(schur_bound(v, w));
}

void verdict(benchmark::State& state, const UncertaintySignals& signals, Verdict expected) {
  check_agreement();
  const UncertaintyWindow window = cut_window(signals.v, signals.w, 0, state.range(0), 0);
  for ([[maybe_unused]] auto _ : state) {
    const UncertaintyVerdict result = judge_uncertainty(window, noise_bound());
    if (result.verdict != expected) stop("another verdict", result.noise_needed, result.noise_proven);
  }
}

void verdict_enough(benchmark::State& state) { verdict(state, enough(), Verdict::not_invalidated); }
void verdict_too_little(benchmark::State& state) { verdict(state, too_little(), Verdict::invalidated); }

void smallest_uncertainty(benchmark::State& state) {
  check_agreement();
  const UncertaintyProgramme programme = uncertainty_programme(window_with_past(state.range(0)));
  int iterations = 0;
  for ([[maybe_unused]] auto _ : state) {
    const ProgrammeSolution solution = smallest_alpha(programme, noise_bound());
    certified(programme, solution);
    iterations = solution.iterations;
  }
  state.counters["iterations"] = iterations;
}

double children_time_s() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Processor time of the child.
void csdp(benchmark::State& state) {
  check_agreement();
  if (!csdp_available()) {
    state.SkipWithError("CSDP is not installed");
    return;
  }
  const SemidefiniteProgramme form =
      hankel_form(uncertainty_programme(window_with_past(state.range(0))), noise_bound());
  for ([[maybe_unused]] auto _ : state) {
    const double before = children_time_s();
    benchmark::DoNotOptimize(solve_with_csdp(form).dual);
    state.SetIterationTime(children_time_s() - before);
  }
}

BENCHMARK(closed_form)->Arg(200)->Arg(499)->Unit(benchmark::kMillisecond);
BENCHMARK(schur)->Arg(200)->Arg(499)->Unit(benchmark::kMillisecond);
BENCHMARK(verdict_enough)->Arg(200)->Arg(500)->Unit(benchmark::kMillisecond);
BENCHMARK(verdict_too_little)->Arg(200)->Arg(500)->Unit(benchmark::kMillisecond);
BENCHMARK(smallest_uncertainty)->Arg(100)->Arg(200)->Arg(400)->Arg(499)->Unit(benchmark::kMillisecond);
BENCHMARK(csdp)->Arg(100)->Arg(200)->Arg(400)->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace blockid::bench

BENCHMARK_MAIN();
