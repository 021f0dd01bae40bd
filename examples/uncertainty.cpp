// How well the data determine a model: standard deviations, a band around a frequency response, coloured noise.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/estimators/refit.hpp>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <exception>
#include <iomanip>
#include <iostream>
#include <span>
#include <string>
#include <vector>

namespace {

// begin: band
/// Standard deviation of |G(e^{jw})| by linearisation, sqrt(g' C g) with g = d|G|/dtheta by central differences.
double magnitude_deviation(const blockid::AnyBlock& filter, const Eigen::VectorXd& theta,
                           const Eigen::MatrixXd& covariance, double omega) {
  const auto magnitude = [&](const Eigen::VectorXd& at) {
    return std::abs(filter.frequency_response({at.data(), static_cast<std::size_t>(at.size())}, omega).value());
  };
  constexpr double kStep = 1e-6;
  Eigen::VectorXd gradient(theta.size());
  for (Eigen::Index k = 0; k < theta.size(); ++k) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(theta.size(), k);
    gradient[k] = (magnitude(theta + step) - magnitude(theta - step)) / (2.0 * kStep);
  }
  return std::sqrt(gradient.dot(covariance * gradient));
}
// end: band

int run() {
  using namespace blockid;
  Model truth = make_model(parse("G=rational(nb=1,na=2) | f=polynomial(degree=3,range=[-3,3])"));
  truth.parameters.resize(8);
  truth.parameters << 1.0, 0.5, -1.2, 0.6,  // G: b0 b1 a1 a2
      0.1, 2.0, 0.2, -0.3;                  // f: c0 .. c3
  Record record;
  record.u = lesson::noise(4000, 0.5, 1);
  record.y = simulate(truth, record.u) + lesson::noise(4000, 0.05, 2);
  lesson::Checks checks;

  // begin: deviations
  const RefitReport report = refit(truth, record);
  const std::vector<std::string> names = truth.chain.parameter_names();
  for (Index k = 0; k < truth.parameters.size(); ++k) {
    std::cout << std::setw(5) << names[static_cast<std::size_t>(k)] << std::setw(12) << report.model.parameters[k]
              << " +- " << report.covariance->standard_deviations[k] << '\n';
  }
  for (const std::string& name : report.held) std::cout << name << " is held: G and f could trade gain\n";
  // end: deviations

  const Eigen::VectorXd& deviation = report.covariance->standard_deviations;
  const Eigen::VectorXd error = report.model.parameters - truth.parameters;
  checks.expect(report.held == std::vector<std::string>{"G.b0"} && deviation[0] == 0.0 && error[0] == 0.0,
                "the gauge is held");
  checks.expect((error.tail(7).cwiseAbs().array() < 4.0 * deviation.tail(7).array()).all(),
                "every error is below four standard deviations");
  checks.expect(std::abs(std::sqrt(report.covariance->noise_variance) - 0.05) < 0.003, "the noise is found, 0.05");

  const AnyBlock filter = Rational(1, 2);
  const Eigen::MatrixXd covariance_g = report.covariance->parameters.topLeftCorner(4, 4);
  bool inside = true;
  for (const double omega : {0.1, 0.5, 1.0, 2.0}) {
    const auto magnitude = [&](const Eigen::VectorXd& theta) {
      return std::abs(filter.frequency_response(std::span(theta.data(), 4), omega).value());
    };
    const double found = magnitude(report.model.parameters);
    const double band = magnitude_deviation(filter, report.model.parameters.head(4), covariance_g, omega);
    std::cout << "|G| at " << omega << " rad/sample: " << found << " +- " << band << '\n';
    inside = inside && std::abs(found - magnitude(truth.parameters)) < 4.0 * band;
  }
  checks.expect(inside, "so is every error of the frequency response");

  // Noise with a memory of about 10 samples: the plain covariance takes every sample for news and promises too much.
  Eigen::VectorXd coloured = lesson::noise(4000, 0.05, 3);
  for (Index t = 1; t < coloured.size(); ++t) coloured[t] += 0.9 * coloured[t - 1];
  record.y = simulate(truth, record.u) + coloured;
  // begin: coloured
  const RefitReport in_colour = refit(truth, record);
  const Covariance plain = covariance(in_colour.model, record);
  const Covariance robust = covariance(in_colour.model, record, {.robust = true, .batch = 100});
  // end: coloured
  std::cout << "coloured noise, c0: +- " << plain.standard_deviations[4] << " (white) or +- "
            << robust.standard_deviations[4] << " (robust)\n";
  // The mean of such noise varies 19^(1/2) = 4.4 times as much as that of white noise of the same variance.
  checks.expect(robust.standard_deviations[4] > 2.0 * plain.standard_deviations[4], "the robust covariance sees it");
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
