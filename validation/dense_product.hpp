// Products and Cholesky factors of dense matrices of some hundred rows, in the instruction set of this machine.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// A matrix or a part of one, by columns; also its transpose.
using DenseBlock = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using DenseTarget = Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// A B, (m, n) from A (m, k) and B (k, n). Throws Error when the inner sizes differ.
Eigen::MatrixXd product(const DenseBlock& a, const DenseBlock& b);

/// A' diag(d) A, (n, n), symmetric; A (m, n), d (m,): one weight a row of A. Throws Error for another number of
/// weights.
Eigen::MatrixXd weighted_gram(const DenseBlock& a, const Eigen::VectorXd& d);

/// P = L L' of a positive definite matrix (n, n), of which the lower half is read. Throws Error unless it is square.
class CholeskyFactor {
 public:
  CholeskyFactor() = default;
  /// Halves the matrix again and again, so that nearly all of the work are products.
  explicit CholeskyFactor(Eigen::MatrixXd p);

  /// False when the matrix was not positive definite to rounding; then nothing else holds.
  bool positive() const { return positive_; }
  /// L; above its diagonal lie zeros.
  const Eigen::MatrixXd& lower() const { return lower_; }
  /// P^-1, symmetric.
  Eigen::MatrixXd inverse() const;
  /// P^-1 b, (n,). Throws Error for a b of another length.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

 private:
  Eigen::MatrixXd lower_;
  bool positive_ = false;
};

}  // namespace blockid
