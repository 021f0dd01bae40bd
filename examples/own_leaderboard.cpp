// A problem and an estimator of one's own beside those of the library, in one table.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/cli/leaderboard.hpp>
#include <blockid/estimators/fit.hpp>
#include <blockid/init/split.hpp>

#include <Eigen/Core>
#include <cmath>
#include <exception>
#include <iostream>

namespace {

using namespace blockid;

constexpr double kNoise = 0.01;

// begin: problem
/// A saturating amplifier behind a first-order filter.
problems::Problem amplifier() {
  Model system = make_model(parse("G=rational(nb=0,na=1) | f=saturation"));
  system.parameters = Eigen::Vector4d(0.2, -0.8, -0.3, 0.3);  // G: b0, a1; f: lower, upper
  Record record;
  record.u = lesson::noise(8000, 1.0, 1);
  record.y = simulate(system, record.u) + lesson::noise(8000, kNoise, 2);
  return {.name = "amplifier",
          .description = "filter and saturation",
          .train = slice(record, 0, 5000),
          .test = slice(record, 5000, 8000),
          .noise_std = kNoise,
          .warmup = 50,
          .unit = "V"};
}
// end: problem

// begin: estimator
/// Linear, as a first guess would be.
FitResult first_order(const DataSet& train, const FitOptions& options) {
  return fit(parse("G=rational(nb=0,na=1) | f=polynomial(degree=1)"), train, no_initialiser(), options);
}
// end: estimator

int run() {
  // begin: leaderboard
  const std::vector<problems::CatalogueEntry> entries = {{"amplifier", "filter and saturation", amplifier}};
  const std::vector<cli::Contender> contenders = {
      {"first_order", first_order},
      cli::chain_contender("wiener", "G=rational(nb=1,na=1) | f=spline(knots=15)", exhaustive_split())};
  const cli::Leaderboard board = cli::run_leaderboard(entries, contenders, {.results = "amplifier.jsonl"});
  std::cout << cli::markdown(board);
  // end: leaderboard

  const cli::Leaderboard resumed = cli::run_leaderboard(entries, contenders, {.results = "amplifier.jsonl"});
  lesson::Checks checks;
  checks.expect(board.rows.size() == 2, "a row for each estimator");
  checks.expect(board.rows[0].test_rmse > 2.0 * kNoise, "a line misses the saturation");
  checks.expect(board.rows[1].test_rmse < 1.3 * kNoise, "a Wiener model comes down to the noise");
  checks.expect(resumed.rows[1].seconds == board.rows[1].seconds, "the second run takes the rows of the first");
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
