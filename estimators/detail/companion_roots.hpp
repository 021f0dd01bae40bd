// Roots of a polynomial as eigenvalues.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

namespace blockid::detail {

/// Roots (n,) of z^n + m_1 z^(n-1) + ... + m_n, the eigenvalues of its companion matrix. monic: (n,) m_1 .. m_n, n
/// >= 1.
inline Eigen::VectorXcd companion_roots(const Eigen::VectorXd& monic) {
  const Eigen::Index n = monic.size();
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  companion.row(0) = -monic.transpose();
  companion.diagonal(-1).setOnes();
  return Eigen::EigenSolver<Eigen::MatrixXd>(companion, false).eigenvalues();
}

}  // namespace blockid::detail
