#include <blockid/cli/report/histogram.hpp>

#include <algorithm>

namespace blockid::cli {

using Eigen::Index;

Histogram histogram(const Eigen::VectorXd& x, Index bins) {
  const double lower = x.minCoeff();
  const double spread = x.maxCoeff() - lower;
  const double width = (spread > 0.0 ? spread : 1.0) / static_cast<double>(bins);
  Histogram result{Eigen::VectorXd(bins), Eigen::VectorXd::Zero(bins), width};
  for (Index k = 0; k < bins; ++k) result.centre[k] = lower + (static_cast<double>(k) + 0.5) * width;
  for (const double value : x) {
    result.share[std::clamp<Index>(static_cast<Index>((value - lower) / width), 0, bins - 1)] += 1.0;
  }
  result.share /= static_cast<double>(x.size());
  return result;
}

}  // namespace blockid::cli
