#include <blockid/validation/trade_off.hpp>

#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kElbowTolerance = 0.01;
/// Ends of the automatic range: above the floor, where alpha is infinite, and below max|w|, where it is 0.
constexpr double kAboveFloor = 1.02;
constexpr double kBelowAll = 0.95;
constexpr double kSmallestGamma = 1e-4;

TradeOffPoint point_at(const UncertaintyProgramme& programme, double gamma, const ProgrammeOptions& options) {
  const ProgrammeSolution solution = smallest_alpha(programme, gamma, options);
  return {gamma, solution.value, solution.lower_bound, solution.slope, solution.status};
}

bool is_steep(const TradeOffPoint& point) { return !std::isfinite(point.alpha) || point.elasticity() > 1.0; }

/// Between a point that is not steep and a steep one at less gamma.
TradeOffPoint elbow_between(const UncertaintyProgramme& programme, TradeOffPoint flat, double steep_gamma,
                            const ProgrammeOptions& options) {
  while (flat.gamma > (1.0 + kElbowTolerance) * steep_gamma) {
    const TradeOffPoint middle = point_at(programme, std::sqrt(flat.gamma * steep_gamma), options);
    if (is_steep(middle)) {
      steep_gamma = middle.gamma;
    } else {
      flat = middle;
    }
  }
  return flat;
}

}  // namespace

TradeOffCurve trade_off_curve(const UncertaintyProgramme& programme, const VectorXd& gammas,
                              const ProgrammeOptions& options) {
  if (gammas.size() == 0) fail("trade-off: expected at least one noise bound, got none");
  VectorXd falling = gammas;
  std::sort(falling.begin(), falling.end(), std::greater<>());
  TradeOffCurve curve;
  for (const double gamma : falling) {
    curve.points.push_back(point_at(programme, gamma, options));
    if (curve.elbow || curve.points.size() < 2) continue;
    const TradeOffPoint& before = *(curve.points.end() - 2);
    if (before.alpha > 0.0 && !is_steep(before) && is_steep(curve.points.back())) {
      curve.elbow = elbow_between(programme, before, gamma, options);
    }
  }
  curve.least_noise = smallest_gamma(programme, 1.0, options).value;
  curve.noise_floor = smallest_gamma(programme, options.alpha_cap, options).value;
  return curve;
}

TradeOffCurve trade_off_curve(const UncertaintyProgramme& programme, int count, const ProgrammeOptions& options) {
  if (count < 2) fail("trade-off: expected at least 2 points, got ", count);
  const double floor = smallest_gamma(programme, options.alpha_cap, options).value;
  const double all = programme.w.cwiseAbs().maxCoeff();
  if (all == 0.0) fail("trade-off: the signal w is zero, any noise bound and no uncertainty explain it");
  const double from = std::min(kBelowAll * all, std::max(kAboveFloor * floor, kSmallestGamma * all));
  const double step = std::log(kBelowAll * all / from) / static_cast<double>(count - 1);
  return trade_off_curve(
      programme, VectorXd::NullaryExpr(count, [&](Index k) { return from * std::exp(step * static_cast<double>(k)); }),
      options);
}

}  // namespace blockid
