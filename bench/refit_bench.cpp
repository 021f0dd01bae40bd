// Whole refits of a Wiener-Hammerstein model over the length of the record and over the orders of its filters.
//
// The ways to fit (all rows handed to Ceres, compressed, QR triangle, static block eliminated) must first reach the
// same minimum. The complexity fit of the first benchmark shows that cost grows linearly with the number of samples.

#include "wiener_hammerstein_case.hpp"

#include <blockid/blocks/text.hpp>
#include <blockid/estimators/refit.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>

namespace blockid::bench {
namespace {

/// Relative difference of the final RMSE between ways to fit: all stop within the function tolerance of one minimum.
constexpr double kSameMinimum = 1e-6;

/// The case's model with every parameter off by a few percent.
Model perturbed(const WienerHammersteinCase& c) {
  Model model = make_model(c.chain);
  model.parameters = WienerHammersteinCase::parameters();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    model.parameters[k] *= 1.0 + 0.03 * std::sin(3.0 * static_cast<double>(k));
  }
  return model;
}

RefitOptions settings(ResidualForm form, StaticParameters static_parameters) {
  RefitOptions options;
  options.residual_form = form;
  options.static_parameters = static_parameters;
  options.covariance = false;
  return options;
}

void check_agreement() {
  const WienerHammersteinCase c(5000);
  const Model start = perturbed(c);
  const double reference = refit(start, c.data, settings(ResidualForm::full, StaticParameters::joint)).rmse;
  const auto check = [&](const std::string& name, ResidualForm form, StaticParameters parameters) {
    const double rmse = refit(start, c.data, settings(form, parameters)).rmse;
    if (std::abs(rmse - reference) <= kSameMinimum * reference) return;
    std::cerr << name << " ends at an RMSE of " << rmse << ", all rows at " << reference << "\n";
    std::exit(EXIT_FAILURE);
  };
  check("compressed", ResidualForm::compressed, StaticParameters::joint);
  check("QR triangle", ResidualForm::triangle, StaticParameters::joint);
  check("static block eliminated", ResidualForm::compressed, StaticParameters::eliminated);
}

/// Ten iterations each, so that every length costs the same number of evaluations.
void refit_over_samples(benchmark::State& state, ResidualForm form, StaticParameters parameters) {
  const WienerHammersteinCase c(state.range(0));
  const Model start = perturbed(c);
  RefitOptions options = settings(form, parameters);
  options.max_iterations = 10;
  options.function_tolerance = 0.0;
  options.parameter_tolerance = 0.0;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(refit(start, c.data, options).rmse);
  state.SetComplexityN(state.range(0));
}

/// Filters of growing order around the same polynomial, refitted from the truth moved by a percent.
void refit_over_orders(benchmark::State& state) {
  const std::string order = std::to_string(state.range(0));
  const std::string filter = "rational(nb=" + order + ",na=" + order + ")";
  Model model = make_model(parse("G1=" + filter + " | f=polynomial(degree=5,range=[-4,4]) | G2=" + filter));
  for (Index k = 0; k < model.parameters.size(); ++k) {
    model.parameters[k] += 0.05 / static_cast<double>(k + 1) * std::cos(static_cast<double>(k));
  }
  Record record;
  record.u = gaussian(20'000, 3);
  record.y = simulate(model, record.u) + 0.01 * gaussian(20'000, 4);
  Model start = model;
  start.parameters *= 1.01;
  RefitOptions options = settings(ResidualForm::compressed, StaticParameters::joint);
  options.max_iterations = 10;
  options.function_tolerance = 0.0;
  options.parameter_tolerance = 0.0;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(refit(start, record, options).rmse);
}

BENCHMARK_CAPTURE(refit_over_samples, compressed, ResidualForm::compressed, StaticParameters::joint)
    ->RangeMultiplier(2)
    ->Range(12'500, 200'000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oN);
BENCHMARK_CAPTURE(refit_over_samples, all_rows, ResidualForm::full, StaticParameters::joint)
    ->RangeMultiplier(2)
    ->Range(12'500, 200'000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oN);
BENCHMARK_CAPTURE(refit_over_samples, eliminated, ResidualForm::compressed, StaticParameters::eliminated)
    ->RangeMultiplier(2)
    ->Range(12'500, 200'000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oN);
BENCHMARK(refit_over_orders)->DenseRange(1, 8)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace blockid::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return EXIT_FAILURE;
  blockid::bench::check_agreement();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return EXIT_SUCCESS;
}
