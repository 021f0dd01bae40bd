#include <blockid/validation/noise_estimate.hpp>

#include <blockid/data/error.hpp>

#include <cmath>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kDecayed = 1e-18;

}  // namespace

NoiseEstimate noise_from_quiet_run(const UncertainLoop& loop, const VectorXd& u, const VectorXd& y, double safety,
                                   double reference_tolerance) {
  if (!(safety >= 1.0) || !std::isfinite(safety)) {
    fail("noise estimate: expected a safety factor of at least 1, got ", safety);
  }
  const VectorXd w = uncertainty_output(loop, u, y);
  if (w.size() == 0) fail("noise estimate: expected at least one sample, got none");
  NoiseEstimate estimate;
  estimate.reference =
      reference_error({loop.controller.numerator, loop.controller.denominator}, u, y, VectorXd::Zero(u.size()));
  if (!(estimate.reference <= reference_tolerance * u.cwiseAbs().maxCoeff())) {
    fail("noise estimate: expected a run without reference, |C y + u| <= ",
         reference_tolerance * u.cwiseAbs().maxCoeff(), ", got ", estimate.reference);
  }
  estimate.largest = w.cwiseAbs().maxCoeff();
  estimate.gamma = safety * estimate.largest;
  return estimate;
}

double disturbance_gain(const UncertainLoop& loop, const DiscreteTransferFunction& plant) {
  UncertainLoop actual = loop;
  actual.plant = trivial_factors(plant);
  check(actual);
  const VectorXd chi = characteristic_polynomial(actual);
  const double radius = spectral_radius(chi);
  const Index decayed = radius == 0.0 ? 0 : static_cast<Index>(std::ceil(std::log(kDecayed) / std::log(radius)));
  // As long again for what multiple poles add, and all samples that a finite response has.
  const Index count = 2 * decayed + loop.controller.stable.size() + plant.denominator.size() + chi.size();
  const VectorXd impulse = VectorXd::Unit(count, 0);
  return filter({loop.controller.stable, VectorXd::Ones(1)}, filter({plant.denominator, chi}, impulse))
      .cwiseAbs()
      .sum();
}

VectorXd unrecorded_past_bound(double largest, double gain, double pole, Index past, Index count) {
  if (!(largest >= 0.0) || !std::isfinite(largest) || !(gain >= 0.0) || !std::isfinite(gain)) {
    fail("unrecorded past: expected a finite input and gain of at least 0, got ", largest, " and ", gain);
  }
  if (!(pole >= 0.0 && pole < 1.0)) fail("unrecorded past: expected a pole of at least 0 and below 1, got ", pole);
  if (past < 0 || count < 1) {
    fail("unrecorded past: expected a past of at least 0 samples and a window of at least 1, got ", past, " and ",
         count);
  }
  return VectorXd::NullaryExpr(count, [&](Index t) {
    return largest * gain * std::pow(pole, static_cast<double>(past + t + 1)) / (1.0 - pole);
  });
}

}  // namespace blockid
