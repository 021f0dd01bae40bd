#include <blockid/validation/dense_product.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/detail/dense_kernels.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>
#include <vector>

namespace blockid {
namespace {

using detail::MatrixView;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Below this size Eigen factorises.
constexpr Index kSmall = 48;
/// Columns in a strip of a product of triangles.
constexpr Index kStrip = 96;

MatrixView view(const DenseBlock& m) { return {m.data(), 1, m.outerStride()}; }
MatrixView transposed(const DenseBlock& m) { return {m.data(), m.outerStride(), 1}; }

enum class Part { whole, lower };

/// C += factor A B, inner: columns of A.
void add_product(double factor, MatrixView a, MatrixView b, Index inner, DenseTarget c, Part part) {
  if (c.size() == 0 || inner == 0) return;
  static thread_local std::vector<double> workspace(detail::kProductWorkspace);
  detail::dense_kernels().add_product(c.rows(), c.cols(), inner, factor, a, b, c.data(), c.outerStride(),
                                      part == Part::lower, workspace.data());
}

void mirror(MatrixXd& m) { m.triangularView<Eigen::StrictlyUpper>() = m.transpose(); }

/// Half of n, in whole tiles.
Index half(Index n) { return (n / 2 + 7) / 8 * 8; }

/// X = X L'^-1.
void divide_by_transpose(const DenseBlock& lower, DenseTarget x) {
  const Index n = lower.rows();
  if (n <= kSmall) {
    lower.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(x);
    return;
  }
  const Index first = half(n);
  const Index rest = n - first;
  divide_by_transpose(lower.topLeftCorner(first, first), x.leftCols(first));
  add_product(-1.0, view(x.leftCols(first)), transposed(lower.bottomLeftCorner(rest, first)), first, x.rightCols(rest),
              Part::whole);
  divide_by_transpose(lower.bottomRightCorner(rest, rest), x.rightCols(rest));
}

bool factorise(DenseTarget p) {
  const Index n = p.rows();
  if (n <= kSmall) return Eigen::LLT<Eigen::Ref<MatrixXd, 0, Eigen::OuterStride<>>>(p).info() == Eigen::Success;
  const Index first = half(n);
  const Index rest = n - first;
  if (!factorise(p.topLeftCorner(first, first))) return false;
  const DenseTarget below = p.bottomLeftCorner(rest, first);
  divide_by_transpose(p.topLeftCorner(first, first), below);
  add_product(-1.0, view(below), transposed(below), first, p.bottomRightCorner(rest, rest), Part::lower);
  return factorise(p.bottomRightCorner(rest, rest));
}

/// inverse = L^-1; it holds zeros.
void invert(const DenseBlock& lower, DenseTarget inverse) {
  const Index n = lower.rows();
  if (n <= kSmall) {
    inverse.setIdentity();
    lower.triangularView<Eigen::Lower>().solveInPlace(inverse);
    return;
  }
  const Index first = half(n);
  const Index rest = n - first;
  invert(lower.topLeftCorner(first, first), inverse.topLeftCorner(first, first));
  invert(lower.bottomRightCorner(rest, rest), inverse.bottomRightCorner(rest, rest));
  const MatrixXd between = product(lower.bottomLeftCorner(rest, first), inverse.topLeftCorner(first, first));
  add_product(-1.0, view(inverse.bottomRightCorner(rest, rest)), view(between), rest,
              inverse.bottomLeftCorner(rest, first), Part::whole);
}

}  // namespace

MatrixXd product(const DenseBlock& a, const DenseBlock& b) {
  if (a.cols() != b.rows()) {
    fail("product: expected as many rows of B as columns of A, ", a.cols(), ", got ", b.rows());
  }
  MatrixXd c = MatrixXd::Zero(a.rows(), b.cols());
  add_product(1.0, view(a), view(b), a.cols(), c, Part::whole);
  return c;
}

MatrixXd weighted_gram(const DenseBlock& a, const VectorXd& d) {
  if (d.size() != a.rows())
    fail("weighted Gram matrix: expected a weight for each of ", a.rows(), " rows, got ", d.size());
  const MatrixXd weighted = d.asDiagonal() * a;
  MatrixXd c = MatrixXd::Zero(a.cols(), a.cols());
  add_product(1.0, transposed(a), view(weighted), a.rows(), c, Part::lower);
  mirror(c);
  return c;
}

CholeskyFactor::CholeskyFactor(MatrixXd p) : lower_(std::move(p)) {
  if (lower_.rows() != lower_.cols()) {
    fail("Cholesky factor: expected a square matrix, got ", lower_.rows(), " x ", lower_.cols());
  }
  // A comparison with zero lets NaN through.
  positive_ = factorise(lower_) && lower_.diagonal().allFinite();
  lower_.triangularView<Eigen::StrictlyUpper>().setZero();
}

MatrixXd CholeskyFactor::inverse() const {
  const Index n = lower_.rows();
  MatrixXd root = MatrixXd::Zero(n, n);
  invert(lower_, root);
  MatrixXd result = MatrixXd::Zero(n, n);
  // Rows first.. of L'^-1 begin with first zeros.
  for (Index first = 0; first < n; first += kStrip) {
    const Index count = std::min(kStrip, n - first);
    const Index inner = n - first;
    add_product(1.0, transposed(root.block(first, first, inner, count)), view(root.bottomLeftCorner(inner, first)),
                inner, result.block(first, 0, count, first), Part::whole);
    add_product(1.0, transposed(root.block(first, first, inner, count)), view(root.block(first, first, inner, count)),
                inner, result.block(first, first, count, count), Part::lower);
  }
  mirror(result);
  return result;
}

VectorXd CholeskyFactor::solve(const VectorXd& b) const {
  if (b.size() != lower_.rows())
    fail("Cholesky factor: expected a right-hand side of ", lower_.rows(), " numbers, got ", b.size());
  VectorXd x = b;
  lower_.triangularView<Eigen::Lower>().solveInPlace(x);
  lower_.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  return x;
}

}  // namespace blockid
