// Outputs that are missing, and outputs that are less certain than others.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/record.hpp>
#include <blockid/estimators/refit.hpp>

#include <Eigen/Core>
#include <cmath>
#include <exception>
#include <iostream>
#include <limits>

namespace {

int run() {
  using namespace blockid;
  Model truth = make_model(parse("G=rational(nb=1,na=1) | f=polynomial(degree=3,range=[-3,3])"));
  truth.parameters.resize(7);
  truth.parameters << 1.0, 0.3, -0.8, 0.0, 1.5, 0.1, -0.2;  // G: b0 b1 a1; f: c0 .. c3
  constexpr Index kSamples = 4000;
  Record record;
  record.u = lesson::noise(kSamples, 0.6, 1);
  record.y = simulate(truth, record.u);
  // The first half was measured with noise of 0.02, the second with 0.5 ...
  record.y.head(2000) += lesson::noise(2000, 0.02, 2);
  record.y.tail(2000) += lesson::noise(2000, 0.5, 3);
  // ... and for 500 samples the sensor was off.
  record.y.segment(700, 500).setConstant(std::numeric_limits<double>::quiet_NaN());

  // begin: weights
  record.weights = Eigen::VectorXd::Ones(kSamples);
  record.weights.segment(700, 500).setZero();      // missing: weight 0, the value does not matter
  const RefitReport equal = refit(truth, record);  // all samples alike
  record.weights.head(2000) *= 1.0 / 0.02;         // weight = 1 / standard deviation of the noise
  record.weights.tail(2000) *= 1.0 / 0.5;
  const RefitReport weighted = refit(truth, record);
  // end: weights

  const double error_equal = (equal.model.parameters - truth.parameters).norm();
  const double error_weighted = (weighted.model.parameters - truth.parameters).norm();
  std::cout << present_count(record) << " of " << sample_count(record) << " output samples are there\n"
            << "error of the parameters: " << error_equal << " without, " << error_weighted << " with weights\n"
            << "weighted residuals have deviation " << weighted.rmse << '\n';
  lesson::Checks checks;
  checks.expect(present_count(record) == 3500, "500 samples are missing");
  checks.expect(std::isfinite(equal.rmse), "a missing sample may be NaN");
  checks.expect(std::abs(weighted.rmse - 1.0) < 0.05, "residuals divided by their deviation have deviation 1");
  checks.expect(error_weighted < 0.3 * error_equal, "weights make the estimate better");

  Record forgotten = record;
  forgotten.weights.resize(0);
  try {
    check(forgotten);
    checks.expect(false, "a NaN without weight 0 is refused");
  } catch (const Error& error) {
    std::cout << error.what() << '\n';
    checks.expect(true, "a NaN without weight 0 is refused");
  }
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
