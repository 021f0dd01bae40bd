// A sum of branches: a linear path beside a Wiener path, fitted from a rough start.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/estimators/refit.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <exception>
#include <iostream>
#include <string>

namespace {

int run() {
  using namespace blockid;
  // begin: chain
  const AnyBlock chain =
      parse("sum=[slow=rational(nb=0,na=1) + G=rational(nb=0,na=1) | f=polynomial(degree=3,range=[-3,3])]");
  for (const std::string& name : chain.parameter_names()) std::cout << name << ' ';
  std::cout << '\n';
  // end: chain

  Model truth = make_model(chain);
  truth.parameters.resize(8);
  truth.parameters << 0.1, -0.95,  // slow: b0, a1
      1.0, -0.4,                   // G: b0, a1
      0.2, 1.0, 0.5, 0.3;          // f: c0 .. c3
  Record record;
  record.u = lesson::noise(8000, 1.0, 1);
  record.y = simulate(truth, record.u) + lesson::noise(8000, 0.02, 2);

  // begin: fit
  Model start = make_model(chain);
  const Index slow_a1 = 1;
  const Index g_a1 = 3;
  start.parameters[slow_a1] = -0.9;  // a slow path and a fast one
  start.parameters[g_a1] = -0.2;
  const RefitReport report = refit(start, record);
  // end: fit

  std::cout << "status " << to_text(report.status) << ", error " << report.rmse << '\n';
  lesson::Checks checks;
  checks.expect(report.status == FitStatus::converged, "the fit converged");
  checks.expect(std::abs(report.rmse - 0.02) < 0.001, "the error is that of the noise, 0.02");
  checks.expect(std::abs(report.model.parameters[slow_a1] + 0.95) < 0.01, "the slow pole is 0.95");
  checks.expect(std::abs(report.model.parameters[g_a1] + 0.4) < 0.01, "the fast pole is 0.4");
  checks.expect(report.covariance->undetermined.empty(), "the data determine every free parameter");
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
