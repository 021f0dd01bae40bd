// Long records made short for pictures.
#pragma once

#include <Eigen/Core>

namespace blockid::cli {

/// Smallest and largest value of each bucket, so that no peak gets lost.
struct Envelope {
  Eigen::VectorXd position;  ///< (buckets,) middle of each bucket in samples
  Eigen::VectorXd lower;     ///< (buckets,)
  Eigen::VectorXd upper;     ///< (buckets,)
};

/// x (N,) in at most `buckets` buckets of equal length (the last may be shorter), each with the last sample of the one
/// before, so that the picture has no gaps; non-finite samples are passed over, a bucket of nothing else is NaN.
Envelope envelope(const Eigen::VectorXd& x, Eigen::Index buckets);

/// First sample of the stretch of `length` samples with the largest sum of squares of e.
Eigen::Index worst_stretch(const Eigen::VectorXd& e, Eigen::Index length);

}  // namespace blockid::cli
