// Counts of a signal's values.
#pragma once

#include <Eigen/Core>

namespace blockid::cli {

struct Histogram {
  Eigen::VectorXd centre;  ///< (bins,)
  Eigen::VectorXd share;   ///< (bins,) of all samples; sums to 1
  double width = 0.0;      ///< of one bin, > 0
};

/// x (N,), N >= 1, finite, in bins of equal width from its smallest to its largest value.
Histogram histogram(const Eigen::VectorXd& x, Eigen::Index bins);

}  // namespace blockid::cli
