#include <blockid/cli/ct_outcome.hpp>

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/text_table.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace blockid::cli {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Largest modulus of the poles: the scale of the powers of s.
double scale_of(const TrendFit& fit) {
  const double largest = poles(fit).cwiseAbs().maxCoeff();
  return largest > 0.0 && std::isfinite(largest) ? largest : 1.0;
}

/// Coefficients of powers of s / scale with A monic.
VectorXd scaled(const VectorXd& coefficients, Index count, Index order, double scale) {
  VectorXd result(count);
  for (Index k = 0; k < count; ++k) result[k] = coefficients[k] * std::pow(scale, static_cast<double>(k - order));
  return result;
}

/// From the structure's order, `a` then `b`, to that of [a, b] by rising powers.
MatrixXd covariance_of_powers(const TrendFit& fit, Index numerator_count, double scale) {
  const Index n = fit.structure.order;
  MatrixXd map = MatrixXd::Zero(n + numerator_count, fit.covariance.rows());
  Index column = 0;
  for (const Index power : fit.structure.a) map(power, column++) = std::pow(scale, static_cast<double>(power - n));
  for (const Index power : fit.structure.b) map(n + power, column++) = std::pow(scale, static_cast<double>(power - n));
  return map * fit.covariance * map.transpose();
}

ContinuousTransferFunction transfer_function_of(const TrendFit& fit, Index numerator_count, double scale) {
  const Index n = fit.structure.order;
  return {monomial_basis(n, numerator_count - 1, scale), scaled(fit.a, n, n, scale),
          scaled(fit.b, numerator_count, n, scale)};
}

std::vector<std::string> trend_warnings(const TrendFit& fit) {
  std::vector<std::string> warnings;
  const Index columns = fit.covariance.rows();
  if (fit.rank < columns) {
    warnings.push_back("the data determine " + std::to_string(fit.rank) + " of " + std::to_string(columns) +
                       " coefficients: a lower order, or an input that excites more");
  }
  if (!is_stable(fit)) warnings.emplace_back("the model is not stable: a pole has no negative real part");
  return warnings;
}

}  // namespace

CtEstimate estimate_of(const TrendFit& fit) {
  const Index numerator_count = 1 + *std::max_element(fit.structure.b.begin(), fit.structure.b.end());
  const double scale = scale_of(fit);
  CtEstimate estimate;
  estimate.transfer_function = transfer_function_of(fit, numerator_count, scale);
  if (fit.covariance.allFinite()) estimate.covariance = covariance_of_powers(fit, numerator_count, scale);
  estimate.summary = summary_of(fit);
  estimate.delay = fit.structure.delay;
  estimate.coefficients = fit.covariance.rows();
  estimate.facts = {"trends of order " + std::to_string(fit.structure.order) + ", delay " +
                        std::to_string(fit.structure.delay) + " samples, " + std::to_string(fit.rows) + " rows, rank " +
                        std::to_string(fit.rank) + " of " + std::to_string(fit.covariance.rows()) + ", condition " +
                        number(fit.condition, 3),
                    "one step ahead: IQ " + number(fit.squared_error) + ", IV " + number(fit.absolute_error)};
  estimate.details = {{"rank", fit.rank},
                      {"condition", finite_or_null(fit.condition)},
                      {"rows", fit.rows},
                      {"squared_error", fit.squared_error},
                      {"absolute_error", fit.absolute_error}};
  estimate.warnings = trend_warnings(fit);
  return estimate;
}

}  // namespace blockid::cli
