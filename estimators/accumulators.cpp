#include <blockid/estimators/accumulators.hpp>

#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/kernels.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/row_major.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

using detail::RowMajor;

/// Eigen-decomposition of D^-1 A D^-1 with D = sqrt(diag A): columns of different units become comparable.
struct ScaledEigen {
  Eigen::VectorXd scale;
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
  double threshold = 0.0;
  Index rank = 0;
  double condition = 1.0;
};

ScaledEigen decompose(const Eigen::MatrixXd& a, double rank_tolerance) {
  ScaledEigen result;
  const Index n = a.rows();
  result.scale = a.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (Index k = 0; k < n; ++k) {
    if (!(result.scale[k] > 0.0)) result.scale[k] = 1.0;
  }
  if (n == 0) return result;
  const Eigen::VectorXd inverse = result.scale.cwiseInverse();
  const Eigen::MatrixXd scaled = inverse.asDiagonal() * a * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
  result.values = solver.eigenvalues();
  result.vectors = solver.eigenvectors();
  const double largest = std::max(result.values[n - 1], 0.0);
  result.threshold = rank_tolerance * largest;
  for (Index k = 0; k < n; ++k) {
    if (result.values[k] > result.threshold) ++result.rank;
  }
  result.condition =
      result.rank == n && n > 0 ? std::sqrt(largest / result.values[0]) : std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace

NormalEquations::NormalEquations(Index columns)
    : columns_(columns), stride_(padded_columns(columns)), sums_(static_cast<std::size_t>(stride_ * stride_), 0.0) {
  if (columns < 1) fail("normal equations: expected at least one column, got ", columns);
}

void NormalEquations::add(const double* data, Index rows, Index stride) {
  detail::kernels().add_gram(data, rows, stride, columns_, sums_.data(), stride_);
  rows_ += rows;
}

void NormalEquations::add(const NormalEquations& other) {
  if (other.columns_ != columns_) {
    fail("normal equations: cannot add ", other.columns_, " columns to ", columns_);
  }
  std::transform(sums_.begin(), sums_.end(), other.sums_.begin(), sums_.begin(), std::plus<>());
  rows_ += other.rows_;
}

void NormalEquations::add(const Eigen::MatrixXd& gram, Index rows) {
  if (gram.rows() != columns_ || gram.cols() != columns_) {
    fail("normal equations: expected a matrix of ", columns_, " columns, got ", gram.rows(), " x ", gram.cols());
  }
  for (Index i = 0; i < columns_; ++i) {
    for (Index j = i; j < columns_; ++j) sums_[static_cast<std::size_t>(i * stride_ + j)] += gram(i, j);
  }
  rows_ += rows;
}

Eigen::MatrixXd NormalEquations::gram() const {
  Eigen::MatrixXd result(columns_, columns_);
  for (Index i = 0; i < columns_; ++i) {
    for (Index j = i; j < columns_; ++j) {
      result(i, j) = sums_[static_cast<std::size_t>(i * stride_ + j)];
      result(j, i) = result(i, j);
    }
  }
  return result;
}

QrTriangle::QrTriangle(Index columns) : triangle_(Eigen::MatrixXd::Zero(columns, columns)) {
  if (columns < 1) fail("QR triangle: expected at least one column, got ", columns);
}

void QrTriangle::add(const double* data, Index rows, Index stride) {
  const Index columns = triangle_.cols();
  Eigen::MatrixXd stacked(columns + rows, columns);
  stacked.topRows(columns) = triangle_;
  stacked.bottomRows(rows) =
      Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>>(data, rows, columns, Eigen::OuterStride<>(stride));
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(stacked);
  triangle_ = qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
  rows_ += rows;
}

namespace {

/// J of a triangle of [J r] with columns of unit norm, taken apart.
struct ScaledSingular {
  explicit ScaledSingular(const QrTriangle& triangle, double rank_tolerance) {
    const Index n = triangle.columns() - 1;
    const Eigen::MatrixXd J = triangle.triangle().topLeftCorner(n, n);
    unscale = J.colwise().norm();
    for (double& value : unscale) value = value > 0.0 ? 1.0 / value : 1.0;
    svd.compute(J * unscale.asDiagonal(), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::VectorXd& values = svd.singularValues();
    inverse = Eigen::VectorXd::Zero(n);
    while (rank < n && values[rank] > rank_tolerance * values[0]) {
      inverse[rank] = 1.0 / values[rank];
      ++rank;
    }
    condition = rank == n ? values[0] / values[n - 1] : std::numeric_limits<double>::infinity();
  }

  /// (n, n) W with W W' = pseudo-inverse of J'J.
  Eigen::MatrixXd root() const { return unscale.asDiagonal() * svd.matrixV() * inverse.asDiagonal(); }

  Eigen::JacobiSVD<Eigen::MatrixXd> svd;
  Eigen::VectorXd unscale;
  Eigen::VectorXd inverse;
  Index rank = 0;
  double condition = 1.0;
};

}  // namespace

LinearSolution solve_least_squares(const QrTriangle& triangle, double rank_tolerance) {
  const Index n = triangle.columns() - 1;
  const Eigen::VectorXd r = triangle.triangle().col(n);
  if (n == 0) return {Eigen::VectorXd(), r.squaredNorm(), 0, 1.0};
  const ScaledSingular singular(triangle, rank_tolerance);
  LinearSolution solution;
  solution.rank = singular.rank;
  solution.condition = singular.condition;
  solution.x = singular.root() * (singular.svd.matrixU().transpose() * r.head(n));
  const Eigen::VectorXd left = r.head(n) - triangle.triangle().topLeftCorner(n, n) * solution.x;
  solution.residual_sum_of_squares = left.squaredNorm() + r[n] * r[n];
  return solution;
}

PseudoInverse scaled_pseudo_inverse(const QrTriangle& triangle, double rank_tolerance) {
  const Index n = triangle.columns() - 1;
  if (n == 0) return {};
  const ScaledSingular singular(triangle, rank_tolerance);
  const Eigen::MatrixXd root = singular.root();
  return {root * root.transpose(), singular.rank, singular.condition,
          singular.unscale.asDiagonal() * singular.svd.matrixV().rightCols(n - singular.rank)};
}

LinearSolution solve_least_squares(const Eigen::MatrixXd& gram, double rank_tolerance) {
  const Index n = gram.rows() - 1;
  const ScaledEigen eigen = decompose(gram.topLeftCorner(n, n), rank_tolerance);
  LinearSolution solution;
  solution.rank = eigen.rank;
  solution.condition = eigen.condition;
  solution.x = Eigen::VectorXd::Zero(n);
  double explained = 0.0;
  if (n > 0) {
    Eigen::VectorXd rotated = eigen.vectors.transpose() * (gram.col(n).head(n).array() / eigen.scale.array()).matrix();
    for (Index k = 0; k < n; ++k) {
      if (eigen.values[k] > eigen.threshold) {
        explained += rotated[k] * rotated[k] / eigen.values[k];
        rotated[k] /= eigen.values[k];
      } else {
        rotated[k] = 0.0;
      }
    }
    solution.x = ((eigen.vectors * rotated).array() / eigen.scale.array()).matrix();
  }
  solution.residual_sum_of_squares = std::max(gram(n, n) - explained, 0.0);
  return solution;
}

PseudoInverse scaled_pseudo_inverse(const Eigen::MatrixXd& normal_matrix, double rank_tolerance) {
  const Index n = normal_matrix.rows();
  const ScaledEigen eigen = decompose(normal_matrix, rank_tolerance);
  PseudoInverse result;
  result.rank = eigen.rank;
  result.condition = eigen.condition;
  if (n == 0) return result;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(n);
  for (Index k = 0; k < n; ++k) {
    if (eigen.values[k] > eigen.threshold) inverse[k] = 1.0 / eigen.values[k];
  }
  const Eigen::VectorXd unscale = eigen.scale.cwiseInverse();
  result.matrix =
      unscale.asDiagonal() * (eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose()) * unscale.asDiagonal();
  result.null_space = unscale.asDiagonal() * eigen.vectors.leftCols(n - eigen.rank);
  return result;
}

CompressedRows compress(const Eigen::MatrixXd& gram) {
  const Index n = gram.rows() - 1;
  CompressedRows rows{Eigen::VectorXd::Zero(n + 1), Eigen::MatrixXd::Zero(n + 1, n)};
  double explained = 0.0;
  if (n > 0) {
    // Only what rounding alone could have produced is left out: the rows must keep the gradient.
    const ScaledEigen eigen = decompose(gram.topLeftCorner(n, n), std::numeric_limits<double>::epsilon());
    const Eigen::VectorXd rotated =
        eigen.vectors.transpose() * (gram.col(n).head(n).array() / eigen.scale.array()).matrix();
    for (Index k = 0; k < n; ++k) {
      if (!(eigen.values[k] > eigen.threshold)) continue;
      const double root = std::sqrt(eigen.values[k]);
      rows.jacobian.row(k) = root * (eigen.vectors.col(k).array() * eigen.scale.array()).matrix().transpose();
      rows.residuals[k] = rotated[k] / root;
      explained += rows.residuals[k] * rows.residuals[k];
    }
  }
  rows.residuals[n] = std::sqrt(std::max(gram(n, n) - explained, 0.0));
  return rows;
}

CompressedRows compress(const QrTriangle& triangle) {
  const Index n = triangle.columns() - 1;
  return {triangle.triangle().col(n), triangle.triangle().leftCols(n)};
}

}  // namespace blockid
