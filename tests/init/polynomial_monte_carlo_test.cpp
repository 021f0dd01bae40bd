// Spread of prediction-error estimates, from data alone, against the Cramer-Rao bound by spectra.
#include <blockid/init/polynomial_starts.hpp>

#include "estimators/polynomial_systems.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

namespace blockid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kRuns = 200;
constexpr Index kSamples = 2000;

/// (points, P) of df/dtheta by central differences, f a response at many frequencies.
template <class Response>
Eigen::MatrixXcd sensitivities(const PolynomialModel& model, const VectorXd& omega, Response&& f) {
  constexpr double kStep = 1e-6;
  Eigen::MatrixXcd result(omega.size(), model.theta.size());
  for (Index k = 0; k < model.theta.size(); ++k) {
    PolynomialModel plus = model;
    PolynomialModel minus = model;
    plus.theta[k] += kStep;
    minus.theta[k] -= kStep;
    for (Index i = 0; i < omega.size(); ++i) {
      result(i, k) = (f(plus, omega[i]) - f(minus, omega[i])) / (2.0 * kStep);
    }
  }
  return result;
}

/// Fisher information of one sample for a white input of unit power:
/// (1 / 2 pi) int (dG dG* / lambda + dH dH*) / |H|^2 dw. Source: Ljung 1999, equation (9.57).
MatrixXd information(const PolynomialModel& model) {
  // The integrand is periodic and analytic: the error of the sum falls as 0.84^4096, the largest pole radius.
  constexpr Index kPoints = 4096;
  const VectorXd omega =
      VectorXd::LinSpaced(kPoints, 0.0, 2.0 * std::numbers::pi * (1.0 - 1.0 / static_cast<double>(kPoints)));
  const Eigen::MatrixXcd g = sensitivities(model, omega, response);
  const Eigen::MatrixXcd h = sensitivities(model, omega, noise_response);
  MatrixXd sum = MatrixXd::Zero(model.theta.size(), model.theta.size());
  for (Index i = 0; i < kPoints; ++i) {
    const double power = std::norm(noise_response(model, omega[i])) * static_cast<double>(kPoints);
    sum += ((g.row(i).adjoint() * g.row(i)).real() / model.noise_variance + (h.row(i).adjoint() * h.row(i)).real()) /
           power;
  }
  return sum;
}

class CramerRaoTest : public ::testing::TestWithParam<int> {
 protected:
  static PolynomialModel truth() {
    switch (GetParam()) {
      case 0:
        return testing::arx_system();
      case 1:
        return testing::armax_system();
      case 2:
        return testing::output_error_system();
      default:
        return testing::box_jenkins_system();
    }
  }
};

TEST_P(CramerRaoTest, IsReachedAndStated) {
  const PolynomialModel model = truth();
  const MatrixXd bound = (static_cast<double>(kSamples) * information(model)).inverse();
  const MatrixXd inverse_bound = bound.inverse();
  const Index count = model.theta.size();
  VectorXd mean = VectorXd::Zero(count);
  VectorXd variance = VectorXd::Zero(count);
  double statistic = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    const Record record = testing::simulated(model, kSamples, 1000 + static_cast<std::uint64_t>(run), 200).record;
    const PolynomialIdentification found = identify_polynomial(record, model.orders);
    ASSERT_EQ(found.fit.status, FitStatus::converged) << "run " << run;
    const VectorXd error = found.fit.model.theta - model.theta;
    statistic += error.dot(inverse_bound * error);
    mean += error / kRuns;
    variance += found.fit.covariance->standard_deviations.cwiseAbs2() / kRuns;
  }
  // At the bound the statistic is chi-squared of runs P degrees of freedom: mean runs P, deviation sqrt(2 runs P).
  // Five of them, and one percent for what is of order 1 / N: states that are estimated, curvature.
  const double dof = static_cast<double>(kRuns * count);
  EXPECT_NEAR(statistic / dof, 1.0, 5.0 * std::sqrt(2.0 / dof) + 0.01);
  for (Index k = 0; k < count; ++k) {
    SCOPED_TRACE(parameter_names(model.orders)[static_cast<std::size_t>(k)]);
    // Bias of order 1 / N is a fraction of a deviation / sqrt(N); the mean itself scatters by a deviation / sqrt(runs).
    EXPECT_NEAR(mean[k], 0.0, 5.0 * std::sqrt(bound(k, k) / kRuns));
    // Stated deviations scatter little; their mean square is that of the bound up to order 1 / N and the scatter of
    // the information, 1 / sqrt(N) for one run.
    EXPECT_NEAR(variance[k] / bound(k, k), 1.0, 0.05);
  }
}

INSTANTIATE_TEST_SUITE_P(All, CramerRaoTest, ::testing::Range(0, 4), [](const auto& instance) {
  return std::string(instance.param == 0   ? "arx"
                     : instance.param == 1 ? "armax"
                     : instance.param == 2 ? "output_error"
                                           : "box_jenkins");
});

}  // namespace
}  // namespace blockid
