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

constexpr int kMaxTimeDomainRelocations = 5;
/// Fits whose simulations differ by less are one: then the smaller drift is better.
constexpr double kSameRms = 1.0 + 1e-6;

/// A stable model may be this much worse than one that is not: a system that is unstable leaves no stable model near
/// it.
constexpr double kPriceOfStability = 2.0;

/// A fit with what it is judged by.
struct Judged {
  ContinuousFit fit;
  double rms = std::numeric_limits<double>::infinity();

  bool better_than(const Judged& other) const {
    if (fit.flags.unstable != other.fit.flags.unstable) {
      return other.fit.flags.unstable ? rms <= kPriceOfStability * other.rms : kPriceOfStability * rms < other.rms;
    }
    if (rms > other.rms * kSameRms) return false;
    return rms * kSameRms < other.rms || fit.drift < other.fit.drift;
  }
};

/// Fits with several sets of break points, the best of which is kept.
class BreakPointSearch {
 public:
  BreakPointSearch(const DataSet& data, ContinuousFit start, const ContinuousFitOptions& options)
      : data_(data), options_(options), given_(start.model.basis), best_{std::move(start), 0.0} {
    best_.rms = simulation_rms(best_.fit.model, data, options);
  }

  const ContinuousFit& best() const { return best_.fit; }

  ContinuousFit attempt(const VectorXd& points) {
    RationalBasis basis = given_;
    basis.points = points;
    Judged next{detail::fit_in_basis(data_, basis, options_), 0.0};
    next.rms = simulation_rms(next.fit.model, data_, options_);
    ++relocations_;
    if (next.better_than(best_)) best_ = next;
    return next.fit;
  }

  /// To the moduli of the poles found, as long as |A/E| drifts.
  void settle(ContinuousFit current) {
    const FrequencyRange all = sampled_band(data_);
    for (int k = 0; k < kMaxTimeDomainRelocations && current.flags.drift; ++k) {
      current = attempt(detail::relocated_points(poles(current.model), all));
    }
  }

  ContinuousFit result() const {
    ContinuousFit fit = best_.fit;
    fit.relocations = relocations_;
    fit.flags.relocated = fit.model.basis.points != given_.points;
    return fit;
  }

 private:
  const DataSet& data_;
  const ContinuousFitOptions& options_;
  RationalBasis given_;
  Judged best_;
  int relocations_ = 0;
};

/// Where iterations start decides on where they end; poles lie in some part of the band.
void search_convergence(BreakPointSearch& search, const FrequencyRange& band, Index order) {
  for (const FrequencyRange& part :
       {FrequencyRange{band.low, band.high / 4.0}, FrequencyRange{band.low, band.high / 2.0},
        FrequencyRange{4.0 * band.low, band.high}, FrequencyRange{band.low, band.high / 16.0}}) {
    if (!search.best().flags.not_converged) return;
    if (part.low < part.high) search.attempt(break_points(part.low, part.high, order));
  }
}

}  // namespace

ContinuousFit fit_continuous(const DataSet& data, const RationalBasis& basis, const ContinuousFitOptions& options) {
  ContinuousFit fit = detail::fit_in_basis(data, basis, options);
  const bool good = !fit.flags.drift && !fit.flags.not_converged;
  if (!options.relocate || good || basis.kind != BasisKind::localising) return fit;
  const bool outside = fit.flags.break_points_outside_band;
  const FrequencyRange band = excited_band(data);
  BreakPointSearch search(data, fit, options);
  if (fit.flags.drift) {
    search.settle(fit);
    search.settle(search.attempt(break_points(band.low, band.high, basis.order)));
  }
  search_convergence(search, band, basis.order);
  fit = search.result();
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
