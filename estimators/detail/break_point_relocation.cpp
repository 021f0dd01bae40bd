#include <blockid/estimators/detail/break_point_relocation.hpp>

#include <algorithm>

namespace blockid::detail {
namespace {

/// How far the two break points of a pair lie from the modulus of its poles.
constexpr double kPairSpread = 1.6;

}  // namespace

Eigen::VectorXd relocated_points(const Eigen::VectorXcd& poles, const FrequencyRange& band) {
  Eigen::VectorXd points = poles.cwiseAbs().cwiseMax(band.low).cwiseMin(band.high);
  std::sort(points.begin(), points.end());
  for (Eigen::Index k = 0; k + 1 < points.size(); k += 2) {
    points[k] /= kPairSpread;
    points[k + 1] *= kPairSpread;
  }
  std::sort(points.begin(), points.end());
  return points;
}

}  // namespace blockid::detail
