// Coefficients of powers of s that are zero, as linear constraints on the coordinates of a basis.
#pragma once

#include <blockid/estimators/rational_basis.hpp>

#include <Eigen/Core>

#include <vector>

namespace blockid::detail {

/// All [b; a], (m + 1 + n,), that leave the coefficients out: [b; a] = offset + directions q. In powers of s each
/// coefficient is a coordinate; in other bases it is sum_k M_jk a_k + e_j, with the coefficients of phi_k E and E.
struct CoefficientSubspace {
  Eigen::VectorXd offset;      ///< (m + 1 + n,)
  Eigen::MatrixXd directions;  ///< (m + 1 + n, m + 1 + n - K), orthonormal columns
  /// Of c, b and a: the c in front stay as they are.
  CoefficientSubspace with_free_front(Index count) const;
};

/// b_j = 0 for j in `numerator`, a_j = 0 for j in `denominator`, B(s) and A(s) by powers of s, A monic.
/// Throws Error for a power outside 0..m (0..n-1) or given twice, for a numerator of which nothing is left, and for a
/// basis whose polynomials overflow.
CoefficientSubspace subspace_without(const RationalBasis& basis, const std::vector<Index>& numerator,
                                     const std::vector<Index>& denominator);

}  // namespace blockid::detail
