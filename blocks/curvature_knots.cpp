#include <blockid/blocks/curvature_knots.hpp>

#include <blockid/blocks/detail/knot_insertion.hpp>
#include <blockid/blocks/detail/signal_range.hpp>
#include <blockid/data/error.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace blockid {
namespace {

/// Points of the grid for each knot: several between neighbours wherever they end up.
constexpr Index kPointsPerKnot = 20;
/// The best density of knots for pieces of straight lines is this power of the squared bend times the density of v.
constexpr double kPower = 1.0 / 5.0;
/// Share of the mean density that is added everywhere, for bends that the curve does not show yet.
constexpr double kFloor = 0.05;

/// |f''| on a uniform grid by second differences; the outermost points take their neighbours' values.
Eigen::ArrayXd bends(const std::function<double(double)>& f, SignalRange range, Index points) {
  const double step = (range.upper - range.lower) / static_cast<double>(points - 1);
  Eigen::ArrayXd values(points);
  for (Index k = 0; k < points; ++k) values[k] = f(range.lower + step * static_cast<double>(k));
  if (!values.allFinite()) fail("curvature_knots: the curve is not finite on the range of its input");
  Eigen::ArrayXd bend(points);
  for (Index k = 1; k + 1 < points; ++k) {
    bend[k] = std::abs(values[k - 1] - 2.0 * values[k] + values[k + 1]) / (step * step);
  }
  bend[0] = bend[1];
  bend[points - 1] = bend[points - 2];
  return bend;
}

/// Samples of v around each point of the grid, smoothed over three.
Eigen::ArrayXd histogram(std::span<const double> v, SignalRange range, Index points) {
  Eigen::ArrayXd counts = Eigen::ArrayXd::Zero(points);
  const double per_unit = static_cast<double>(points - 1) / (range.upper - range.lower);
  for (const double x : v) counts[std::lround((x - range.lower) * per_unit)] += 1.0;
  Eigen::ArrayXd smooth = counts;
  for (Index k = 1; k + 1 < points; ++k) smooth[k] = (counts[k - 1] + counts[k] + counts[k + 1]) / 3.0;
  return smooth;
}

/// Integral of the density up to each point, by trapezoids.
Eigen::ArrayXd accumulated(const Eigen::ArrayXd& density) {
  Eigen::ArrayXd sums = Eigen::ArrayXd::Zero(density.size());
  for (Index k = 1; k < density.size(); ++k) sums[k] = sums[k - 1] + 0.5 * (density[k - 1] + density[k]);
  return sums;
}

/// The place on the grid, in steps, where a share `level` of the integral lies to the left.
double place_of(const Eigen::ArrayXd& sums, double level) {
  const double wanted = level * sums[sums.size() - 1];
  Index k = 1;
  while (k + 1 < sums.size() && sums[k] < wanted) ++k;
  return static_cast<double>(k - 1) + (wanted - sums[k - 1]) / (sums[k] - sums[k - 1]);
}

}  // namespace

std::vector<double> curvature_knots(std::span<const double> v, const std::function<double(double)>& f, Index count) {
  const Index regular = std::max<Index>(2, (count + 1) / 2);
  std::vector<double> mixed = place_knots(v, count, KnotPlacement::mixed);
  if (regular == count) return mixed;
  std::vector<double> knots = place_knots(v, regular, KnotPlacement::mixed);
  const SignalRange range = detail::range_of(v, "curvature_knots");
  const Index points = kPointsPerKnot * count + 1;
  Eigen::ArrayXd density = (bends(f, range, points).square() * histogram(v, range, points)).pow(kPower);
  const double mean = density.mean();
  density += mean > 0.0 ? kFloor * mean : 1.0;
  const Eigen::ArrayXd sums = accumulated(density);
  const double width = range.upper - range.lower;
  const double step = width / static_cast<double>(points - 1);
  const double spacing = width / (100.0 * static_cast<double>(count - 1));
  for (Index k = 1; k <= count - regular; ++k) {
    const double level = static_cast<double>(k) / static_cast<double>(count - regular + 1);
    detail::insert_apart(knots, range.lower + step * place_of(sums, level), spacing);
  }
  while (std::ssize(knots) < count) detail::halve_widest(knots);
  return knots;
}

}  // namespace blockid
