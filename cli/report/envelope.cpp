#include <blockid/cli/report/envelope.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace blockid::cli {

using Eigen::Index;

Envelope envelope(const Eigen::VectorXd& x, Index buckets) {
  const Index length = std::max<Index>(1, (x.size() + buckets - 1) / buckets);
  const Index count = (x.size() + length - 1) / length;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Envelope result{Eigen::VectorXd(count), Eigen::VectorXd::Constant(count, kNone),
                  Eigen::VectorXd::Constant(count, kNone)};
  for (Index k = 0; k < count; ++k) {
    const Index begin = k * length;
    const Index end = std::min(begin + length, x.size());
    result.position[k] = 0.5 * static_cast<double>(begin + end - 1);
    for (Index t = std::max<Index>(begin - 1, 0); t < end; ++t) {
      if (!std::isfinite(x[t])) continue;
      result.lower[k] = std::isnan(result.lower[k]) ? x[t] : std::min(result.lower[k], x[t]);
      result.upper[k] = std::isnan(result.upper[k]) ? x[t] : std::max(result.upper[k], x[t]);
    }
  }
  return result;
}

Index worst_stretch(const Eigen::VectorXd& e, Index length) {
  if (length >= e.size()) return 0;
  double sum = e.head(length).squaredNorm();
  double largest = sum;
  Index worst = 0;
  for (Index begin = 1; begin + length <= e.size(); ++begin) {
    sum += e[begin + length - 1] * e[begin + length - 1] - e[begin - 1] * e[begin - 1];
    if (sum > largest) {
      largest = sum;
      worst = begin;
    }
  }
  return worst;
}

}  // namespace blockid::cli
