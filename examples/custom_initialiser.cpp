// An initialiser of one's own: a function from chain and data to starting models, no registration.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/estimators/fit.hpp>
#include <blockid/estimators/static_parameters.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

namespace {

// begin: initialiser
/// Starts for a first-order filter G in front of a static block: `count` time constants, evenly spaced on a
/// logarithmic axis from 2 to 200 samples, the static block by least squares behind each.
blockid::Initialiser time_constants(int count) {
  return [count](const blockid::AnyBlock& chain, const blockid::DataSet& data,
                 const blockid::InitialiserOptions& options) {
    std::vector<blockid::Candidate> found;
    for (int k = 0; k < count; ++k) {
      const double time_constant = 2.0 * std::pow(100.0, k / (count - 1.0));
      const double pole = std::exp(-1.0 / time_constant);
      blockid::Model model = blockid::make_model(chain, data.records.front().sample_time_s);
      model.parameters[blockid::parameter_index(model, "G.b0")] = 1.0 - pole;
      model.parameters[blockid::parameter_index(model, "G.a1")] = -pole;
      model = blockid::adapt_structure(model, data.records.front().u);
      const blockid::StaticFit fitted = blockid::fit_static(model, data, options.prediction);
      const std::string how = "time constant " + std::to_string(time_constant) + " samples";
      if (fitted.finite) found.push_back({fitted.model, fitted.rmse, how});
    }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.rmse < b.rmse; });
    return found;
  };
}
// end: initialiser

int run() {
  using namespace blockid;
  Model system = make_model(parse("G=rational(nb=0,na=1) | f=saturation"));
  system.parameters = Eigen::Vector4d(0.05, -0.95, -0.2, 0.3);  // G: b0, a1; f: lower, upper
  Record record;
  record.u = lesson::noise(20000, 1.5, 1);
  record.y = simulate(system, record.u) + lesson::noise(20000, 0.01, 2);

  // begin: use
  const AnyBlock chain = parse("G=rational(nb=0,na=1) | f=spline(knots=15)");
  const FitResult result = fit(chain, record, time_constants(12));
  for (const Trial& trial : result.trials) {
    std::cout << trial.candidate.how << ": " << trial.candidate.rmse;
    if (trial.refitted) std::cout << ", refitted " << trial.refit.rmse;
    std::cout << '\n';
  }
  // end: use

  lesson::Checks checks;
  const double pole = -result.model.parameters[parameter_index(result.model, "G.a1")];
  checks.expect(std::abs(pole - 0.95) < 0.002, "the pole is 0.95");
  checks.expect(result.report.rmse < 1.1 * 0.01, "the error is nearly that of the noise, 0.01");
  checks.expect(std::is_sorted(result.trials.begin(), result.trials.begin() + 8,
                               [](const Trial& a, const Trial& b) { return a.refit.rmse < b.refit.rmse; }),
                "refitted trials come best first");
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
