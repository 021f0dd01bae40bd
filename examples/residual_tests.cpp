// Is the model good enough: a linear model of a system that is not linear, and the right one.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/validation/fit_hints.hpp>
#include <blockid/validation/model_residuals.hpp>

#include <Eigen/Core>
#include <exception>
#include <iostream>
#include <string>

namespace {

int run() {
  using namespace blockid;
  Model truth = make_model(parse("f=polynomial(degree=2,range=[-3,3]) | G=rational(nb=1,na=1)"));
  truth.parameters << 0.0, 1.0, 0.2,  // f: c0 c1 c2
      1.0, 0.5, -0.8;                 // G: b0 b1 a1
  Record record;
  record.u = lesson::noise(2000, 0.7, 1);
  record.y = simulate(truth, record.u) + lesson::noise(2000, 0.1, 2);
  lesson::Checks checks;

  RefitReport fitted = refit(make_model(parse("G=rational(nb=2,na=2) | o=offset()")), record);
  // begin: tests
  const ResidualTests tests = residual_tests(training_residuals(fitted.model, record));
  for (const std::string& hint : under_fit_hints(tests)) std::cout << hint << '\n';
  // end: tests
  checks.expect(!tests.find(ResidualTestKind::squared_input)->passed, "the linear model misses an even nonlinearity");

  fitted = refit(truth, record);
  const ResidualTests right = residual_tests(training_residuals(fitted.model, record));
  for (const ResidualTest& test : right.tests) std::cout << to_text(test.kind) << ": p = " << test.p_value << '\n';
  checks.expect(right.model_passed(), "the right model passes");
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
