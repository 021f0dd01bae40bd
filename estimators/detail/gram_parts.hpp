// Parts of the accumulated sums that belong to some of the unknowns.
#pragma once

#include <blockid/estimators/static_parameters.hpp>

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
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

/// Share of the largest column of a local basis, by norm, below which the data do not determine a parameter: a single
/// sample that reaches a hundredth of a knot interval into a cubic B-spline, (0.01)^3 / 6, stays below it. What such a
/// sample says of the parameter is its own noise a million times enlarged.
inline constexpr double kUntouched = 1e-6;

/// Parameters of local bases that the data hardly touch, ascending.
/// @param gram (P + 1, P + 1) or larger, its first rows belong to theta.
inline std::vector<Index> untouched_parameters(const Eigen::MatrixXd& gram, const std::vector<LocalBasis>& bases) {
  std::vector<Index> untouched;
  for (const LocalBasis& basis : bases) {
    double largest = 0.0;
    for (const Index k : basis) largest = std::max(largest, gram(k, k));
    if (!std::isfinite(largest)) continue;
    for (const Index k : basis) {
      if (gram(k, k) <= kUntouched * kUntouched * largest) untouched.push_back(k);
    }
  }
  std::sort(untouched.begin(), untouched.end());
  return untouched;
}

/// Rows and columns of the given unknowns become zero: a least-squares solution then leaves them as they are.
inline void leave_out(const std::vector<Index>& unknowns, Eigen::MatrixXd& gram) {
  for (const Index k : unknowns) {
    gram.row(k).setZero();
    gram.col(k).setZero();
  }
}

}  // namespace blockid::detail
