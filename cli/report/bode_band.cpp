#include <blockid/cli/report/bode_band.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/frequency_response.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double kDegrees = 180.0 / std::numbers::pi;
/// 20 / ln 10: dB of one neper.
const double kDecibels = 20.0 / std::log(10.0);

std::span<const double> view(const VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

/// Step of a central difference: well within the parameter's uncertainty, as far as rounding errors allow.
double step_for(double value, double variance) {
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const double scale = std::max(std::abs(value), 1.0);
  return std::clamp(0.1 * std::sqrt(std::max(variance, 0.0)), std::sqrt(kEpsilon) * scale, std::cbrt(kEpsilon) * scale);
}

VectorXcd responses(const AnyBlock& block, const VectorXd& theta, const VectorXd& omega) {
  VectorXcd g(omega.size());
  for (Index k = 0; k < omega.size(); ++k) {
    const std::optional<std::complex<double>> response = block.frequency_response(view(theta), omega[k]);
    if (!response) fail("Bode picture: a block of kind '", block.kind(), "' has no frequency response");
    g[k] = *response;
  }
  return g;
}

VectorXd outputs(const AnyBlock& block, const VectorXd& theta, const VectorXd& u) {
  VectorXd y(u.size());
  std::vector<double> x(static_cast<std::size_t>(block.state_count()), 0.0);
  block.apply(view(theta), x, view(u), {y.data(), static_cast<std::size_t>(y.size())});
  return y;
}

/// Columns d f / d theta_k by central differences; zero columns where the parameter does not vary.
template <class Matrix, class Function>
Matrix derivatives(const VectorXd& theta, const MatrixXd& covariance, Index rows, const Function& function) {
  Matrix result = Matrix::Zero(rows, theta.size());
  for (Index k = 0; k < theta.size(); ++k) {
    if (covariance(k, k) == 0.0) continue;
    VectorXd above = theta;
    VectorXd below = theta;
    const double step = step_for(theta[k], covariance(k, k));
    above[k] += step;
    below[k] -= step;
    result.col(k) = (function(above) - function(below)) / (above[k] - below[k]);
  }
  return result;
}

/// sqrt(diag(D C D'))
VectorXd deviations(const MatrixXd& d, const MatrixXd& covariance) {
  return (d * covariance).cwiseProduct(d).rowwise().sum().cwiseMax(0.0).cwiseSqrt();
}

}  // namespace

VectorXd logarithmic_frequencies(double sample_time_s, double decades, Index count) {
  const double nyquist = 0.5 / sample_time_s;
  const VectorXd exponent = VectorXd::LinSpaced(count, -decades, 0.0);
  return exponent.unaryExpr([&](double e) { return nyquist * std::pow(10.0, e); });
}

BodeBand bode_band(const AnyBlock& block, const VectorXd& parameters, const MatrixXd& covariance,
                   const VectorXd& frequency_hz, double sample_time_s) {
  const VectorXd omega = 2.0 * std::numbers::pi * sample_time_s * frequency_hz;
  FrequencyResponse g;
  g.omega_rad_s = 2.0 * std::numbers::pi * frequency_hz;
  g.response = responses(block, parameters, omega);
  g.sample_time_s = sample_time_s;
  BodeBand band;
  band.frequency_hz = frequency_hz;
  band.magnitude_db = magnitude_db(g);
  band.phase_deg = phase_deg(g);
  band.magnitude_deviation_db = VectorXd::Zero(frequency_hz.size());
  band.phase_deviation_deg = VectorXd::Zero(frequency_hz.size());
  if (covariance.size() == 0) return band;
  const auto function = [&](const VectorXd& theta) { return responses(block, theta, omega); };
  const MatrixXcd gradient = derivatives<MatrixXcd>(parameters, covariance, omega.size(), function);
  const MatrixXcd relative = g.response.cwiseInverse().asDiagonal() * gradient;
  band.magnitude_deviation_db = kDecibels * deviations(relative.real(), covariance);
  band.phase_deviation_deg = kDegrees * deviations(relative.imag(), covariance);
  return band;
}

CurveBand curve_band(const AnyBlock& block, const VectorXd& parameters, const MatrixXd& covariance, const VectorXd& u) {
  CurveBand band{u, outputs(block, parameters, u), VectorXd::Zero(u.size())};
  if (covariance.size() == 0) return band;
  const auto function = [&](const VectorXd& theta) { return outputs(block, theta, u); };
  band.deviation = deviations(derivatives<MatrixXd>(parameters, covariance, u.size(), function), covariance);
  return band;
}

}  // namespace blockid::cli
