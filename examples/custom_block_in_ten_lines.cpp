// A block of one's own: write it, test that it keeps the contract, put it in a chain, fit it.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/testing/block_conformance.hpp>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <exception>
#include <iostream>
#include <span>

namespace {

// begin: block
// A cart with air drag: v_{t+1} = v_t + b u_t - c v_t |v_t|, y_t = v_{t+1}; theta = [b, c].
struct Cart {
  blockid::Index parameter_count() const { return 2; }
  blockid::Index state_count() const { return 1; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T> v, std::span<const T> u, std::span<T> y) const {
    using std::abs;
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = v[0] += theta[0] * u[t] - theta[1] * v[0] * abs(v[0]);
  }
};
// end: block

int run() {
  using namespace blockid;
  lesson::Checks checks;

  // begin: laws
  testing::ConformanceOptions options;
  options.parameters = Eigen::Vector2d(0.1, 0.2);  // where to test; a negative drag would run away
  const testing::ConformanceReport report = testing::check_block(Cart{}, options);
  std::cout << report.text() << '\n';
  // end: laws
  checks.expect(report.ok(), "the block keeps the laws");

  // begin: chain
  const Series chain({{"cart", Cart{}}, {"sensor", Rational(0, 1)}});
  Model truth = make_model(chain, 0.01);
  truth.parameters = Eigen::Vector4d(0.1, 0.2, 0.3, -0.7);  // cart: b, c; sensor: b0, a1
  Record record;
  record.sample_time_s = truth.sample_time_s;
  record.u = lesson::noise(5000, 1.0, 1);
  record.y = simulate(truth, record.u) + lesson::noise(5000, 0.01, 2);

  Model start = truth;
  start.parameters = Eigen::Vector4d(0.05, 0.05, 0.3, -0.5);
  RefitOptions settings;
  settings.frozen = {"sensor.b0"};  // known from calibration; without it velocity has no unit
  const RefitReport fitted = refit(start, record, settings);
  // end: chain

  std::cout << "b, c, sensor.b0, sensor.a1: " << fitted.model.parameters.transpose() << '\n';
  checks.expect(fitted.status == FitStatus::converged, "the fit converged");
  checks.expect(std::abs(fitted.rmse - 0.01) < 0.0005, "the error is that of the noise, 0.01");
  checks.expect((fitted.model.parameters - truth.parameters).cwiseAbs().maxCoeff() < 0.01,
                "the parameters are those of the system");
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
