#include <blockid/cli/report/bode_band.hpp>

#include <blockid/blocks/detail/view.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/frequency_response.hpp>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace blockid::cli {
namespace {

using detail::view;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// 20 / ln 10: dB of one neper.
const double kDecibelsPerNeper = 20.0 / std::log(10.0);

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
  block.apply(view(theta), x, view(u), view(y));
  return y;
}

/// L with L L' = C, scaled so that units do not matter: columns are the independent directions of uncertainty.
MatrixXd root_of(const MatrixXd& covariance) {
  const VectorXd scale = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd inverse = scale.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const MatrixXd correlation = inverse.asDiagonal() * covariance * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(correlation);
  const VectorXd lengths = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return scale.asDiagonal() * eigen.eigenvectors() * lengths.asDiagonal();
}

/// Columns: derivatives of f along the columns of root, by central differences well within the uncertainty. Single
/// parameters of a filter may be far more uncertain than its response, so differences along each of them would not do.
template <class Matrix, class Function>
Matrix derivatives(const VectorXd& theta, const MatrixXd& root, Index rows, const Function& function) {
  constexpr double kStep = 1e-2;  // in standard deviations
  Matrix result = Matrix::Zero(rows, root.cols());
  for (Index k = 0; k < root.cols(); ++k) {
    if (root.col(k).isZero(0.0)) continue;
    const VectorXd step = kStep * root.col(k);
    result.col(k) = (function(theta + step) - function(theta - step)) / (2.0 * kStep);
  }
  return result;
}

/// Square root of the sum of squares of each row.
VectorXd lengths_of_rows(const MatrixXd& d) { return d.rowwise().norm(); }

}  // namespace

VectorXd logarithmic_frequencies(double sample_time_s, double decades, Index count) {
  const double nyquist = 0.5 / sample_time_s;
  const VectorXd exponent = VectorXd::LinSpaced(count, -decades, 0.0);
  return exponent.unaryExpr([&](double e) { return nyquist * std::pow(10.0, e); });
}

BodeBand bode_band(const ResponseFunction& response, const VectorXd& parameters, const MatrixXd& covariance,
                   const VectorXd& frequency_hz) {
  FrequencyResponse g;
  g.omega_rad_s = 2.0 * std::numbers::pi * frequency_hz;
  g.response = response(parameters);
  BodeBand band;
  band.frequency_hz = frequency_hz;
  band.magnitude_db = magnitude_db(g);
  band.phase_deg = phase_deg(g);
  band.magnitude_deviation_db = VectorXd::Zero(frequency_hz.size());
  band.phase_deviation_deg = VectorXd::Zero(frequency_hz.size());
  if (covariance.size() == 0) return band;
  const MatrixXcd gradient = derivatives<MatrixXcd>(parameters, root_of(covariance), frequency_hz.size(), response);
  const MatrixXcd relative = g.response.cwiseInverse().asDiagonal() * gradient;
  band.magnitude_deviation_db = kDecibelsPerNeper * lengths_of_rows(relative.real());
  band.phase_deviation_deg = kDegrees * lengths_of_rows(relative.imag());
  return band;
}

BodeBand bode_band(const AnyBlock& block, const VectorXd& parameters, const MatrixXd& covariance,
                   const VectorXd& frequency_hz, double sample_time_s) {
  const VectorXd omega = 2.0 * std::numbers::pi * sample_time_s * frequency_hz;
  const auto function = [&](const VectorXd& theta) { return responses(block, theta, omega); };
  return bode_band(function, parameters, covariance, frequency_hz);
}

CurveBand curve_band(const AnyBlock& block, const VectorXd& parameters, const MatrixXd& covariance, const VectorXd& u) {
  CurveBand band{u, outputs(block, parameters, u), VectorXd::Zero(u.size())};
  if (covariance.size() == 0) return band;
  const auto function = [&](const VectorXd& theta) { return outputs(block, theta, u); };
  band.deviation = lengths_of_rows(derivatives<MatrixXd>(parameters, root_of(covariance), u.size(), function));
  return band;
}

}  // namespace blockid::cli
