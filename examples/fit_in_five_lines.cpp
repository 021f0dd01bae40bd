// From a file to a validated Wiener-Hammerstein model in five statements.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/csv.hpp>
#include <blockid/data/load.hpp>
#include <blockid/data/metrics.hpp>
#include <blockid/estimators/fit.hpp>
#include <blockid/init/split.hpp>

#include <Eigen/Core>
#include <exception>
#include <iostream>

namespace {

constexpr double kNoise = 0.01;

/// Writes measured.csv with columns u and y: a filter, a cubic, a filter, and noise of deviation kNoise.
void write_measurement() {
  blockid::Model system = blockid::make_model(
      blockid::parse("G1=rational(nb=1,na=2) | f=polynomial(degree=3,range=[-1,1]) | G2=rational(nb=1,na=1)"));
  system.parameters.resize(11);
  system.parameters << 0.3, 0.2, -1.2, 0.5,  // G1: b0 b1 a1 a2
      0.0, 0.8, 0.05, -0.02,                 // f: c0 .. c3
      1.0, 0.4, -0.6;                        // G2: b0 b1 a1
  const Eigen::VectorXd u = lesson::noise(12000, 1.0, 1);
  blockid::Table table;
  table.names = {"u", "y"};
  table.has_header = true;
  table.values.resize(u.size(), 2);
  table.values << u, blockid::simulate(system, u) + lesson::noise(u.size(), kNoise, 2);
  blockid::write_csv("measured.csv", table);
}

int run() {
  using namespace blockid;
  write_measurement();

  // begin: fit
  const Record record = load_record({.path = "measured.csv", .input = "u", .output = "y", .sample_time_s = 1e-3});
  const AnyBlock chain = parse("G1=rational(nb=1,na=2) | f=spline(knots=10) | G2=rational(nb=1,na=1)");
  const FitResult result = fit(chain, slice(record, 0, 8000), exhaustive_split());
  const Record test = slice(record, 8000, 12000);
  std::cout << "test RMSE " << rmse(test.y, predict(result.model, test), 100) << '\n';
  // end: fit

  lesson::Checks checks;
  checks.expect(result.report.status == FitStatus::converged, "the fit converged");
  checks.expect(rmse(test.y, predict(result.model, test), 100) < 1.1 * kNoise,
                "the test error is that of the noise, 0.01");
  return checks.exit_code();
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
