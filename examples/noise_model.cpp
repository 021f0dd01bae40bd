// A linear model with a model of its noise: Box-Jenkins from data alone, predictions over several horizons.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/init/polynomial_starts.hpp>

#include <Eigen/Core>
#include <cmath>
#include <exception>
#include <iomanip>
#include <iostream>
#include <string>
#include <vector>

namespace {

/// y = (b_0 + b_1 q^-1) / (1 + f_1 q^-1 + f_2 q^-2) u + 1 / (1 + d_1 q^-1) e
blockid::Record measured(const Eigen::Vector4d& path, double d1) {
  using namespace blockid;
  Model truth = make_model(parse("G=rational(nb=1,na=2)"));
  truth.parameters = path;
  Eigen::VectorXd noise = lesson::noise(6000, 0.2, 2);
  for (Index t = 1; t < noise.size(); ++t) noise[t] -= d1 * noise[t - 1];
  Record record;
  record.u = lesson::noise(6000, 1.0, 1);
  record.y = simulate(truth, record.u) + noise;
  return record;
}

int run() {
  using namespace blockid;
  const Eigen::Vector4d path(1.0, 0.5, -1.2, 0.6);
  const Record record = measured(path, -0.9);
  const Record train = slice(record, 0, 4000);
  const Record test = slice(record, 4000, 6000);
  lesson::Checks checks;

  // begin: fit
  const PolynomialIdentification found = identify_polynomial(train, {.nb = 1, .nd = 1, .nf = 2});
  const PolynomialModel& model = found.fit.model;
  const std::vector<std::string> names = parameter_names(model.orders);
  for (Index k = 0; k < model.theta.size(); ++k) {
    std::cout << std::setw(5) << names[static_cast<std::size_t>(k)] << std::setw(12) << model.theta[k] << " +- "
              << found.fit.covariance->standard_deviations[k] << '\n';
  }
  // end: fit

  Eigen::VectorXd truth(5);
  truth << path.head(2), -0.9, path.tail(2);
  const Eigen::VectorXd error = model.theta - truth;
  checks.expect((error.array().abs() < 4.0 * found.fit.covariance->standard_deviations.array()).all(),
                "every error is below four standard deviations");
  checks.expect(std::abs(std::sqrt(model.noise_variance) - 0.2) < 0.01, "the noise that drives it is found, 0.2");

  // begin: horizons
  const auto error_of = [&](Index ahead) { return (test.y - predict(model, test, ahead)).norm() / std::sqrt(2000.0); };
  std::cout << "one step ahead " << error_of(1) << ", five " << error_of(5) << ", simulation " << error_of(kSimulation)
            << '\n';
  // end: horizons

  // The noise is 0.2 one step ahead and 0.2 / sqrt(1 - 0.9^2) = 0.46 for those who do not know its past.
  checks.expect(std::abs(error_of(1) - 0.2) < 0.02, "one step ahead only the newest noise is left");
  checks.expect(error_of(1) < error_of(5) && error_of(5) < error_of(kSimulation),
                "the past helps, the less the longer");
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
