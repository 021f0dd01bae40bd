// Parts of the accumulated sums that belong to some of the unknowns.
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <vector>

namespace blockid::detail {

using Index = Eigen::Index;

/// Rows and columns of the given unknowns and of the residual: (k + 1, k + 1).
inline Eigen::MatrixXd gram_of(const Eigen::MatrixXd& gram, const std::vector<Index>& unknowns) {
  std::vector<Index> kept = unknowns;
  kept.push_back(gram.cols() - 1);
  return gram(kept, kept);
}

/// The unknowns that are not listed; `listed` ascending.
inline std::vector<Index> complement(const std::vector<Index>& listed, Index count) {
  std::vector<Index> rest;
  std::size_t next = 0;
  for (Index k = 0; k < count; ++k) {
    if (next < listed.size() && listed[next] == k) {
      ++next;
    } else {
      rest.push_back(k);
    }
  }
  return rest;
}

}  // namespace blockid::detail
