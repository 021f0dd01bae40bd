// Memory of a compressed evaluation of a long record: peak resident size beyond the record itself.
//
// usage: memory_bench [SAMPLES]   default 10 000 000; exits with an error above 100 MB or when the sums are wrong.

#include "wiener_hammerstein_case.hpp"

#include <blockid/estimators/predictor.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

namespace {

constexpr double kLimitMegabytes = 100.0;

/// Peak resident size of this process so far.
double peak_megabytes() {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024.0;
  }
  return -1.0;
}

/// Sets the peak back to what is resident now; where the system refuses, an earlier peak only makes the test stricter.
void reset_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

}  // namespace

int main(int argc, char** argv) {
  using namespace blockid;
  const Index samples = argc > 1 ? std::atol(argv[1]) : 10'000'000;
  if (samples < 1000) {
    std::fprintf(stderr, "memory_bench: expected a number of samples >= 1000, got '%s'\n", argv[1]);
    return EXIT_FAILURE;
  }
  bench::WienerHammersteinCase c(samples);
  reset_peak();
  const double before = peak_megabytes();
  if (before < 0.0) {
    std::printf("skipped: /proc/self/status has no VmHWM on this system\n");
    return EXIT_SUCCESS;
  }
  NormalEquations sums(21);
  const Predictor predictor(c.chain, c.data);
  const bool finite = predictor.accumulate(c.theta, sums);
  const double after = peak_megabytes();
  const double sum = predictor.sum_of_squares(c.theta);
  const bool agrees = finite && std::abs(sums.gram()(20, 20) - sum) <= 1e-9 * sum;
  std::printf(
      "%ld samples: record %.0f MB, resident before %.1f MB, compressed evaluation adds %.2f MB (limit %.0f MB); "
      "r'r %s the residual pass\n",
      static_cast<long>(samples), static_cast<double>(samples) * 16.0 / 1048576.0, before, after - before,
      kLimitMegabytes, agrees ? "agrees with" : "DISAGREES with");
  return agrees && after - before < kLimitMegabytes ? EXIT_SUCCESS : EXIT_FAILURE;
}
