// Sums over the rows of a regression: what a long record is reduced to.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace blockid {

using Index = Eigen::Index;

/// G = sum_t d_t d_t' over rows d_t = [J_t, r_t]: J'J, J'r and r'r in one matrix.
///
/// Memory: O(columns^2), whatever the number of rows. Two accumulators of the same width add up.
class NormalEquations {
 public:
  /// columns = P + 1: P regressors (or Jacobian columns) and the residual (or the regressand) last.
  explicit NormalEquations(Index columns);

  Index columns() const { return columns_; }
  Index rows() const { return rows_; }

  /// Adds `rows` rows of a row-major tile; stride is a multiple of 8 and >= columns(). What lies beyond columns() in a
  /// row is read but does not count.
  void add(const double* data, Index rows, Index stride);
  /// Adds what another accumulator of the same width has summed.
  void add(const NormalEquations& other);
  /// Adds a symmetric (columns, columns) matrix of `rows` rows.
  void add(const Eigen::MatrixXd& gram, Index rows);

  /// (columns, columns), symmetric.
  Eigen::MatrixXd gram() const;

 private:
  Index columns_;
  Index stride_;
  Index rows_ = 0;
  std::vector<double> sums_;
};

/// The triangle R of a QR factorisation of all rows, updated tile by tile: R'R = G without squaring the condition
/// number.
class QrTriangle {
 public:
  explicit QrTriangle(Index columns);

  Index columns() const { return triangle_.cols(); }
  Index rows() const { return rows_; }

  void add(const double* data, Index rows, Index stride);

  /// (columns, columns), upper triangular.
  const Eigen::MatrixXd& triangle() const { return triangle_; }

 private:
  Eigen::MatrixXd triangle_;
  Index rows_ = 0;
};

/// Solution of a least-squares problem from its accumulated sums.
struct LinearSolution {
  /// (P,) minimiser of |r - J x|, of minimal norm in the scaled columns when J is rank deficient.
  Eigen::VectorXd x;
  /// |r - J x|^2 at the minimum, never negative.
  double residual_sum_of_squares = 0.0;
  /// Number of directions that the data determine.
  Index rank = 0;
  /// Ratio of the largest to the smallest singular value of J after scaling its columns to unit norm; infinite when
  /// rank deficient.
  double condition = 1.0;
};

/// Relative size of an eigenvalue of the scaled J'J below which its direction counts as undetermined.
inline constexpr double kGramRankTolerance = 1e-13;

/// argmin_x |r - J x|^2 from G = [J r]'[J r], (P+1, P+1): columns scaled to unit norm, eigenvalues of the scaled J'J
/// below `rank_tolerance` times the largest left out.
LinearSolution solve_least_squares(const Eigen::MatrixXd& gram, double rank_tolerance = kGramRankTolerance);

/// Singular values of the scaled columns of a triangle below this share of the largest count as undetermined.
inline constexpr double kTriangleRankTolerance = 1e-13;

/// argmin_x |r - J x|^2 from a triangle of [J r]: columns scaled to unit norm, singular values below `rank_tolerance`
/// times the largest left out. Keeps the digits that J'J loses.
LinearSolution solve_least_squares(const QrTriangle& triangle, double rank_tolerance = kTriangleRankTolerance);

/// M, (P, P) with M M = pseudo-inverse of J'J and its rank: the covariance of the parameters up to the noise variance.
struct PseudoInverse {
  Eigen::MatrixXd matrix;
  Index rank = 0;
  double condition = 1.0;
  /// (P, P - rank) directions that the data do not determine, unit norm in the scaled parameters.
  Eigen::MatrixXd null_space;
};

/// Pseudo-inverse of a symmetric positive semidefinite matrix after scaling its diagonal to one.
PseudoInverse scaled_pseudo_inverse(const Eigen::MatrixXd& normal_matrix, double rank_tolerance = kGramRankTolerance);
/// That of J'J from a triangle of [J r].
PseudoInverse scaled_pseudo_inverse(const QrTriangle& triangle, double rank_tolerance = kTriangleRankTolerance);

/// P + 1 rows with the same cost, gradient and Gauss-Newton matrix as all the rows summed in G.
struct CompressedRows {
  /// (P + 1,) q with q'q = r'r.
  Eigen::VectorXd residuals;
  /// (P + 1, P) R with R'R = J'J and R'q = J'r; the last row is zero.
  Eigen::MatrixXd jacobian;
};

/// Square root of the accumulated sums, by eigenvalues of the scaled J'J.
CompressedRows compress(const Eigen::MatrixXd& gram);
/// The same from a QR triangle, which needs no square root.
CompressedRows compress(const QrTriangle& triangle);

}  // namespace blockid
