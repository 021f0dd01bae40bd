// Break points of time-domain fits that move to where the poles are.
#include <blockid/estimators/continuous_fit.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/break_point_relocation.hpp>
#include <blockid/estimators/detail/continuous_fit_in_basis.hpp>
#include <blockid/estimators/excited_band.hpp>

#include <limits>
#include <utility>

namespace blockid {
namespace {

using Eigen::VectorXd;

constexpr int kMaxRelocations = 5;
/// Fits whose simulations differ by less are one: then the smaller drift is better.
constexpr double kSameRms = 1.0 + 1e-6;

/// A fit with what it is judged by.
struct Judged {
  ContinuousFit fit;
  double rms = std::numeric_limits<double>::infinity();

  bool better_than(const Judged& other) const {
    if (fit.flags.unstable != other.fit.flags.unstable) return other.fit.flags.unstable;
    if (rms > other.rms * kSameRms) return false;
    return rms * kSameRms < other.rms || fit.drift < other.fit.drift;
  }
};

ContinuousFit relocated(const DataSet& data, const RationalBasis& given, ContinuousFit start,
                        const ContinuousFitOptions& options) {
  const FrequencyRange all = sampled_band(data);
  Judged best{std::move(start), 0.0};
  best.rms = simulation_rms(best.fit.model, data, options);
  int relocations = 0;
  const auto attempt = [&](const VectorXd& points) {
    RationalBasis basis = given;
    basis.points = points;
    Judged next{detail::fit_in_basis(data, basis, options), 0.0};
    next.rms = simulation_rms(next.fit.model, data, options);
    ++relocations;
    if (next.better_than(best)) best = next;
    return next.fit;
  };
  const auto settle = [&](ContinuousFit current) {
    for (int k = 0; k < kMaxRelocations && current.flags.drift; ++k) {
      current = attempt(detail::relocated_points(poles(current.model), all));
    }
  };
  settle(best.fit);
  const FrequencyRange band = excited_band(data);
  settle(attempt(break_points(band.low, band.high, given.order)));
  best.fit.relocations = relocations;
  best.fit.flags.relocated = best.fit.model.basis.points != given.points;
  return best.fit;
}

}  // namespace

ContinuousFit fit_continuous(const DataSet& data, const RationalBasis& basis, const ContinuousFitOptions& options) {
  ContinuousFit fit = detail::fit_in_basis(data, basis, options);
  if (!options.relocate || !fit.flags.drift) return fit;
  const bool outside = fit.flags.break_points_outside_band;
  fit = relocated(data, basis, std::move(fit), options);
  fit.flags.break_points_outside_band = outside;
  return fit;
}

ContinuousFit fit_continuous(const DataSet& data, Index numerator_degree, Index order,
                             const ContinuousFitOptions& options) {
  check(data);
  if (order < 1) fail("continuous fit: expected an order of at least 1, got ", order);
  const FrequencyRange band = excited_band(data);
  return fit_continuous(data, localising_basis(break_points(band.low, band.high, order), numerator_degree), options);
}

}  // namespace blockid
