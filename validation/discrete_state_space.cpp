#include <blockid/validation/discrete_state_space.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/detail/stable_radius.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <complex>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The input reaches a mode when its share in it is above this, in units of |B|.
constexpr double kReached = 1e-10;

/// (n, k) an orthonormal basis of the columns of m whose singular values are above `least`.
MatrixXd range_of(const MatrixXd& m, double least) {
  if (m.size() == 0) return MatrixXd(m.rows(), 0);
  const Eigen::JacobiSVD<MatrixXd> svd(m, Eigen::ComputeThinU);
  return svd.matrixU().leftCols((svd.singularValues().array() > least).count());
}

MatrixXd beside(const MatrixXd& left, const MatrixXd& right) {
  MatrixXd both(left.rows(), left.cols() + right.cols());
  both << left, right;
  return both;
}

/// (n, k) an orthonormal basis of what the columns of b reach: b, A b, A^2 b, ...
MatrixXd reached(const MatrixXd& a, const MatrixXd& b, double tolerance) {
  const double scale = std::max(a.norm(), b.norm());
  MatrixXd basis = range_of(b, tolerance * scale);
  MatrixXd last = basis;
  while (last.cols() > 0 && basis.cols() < a.rows()) {
    MatrixXd next = a * last;
    // Twice: once leaves what rounding has put back.
    for (int i = 0; i < 2; ++i) next -= basis * (basis.transpose() * next);
    last = range_of(next, tolerance * scale);
    basis = beside(basis, last);
  }
  return basis;
}

DiscreteStateSpace restricted(const DiscreteStateSpace& s, const MatrixXd& basis) {
  return {basis.transpose() * s.a * basis, basis.transpose() * s.b, s.c * basis, s.d};
}

/// (n, k) a real orthonormal basis of the left invariant subspace of the eigenvalues outside `radius`.
MatrixXd unstable_left_subspace(const MatrixXd& a, double radius) {
  const Index n = a.rows();
  const Eigen::ComplexSchur<MatrixXd> schur(a.transpose());
  MatrixXcd t = schur.matrixT();
  MatrixXcd u = schur.matrixU();
  Index count = 0;
  for (Index i = 0; i < n; ++i) {
    if (std::abs(t(i, i)) < radius) continue;
    // To the front, one neighbour after the other.
    for (Index k = i - 1; k >= count; --k) {
      Eigen::JacobiRotation<std::complex<double>> rotation;
      rotation.makeGivens(t(k, k + 1), t(k + 1, k + 1) - t(k, k));
      t.applyOnTheLeft(k, k + 1, rotation.adjoint());
      t.applyOnTheRight(k, k + 1, rotation);
      u.applyOnTheRight(k, k + 1, rotation);
    }
    ++count;
  }
  // Of a subspace that holds the conjugates of its vectors, real and imaginary parts span no more than itself.
  if (count == 0) return MatrixXd(n, 0);
  const MatrixXd parts = beside(u.leftCols(count).real(), u.leftCols(count).imag());
  const Eigen::JacobiSVD<MatrixXd> svd(parts, Eigen::ComputeThinU);
  return svd.matrixU().leftCols(count);
}

/// k with all eigenvalues of a + b k at `pole`, for one state or two, by Ackermann's formula.
Eigen::RowVectorXd gain_to(const MatrixXd& a, const VectorXd& b, double pole) {
  if (a.rows() == 1) return Eigen::RowVectorXd::Constant(1, (pole - a(0, 0)) / b[0]);
  const MatrixXd shifted = a - pole * MatrixXd::Identity(2, 2);
  const Eigen::RowVectorXd last = beside(b, a * b).inverse().row(1);
  return -last * shifted * shifted;
}

/// X with T X - X S = -R, for T and S without a common eigenvalue.
MatrixXd sylvester(const MatrixXd& t, const MatrixXd& s, const MatrixXd& r) {
  const Index rows = t.rows();
  const Index size = rows * s.rows();
  MatrixXd system = MatrixXd::Zero(size, size);
  for (Index j = 0; j < s.rows(); ++j) {
    system.block(j * rows, j * rows, rows, rows) += t;
    for (Index i = 0; i < s.rows(); ++i) {
      system.block(j * rows, i * rows, rows, rows).diagonal().array() -= s(i, j);
    }
  }
  const VectorXd x = system.partialPivLu().solve(-r.reshaped());
  return x.reshaped(rows, s.rows());
}

/// F that moves all eigenvalues of a to `pole`: one or a pair, and then those that are left. `least`: share of an input
/// in a mode that does not count as reaching it.
///
/// U'(A + B F)'U is block triangular: what moves is its first block, and the rest keeps its eigenvalues, whose
/// subspace is then that of U [X; I].
MatrixXd move_all(const MatrixXd& a, const MatrixXd& b, double pole, double least) {
  const Index n = a.rows();
  if (n == 0) return MatrixXd::Zero(b.cols(), 0);
  const Eigen::RealSchur<MatrixXd> schur(a.transpose());
  const MatrixXd& u = schur.matrixU();
  const Index first = n > 1 && schur.matrixT()(1, 0) != 0.0 ? 2 : 1;
  const MatrixXd left = u.leftCols(first);
  const Eigen::JacobiSVD<MatrixXd> svd(left.transpose() * b, Eigen::ComputeThinV);
  const VectorXd direction = svd.matrixV().col(0);
  if (!(svd.singularValues()[0] > least)) {
    fail("feedback: no input reaches a mode on or outside the unit circle");
  }
  const MatrixXd small = schur.matrixT().topLeftCorner(first, first).transpose();
  MatrixXd gain = direction * gain_to(small, left.transpose() * b * direction, pole) * left.transpose();
  if (first == n) return gain;
  const MatrixXd moved = a + b * gain;
  const MatrixXd t = u.transpose() * moved.transpose() * u;
  MatrixXd rest(n, n - first);
  rest << sylvester(t.topLeftCorner(first, first), t.bottomRightCorner(n - first, n - first),
                    t.topRightCorner(first, n - first)),
      MatrixXd::Identity(n - first, n - first);
  const MatrixXd basis = Eigen::HouseholderQR<MatrixXd>(u * rest).householderQ() * MatrixXd::Identity(n, n - first);
  return gain + move_all(basis.transpose() * moved * basis, basis.transpose() * b, pole, least) * basis.transpose();
}

}  // namespace

void check(const DiscreteStateSpace& s, const char* name) {
  const Index n = s.a.rows();
  if (s.d.size() == 0) fail(name, ": expected at least one input and one output");
  if (s.a.cols() != n || s.b.rows() != n || s.b.cols() != s.d.cols() || s.c.cols() != n || s.c.rows() != s.d.rows()) {
    fail(name, ": expected A (n, n), B (n, m), C (p, n), D (p, m), got A (", s.a.rows(), ", ", s.a.cols(), "), B (",
         s.b.rows(), ", ", s.b.cols(), "), C (", s.c.rows(), ", ", s.c.cols(), "), D (", s.d.rows(), ", ", s.d.cols(),
         ")");
  }
  if (!s.a.allFinite() || !s.b.allFinite() || !s.c.allFinite() || !s.d.allFinite()) {
    fail(name, ": expected finite matrices");
  }
}

DiscreteStateSpace static_gain(const MatrixXd& d) {
  return {MatrixXd(0, 0), MatrixXd(0, d.cols()), MatrixXd(d.rows(), 0), d};
}

DiscreteStateSpace state_space(const DiscreteTransferFunction& g) {
  check(g);
  const Index n = std::max(g.numerator.size(), g.denominator.size()) - 1;
  VectorXd numerator = VectorXd::Zero(n + 1);
  VectorXd denominator = VectorXd::Zero(n + 1);
  numerator.head(g.numerator.size()) = g.numerator / g.denominator[0];
  denominator.head(g.denominator.size()) = g.denominator / g.denominator[0];
  DiscreteStateSpace s = static_gain(MatrixXd::Constant(1, 1, numerator[0]));
  s.a = MatrixXd::Zero(n, n);
  s.b = MatrixXd::Zero(n, 1);
  s.c = (numerator - numerator[0] * denominator).tail(n).transpose();
  if (n == 0) return s;
  s.a.row(0) = -denominator.tail(n).transpose();
  s.a.bottomLeftCorner(n - 1, n - 1).setIdentity();
  s.b(0, 0) = 1.0;
  return s;
}

DiscreteStateSpace transfer_matrix(const std::vector<std::vector<DiscreteTransferFunction>>& g) {
  if (g.empty() || g.front().empty()) fail("transfer matrix: expected at least one row and one column");
  const Index p = static_cast<Index>(g.size());
  const Index m = static_cast<Index>(g.front().size());
  DiscreteStateSpace whole = static_gain(MatrixXd::Zero(p, m));
  for (Index i = 0; i < p; ++i) {
    const std::vector<DiscreteTransferFunction>& row = g[static_cast<std::size_t>(i)];
    if (static_cast<Index>(row.size()) != m) {
      fail("transfer matrix: expected rows of ", m, " entries, got one of ", row.size());
    }
    for (Index j = 0; j < m; ++j) {
      const DiscreteStateSpace one = state_space(row[static_cast<std::size_t>(j)]);
      const Index n = whole.states();
      const Index more = one.states();
      whole.a.conservativeResizeLike(MatrixXd::Zero(n + more, n + more));
      whole.b.conservativeResizeLike(MatrixXd::Zero(n + more, m));
      whole.c.conservativeResizeLike(MatrixXd::Zero(p, n + more));
      whole.a.bottomRightCorner(more, more) = one.a;
      whole.b.block(n, j, more, 1) = one.b;
      whole.c.block(i, n, 1, more) = one.c;
      whole.d(i, j) = one.d(0, 0);
    }
  }
  return minimal(whole);
}

DiscreteStateSpace minimal(const DiscreteStateSpace& system, double tolerance) {
  check(system);
  const DiscreteStateSpace half = restricted(system, reached(system.a, system.b, tolerance));
  return restricted(half, reached(half.a.transpose(), half.c.transpose(), tolerance));
}

MatrixXd filter(const DiscreteStateSpace& s, const MatrixXd& u) {
  check(s);
  if (u.rows() != s.inputs()) fail("filter: expected ", s.inputs(), " inputs, got ", u.rows());
  MatrixXd y = s.d * u;
  VectorXd x = VectorXd::Zero(s.states());
  for (Index t = 0; t < u.cols(); ++t) {
    y.col(t) += s.c * x;
    x = (s.a * x + s.b * u.col(t)).eval();
  }
  return y;
}

double spectral_radius(const DiscreteStateSpace& s) {
  return s.states() == 0 ? 0.0 : s.a.eigenvalues().cwiseAbs().maxCoeff();
}

MatrixXd stabilising_feedback(const MatrixXd& a, const MatrixXd& b, double pole) {
  if (!(std::abs(pole) < 1.0)) fail("feedback: expected a pole inside the unit circle, got ", pole);
  if (a.rows() == 0) return MatrixXd::Zero(b.cols(), 0);
  const MatrixXd left = unstable_left_subspace(a, detail::kStableRadius);
  if (left.cols() == 0) return MatrixXd::Zero(b.cols(), a.rows());
  return move_all(left.transpose() * a * left, left.transpose() * b, pole, kReached * b.norm()) * left.transpose();
}

}  // namespace blockid
