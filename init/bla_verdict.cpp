#include <blockid/data/error.hpp>
#include <blockid/data/tail_probability.hpp>
#include <blockid/init/nonparametric_bla.hpp>

#include <Eigen/Core>
#include <cmath>

namespace blockid {
namespace {

using Eigen::VectorXd;

/// Power of the distortion over that of the linear output: amplitudes of 1 % and 10 %.
constexpr double kWeak = 1e-4;
constexpr double kClear = 1e-2;

double decibels(double power, double reference) {
  if (std::isnan(power) || !(reference > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  return 10.0 * std::log10(std::max(power, 0.0) / reference);
}

/// Estimate of var(v) for v with E v = sigma^2 and nu complex degrees of freedom: var v = sigma^4 / nu, and
/// E v^2 = sigma^4 (1 + 1 / nu).
VectorXd variance_of(const VectorXd& v, Index nu) { return v.array().square() / static_cast<double>(nu + 1); }

void check_significance(double significance) {
  if (!(significance > 0.0 && significance < 1.0)) {
    fail("significance: expected a probability in (0, 1), got ", significance);
  }
}

}  // namespace

BlaPowers powers(const NonparametricBla& bla) {
  BlaPowers result;
  const bool total = bla.total_variance.size() > 0;
  const VectorXd& of_g = total ? bla.total_variance : bla.noise_variance;
  const double m = static_cast<double>(bla.realisations);
  result.linear = bla.input_power.dot(bla.response.response.cwiseAbs2() - of_g);
  if (total) result.rest = bla.rest_power.sum();
  if (bla.noise_variance.size() > 0) {
    result.noise = m * static_cast<double>(bla.periods) * bla.input_power.dot(bla.noise_variance);
  }
  if (bla.distortion_variance.size() > 0) {
    result.distortion = bla.input_power.dot(bla.distortion_variance);
    const VectorXd variance =
        variance_of(bla.total_variance, bla.total_dof) + variance_of(bla.noise_variance, bla.noise_dof);
    result.distortion_deviation = m * std::sqrt(bla.input_power.cwiseAbs2().dot(variance));
  }
  return result;
}

NonlinearityVerdict nonlinearity(const NonparametricBla& bla, double significance) {
  check_significance(significance);
  NonlinearityVerdict verdict;
  verdict.powers = powers(bla);
  const BlaPowers& p = verdict.powers;
  verdict.distortion_db = decibels(p.distortion, p.linear);
  verdict.noise_db = decibels(p.noise, p.linear);
  verdict.rest_db = decibels(p.rest, p.linear);
  if (std::isnan(p.distortion)) return verdict;
  verdict.p_value = p.distortion > 0.0 ? normal_tail(p.distortion / p.distortion_deviation) : 1.0;
  if (verdict.p_value >= significance) {
    verdict.kind = Nonlinearity::none;
  } else if (p.distortion < kWeak * p.linear) {
    verdict.kind = Nonlinearity::weak;
  } else {
    verdict.kind = p.distortion < kClear * p.linear ? Nonlinearity::clear : Nonlinearity::strong;
  }
  return verdict;
}

VanishingBla bla_vanishes(const NonparametricBla& bla, double significance) {
  check_significance(significance);
  if (bla.total_variance.size() == 0) {
    fail(
        "vanishing best linear approximation: the total variance is unknown; expected two realisations of a periodic "
        "input or an estimate for arbitrary inputs");
  }
  VanishingBla result;
  result.significance = significance;
  const double nu = static_cast<double>(bla.total_dof);
  for (Index k = 0; k < bla.total_variance.size(); k += bla.independent_step) {
    // Without noise and distortion any G at all is significant.
    const double ratio = std::norm(bla.response.response[k]) / (nu * bla.total_variance[k]);
    if (std::isnan(ratio)) continue;
    result.statistic += 2.0 * nu * std::log1p(ratio);
    result.degrees_of_freedom += 2;
  }
  result.p_value = chi_square_tail(result.statistic, static_cast<double>(result.degrees_of_freedom));
  result.vanishes = result.p_value >= significance;
  const BlaPowers p = powers(bla);
  result.explained = std::max(p.linear, 0.0) / (std::max(p.linear, 0.0) + p.rest);
  return result;
}

}  // namespace blockid
