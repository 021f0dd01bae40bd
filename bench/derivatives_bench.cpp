// Derivatives of a Wiener-Hammerstein predictor, several ways side by side.
//
// Every contender is first checked against the analytic Jacobian. After the benchmarks the program measures the ratios
// that the project holds itself to, contenders taking turns, and prints them; --bars makes a missed bar an error.

#include "wiener_hammerstein_case.hpp"

#include <blockid/blocks/detail/kernels.hpp>
#include <blockid/estimators/predictor.hpp>

#include <benchmark/benchmark.h>
#include <ceres/jet.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <string>

#include <ctime>

namespace blockid::bench {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr Index kSamples = 100'000;
constexpr std::size_t kJetTile = 256;
/// Analytic against Jets: both exact up to rounding that the recursions amplify a little.
constexpr double kExactTolerance = 1e-9;
/// Forward differences with a step of 1e-7 keep about six digits.
constexpr double kDifferenceTolerance = 1e-4;

const WienerHammersteinCase& the_case() {
  static const WienerHammersteinCase kInstance(kSamples);
  return kInstance;
}

const Predictor& the_predictor() {
  static const Predictor kInstance(the_case().chain, the_case().data);
  return kInstance;
}

struct Rows {
  Eigen::VectorXd r = Eigen::VectorXd(kSamples);
  RowMajor jacobian = RowMajor(kSamples, 20);
};

void analytic(Rows& rows) {
  if (!the_predictor().jacobian(the_case().theta, rows.r.data(), rows.jacobian.data())) std::abort();
}

double residual_alone() { return the_predictor().sum_of_squares(the_case().theta); }

NormalEquations compressed() {
  NormalEquations sums(21);
  if (!the_predictor().accumulate(the_case().theta, sums)) std::abort();
  return sums;
}

/// Jets of `Stride` derivatives, as many passes as it takes; tile = samples of a pass kept together.
template <int Stride>
void jets(Rows& rows, std::size_t tile) {
  using Jet = ceres::Jet<double, Stride>;
  const WienerHammersteinCase& c = the_case();
  const Record& record = c.data.records.front();
  std::vector<Jet> p(20);
  std::vector<Jet> y(static_cast<std::size_t>(kSamples));
  for (int first = 0; first < 20; first += Stride) {
    for (int k = 0; k < 20; ++k) {
      const bool seeded = k >= first && k < first + Stride;
      p[static_cast<std::size_t>(k)] = seeded ? Jet(c.theta[k], k - first) : Jet(c.theta[k]);
    }
    c.apply<Jet>(p, {record.u.data(), static_cast<std::size_t>(kSamples)}, y, tile);
    for (Index t = 0; t < kSamples; ++t) {
      const Jet& value = y[static_cast<std::size_t>(t)];
      rows.r[t] = record.y[t] - value.a;
      for (int k = 0; k < Stride && first + k < 20; ++k) rows.jacobian(t, first + k) = -value.v[k];
    }
  }
}

void finite_differences(Rows& rows) {
  const WienerHammersteinCase& c = the_case();
  const Predictor& predictor = the_predictor();
  predictor.residuals(c.theta, rows.r.data());
  Eigen::VectorXd moved(kSamples);
  for (Index k = 0; k < 20; ++k) {
    Eigen::VectorXd p = c.theta;
    const double step = 1e-7 * std::max(std::abs(p[k]), 1e-2);
    p[k] += step;
    predictor.residuals(p, moved.data());
    rows.jacobian.col(k) = (moved - rows.r) / step;
  }
}

double relative_difference(const RowMajor& a, const RowMajor& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

void require(bool agreed, const std::string& contender, double difference) {
  if (agreed) return;
  std::cerr << contender << " disagrees with the analytic Jacobian: relative difference " << difference << "\n";
  std::exit(EXIT_FAILURE);
}

/// All contenders against the analytic Jacobian, once, before anything is timed.
void check_agreement() {
  Rows reference;
  analytic(reference);
  const auto check = [&](const std::string& name, const std::function<void(Rows&)>& run, double tolerance) {
    Rows rows;
    run(rows);
    const double difference = relative_difference(rows.jacobian, reference.jacobian);
    require(difference < tolerance, name, difference);
  };
  check(
      "Jets, stride 4", [](Rows& r) { jets<4>(r, kJetTile); }, kExactTolerance);
  check(
      "Jets, stride 8", [](Rows& r) { jets<8>(r, kJetTile); }, kExactTolerance);
  check(
      "Jets, stride 16", [](Rows& r) { jets<16>(r, kJetTile); }, kExactTolerance);
  check(
      "Jets, stride 20", [](Rows& r) { jets<20>(r, kJetTile); }, kExactTolerance);
  check(
      "whole-record Jets", [](Rows& r) { jets<20>(r, kSamples); }, kExactTolerance);
  check("finite differences", finite_differences, kDifferenceTolerance);
  const Eigen::MatrixXd gram = compressed().gram();
  const Eigen::MatrixXd normal = reference.jacobian.transpose() * reference.jacobian;
  const double difference = (gram.topLeftCorner(20, 20) - normal).norm() / normal.norm();
  require(difference < kExactTolerance, "compressed J'J", difference);
  const double sum = reference.r.squaredNorm();
  require(std::abs(residual_alone() - sum) < kExactTolerance * sum, "residual alone", residual_alone() / sum - 1.0);
}

void bm_residual_alone(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(residual_alone());
}
void bm_analytic_full(benchmark::State& state) {
  Rows rows;
  for ([[maybe_unused]] auto _ : state) analytic(rows);
}
void bm_analytic_compressed(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(compressed());
}
template <int Stride>
void bm_jets(benchmark::State& state) {
  Rows rows;
  for ([[maybe_unused]] auto _ : state) jets<Stride>(rows, static_cast<std::size_t>(state.range(0)));
}
void bm_finite_differences(benchmark::State& state) {
  Rows rows;
  for ([[maybe_unused]] auto _ : state) finite_differences(rows);
}

BENCHMARK(bm_residual_alone)->Unit(benchmark::kMillisecond);
BENCHMARK(bm_analytic_full)->Unit(benchmark::kMillisecond);
BENCHMARK(bm_analytic_compressed)->Unit(benchmark::kMillisecond);
BENCHMARK(bm_jets<4>)->Arg(kJetTile)->Unit(benchmark::kMillisecond);
BENCHMARK(bm_jets<8>)->Arg(kJetTile)->Unit(benchmark::kMillisecond);
BENCHMARK(bm_jets<16>)->Arg(kJetTile)->Unit(benchmark::kMillisecond);
BENCHMARK(bm_jets<20>)->Arg(kJetTile)->Arg(kSamples)->Unit(benchmark::kMillisecond);
BENCHMARK(bm_finite_differences)->Unit(benchmark::kMillisecond);

/// Processor time of this thread: what else runs on the machine counts as little as possible.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double seconds(const std::function<void()>& run) {
  const double start = thread_seconds();
  run();
  return thread_seconds() - start;
}

/// The same chain in scipy on the same input, its best time in seconds and its output; negative when scipy is not
/// found.
double scipy_seconds(const std::string& script) {
  const WienerHammersteinCase& c = the_case();
  const std::string base = "/tmp/blockid_derivatives_bench_" + std::to_string(static_cast<long>(std::time(nullptr)));
  std::ofstream(base + ".u", std::ios::binary)
      .write(reinterpret_cast<const char*>(c.data.records.front().u.data()), kSamples * 8);
  const Eigen::VectorXd powers = c.f.to_powers(c.theta.segment(7, 6));
  std::ofstream numbers(base + ".theta");
  numbers.precision(17);
  numbers << c.theta.head(7).transpose() << "\n" << powers.transpose() << "\n" << c.theta.tail(7).transpose() << "\n";
  numbers.close();
  const std::string command = "python3 '" + script + "' '" + base + "' 2>/dev/null";
  FILE* pipe = popen(command.c_str(), "r");
  double best = -1.0;
  if (pipe == nullptr || std::fscanf(pipe, "%lf", &best) != 1) best = -1.0;
  if (pipe != nullptr) pclose(pipe);
  if (best > 0.0) {
    std::vector<double> output(static_cast<std::size_t>(kSamples));
    std::ifstream(base + ".y", std::ios::binary).read(reinterpret_cast<char*>(output.data()), kSamples * 8);
    Eigen::VectorXd r(kSamples);
    the_predictor().residuals(c.theta, r.data());
    const Eigen::VectorXd ours = c.data.records.front().y - r;
    const double difference = (ours - Eigen::Map<const Eigen::VectorXd>(output.data(), kSamples)).cwiseAbs().maxCoeff();
    require(difference < 1e-8, "scipy chain", difference);
  }
  for (const char* ending : {".u", ".theta", ".y"}) std::remove((base + ending).c_str());
  return best;
}

/// Best times, contenders taking turns so that a change of clock or load meets all of them.
struct Bars {
  double residual = std::numeric_limits<double>::infinity();
  double full = std::numeric_limits<double>::infinity();
  double compressed = std::numeric_limits<double>::infinity();
  double jets = std::numeric_limits<double>::infinity();
};

Bars measure_bars() {
  Bars best;
  Rows rows;
  for (int turn = 0; turn < 15; ++turn) {
    best.residual = std::min(best.residual, seconds([] { benchmark::DoNotOptimize(residual_alone()); }));
    best.full = std::min(best.full, seconds([&] { analytic(rows); }));
    best.compressed = std::min(best.compressed, seconds([] { benchmark::DoNotOptimize(compressed()); }));
    if (turn % 3 != 0) continue;
    best.jets = std::min(best.jets, seconds([&] { jets<4>(rows, kJetTile); }));
    best.jets = std::min(best.jets, seconds([&] { jets<8>(rows, kJetTile); }));
    best.jets = std::min(best.jets, seconds([&] { jets<16>(rows, kJetTile); }));
    best.jets = std::min(best.jets, seconds([&] { jets<20>(rows, kJetTile); }));
    best.jets = std::min(best.jets, seconds([&] { jets<20>(rows, kSamples); }));
  }
  return best;
}

bool print_bar(const char* what, double value, double bar, bool at_most) {
  const bool met = at_most ? value <= bar : value >= bar;
  std::printf("| %-58s | %6.2f | %s %5.1f | %s |\n", what, value, at_most ? "<=" : ">=", bar, met ? "met" : "MISSED");
  return met;
}

bool report_bars(const std::string& script) {
  const Bars best = measure_bars();
  std::printf(
      "\nKernels: %s. Best of 15 turns: residual alone %.3f ms, full Jacobian %.3f ms, compressed %.3f ms, "
      "fastest Jets %.1f ms.\n\n| ratio | measured | bar | |\n|---|---|---|---|\n",
      detail::kernels().name, 1e3 * best.residual, 1e3 * best.full, 1e3 * best.compressed, 1e3 * best.jets);
  bool met = print_bar("full Jacobian / residual alone", best.full / best.residual, 4.0, true);
  met = print_bar("fastest Jets / full Jacobian", best.jets / best.full, 10.0, false) && met;
  met = print_bar("compressed J'J, J'r, r'r / residual alone", best.compressed / best.residual, 5.0, true) && met;
  const double scipy = scipy_seconds(script);
  if (scipy > 0.0) {
    met = print_bar("scipy lfilter + polyval + lfilter / residual alone", scipy / best.residual, 2.0, false) && met;
  } else {
    std::printf("scipy contender skipped: python3 with numpy and scipy was not found\n");
  }
  return met;
}

}  // namespace
}  // namespace blockid::bench

int main(int argc, char** argv) {
  bool bars_are_errors = false;
  int kept = 1;
  for (int k = 1; k < argc; ++k) {
    if (std::strcmp(argv[k], "--bars") == 0) {
      bars_are_errors = true;
    } else {
      argv[kept++] = argv[k];
    }
  }
  argc = kept;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return EXIT_FAILURE;
  blockid::bench::check_agreement();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  const bool met = blockid::bench::report_bars(BLOCKID_BENCH_SCIPY_CHAIN);
  return met || !bars_are_errors ? EXIT_SUCCESS : EXIT_FAILURE;
}
