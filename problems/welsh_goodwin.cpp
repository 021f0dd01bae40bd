#include <blockid/problems/welsh_goodwin.hpp>

#include <blockid/data/error.hpp>
#include <blockid/problems/gaussian.hpp>

#include <cmath>
#include <complex>

namespace blockid::problems {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr double kDamping = 0.01;
constexpr double kGain = 2.0;

VectorXd powers_of_ten(double low, double high, Eigen::Index count) {
  return VectorXd::LinSpaced(count, low, high).unaryExpr([](double x) { return std::pow(10.0, x); });
}

ResonantModes alternating(VectorXd omega_rad_s) {
  const Eigen::Index count = omega_rad_s.size();
  VectorXd gain = VectorXd::NullaryExpr(count, [](Eigen::Index k) { return k % 2 == 0 ? kGain : -kGain; });
  return {std::move(omega_rad_s), VectorXd::Constant(count, kDamping), std::move(gain)};
}

ResonantProblem measured(ResonantModes modes, const VectorXd& omega_rad_s, VectorXd break_points_rad_s) {
  FrequencyResponse data{omega_rad_s, response_at(modes, omega_rad_s), {}, 0.0};
  return {std::move(modes), std::move(data), std::move(break_points_rad_s)};
}

}  // namespace

VectorXcd response_at(const ResonantModes& modes, const VectorXd& omega_rad_s) {
  VectorXcd g = VectorXcd::Zero(omega_rad_s.size());
  for (Eigen::Index k = 0; k < modes.omega_rad_s.size(); ++k) {
    for (Eigen::Index i = 0; i < g.size(); ++i) {
      const double ratio = omega_rad_s[i] / modes.omega_rad_s[k];
      // (1 - ratio)(1 + ratio) keeps its digits beside the resonance.
      g[i] += modes.gain[k] / Complex((1.0 - ratio) * (1.0 + ratio), 2.0 * modes.damping[k] * ratio);
    }
  }
  return g;
}

VectorXcd poles(const ResonantModes& modes) {
  VectorXcd result(2 * modes.omega_rad_s.size());
  for (Eigen::Index k = 0; k < modes.omega_rad_s.size(); ++k) {
    const double zeta = modes.damping[k];
    const Complex pole = modes.omega_rad_s[k] * Complex(-zeta, std::sqrt(1.0 - zeta * zeta));
    result[2 * k] = pole;
    result[2 * k + 1] = std::conj(pole);
  }
  return result;
}

ResonantProblem welsh_goodwin(Eigen::Index tones) {
  if (tones < 2) fail("Welsh and Goodwin's system: expected at least two tones, got ", tones);
  constexpr double kLow = -4.0;
  constexpr double kHigh = 5.0;
  constexpr double kMargin = 0.3;
  constexpr Eigen::Index kModes = 9;
  return measured(alternating(powers_of_ten(kLow + kMargin, kHigh - kMargin, kModes)),
                  powers_of_ten(kLow, kHigh, tones), powers_of_ten(kLow, kHigh, 2 * kModes));
}

ResonantProblem resonant_decades(Eigen::Index decades) {
  if (decades < 1) fail("resonances over decades: expected at least one decade, got ", decades);
  const auto last = static_cast<double>(decades);
  return measured(alternating(powers_of_ten(0.5, last - 0.5, decades)), powers_of_ten(0.125, last - 0.125, 4 * decades),
                  powers_of_ten(0.25, last - 0.25, 2 * decades));
}

FrequencyResponse with_relative_noise(const FrequencyResponse& g, double deviation, std::uint64_t seed) {
  check(g);
  if (!(deviation >= 0.0) || !std::isfinite(deviation)) fail("noise: expected a deviation >= 0, got ", deviation);
  FrequencyResponse result = g;
  result.standard_deviation = deviation * g.response.cwiseAbs();
  Gaussian gaussian(seed);
  for (Complex& value : result.response) {
    const double re = gaussian();
    const double im = gaussian();
    value *= 1.0 + deviation / std::sqrt(2.0) * Complex(re, im);
  }
  return result;
}

LocalisingDesign welsh_goodwin_theorem1(double gamma, Eigen::Index filters) {
  if (!(gamma > 1.0)) fail("theorem 1: expected a ratio of break points above 1, got ", gamma);
  if (filters < 1) fail("theorem 1: expected at least one filter, got ", filters);
  LocalisingDesign design;
  design.break_points_rad_s =
      VectorXd::NullaryExpr(filters, [&](Eigen::Index k) { return std::pow(gamma, static_cast<double>(k)); });
  design.omega_rad_s = design.break_points_rad_s / std::sqrt(gamma);
  return design;
}

}  // namespace blockid::problems
