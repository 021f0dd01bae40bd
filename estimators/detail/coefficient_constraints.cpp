#include <blockid/estimators/detail/coefficient_constraints.hpp>

#include <blockid/data/error.hpp>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace blockid::detail {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void check_powers(std::vector<Index> powers, Index count, char letter) {
  std::sort(powers.begin(), powers.end());
  for (std::size_t k = 0; k < powers.size(); ++k) {
    if (powers[k] < 0 || powers[k] >= count) {
      fail("continuous fit: coefficient ", letter, powers[k], " cannot be left out, expected ", letter, "0 to ", letter,
           count - 1);
    }
    if (k > 0 && powers[k] == powers[k - 1])
      fail("continuous fit: coefficient ", letter, powers[k], " is left out twice");
  }
}

/// Geometric mean of the points, in whose units coefficients are of like size.
double scale_of(const RationalBasis& basis) {
  if (basis.kind == BasisKind::kautz) return basis.points[0];
  return std::exp(basis.points.array().log().mean());
}

/// C [b; a] = r, a row of unit norm for each coefficient.
struct Constraints {
  MatrixXd c;
  VectorXd r;
};

Constraints constraints_of(const RationalBasis& basis, const std::vector<Index>& numerator,
                           const std::vector<Index>& denominator) {
  const Index m = basis.numerator_degree + 1;
  const Index n = basis.order;
  const BasisPolynomials powers = polynomials(basis, scale_of(basis));
  if (!powers.lead.allFinite() || !powers.phi.allFinite() || !powers.psi.allFinite()) {
    fail("continuous fit: the coefficients of powers of s overflow over so wide a band, none can be left out");
  }
  Constraints result{MatrixXd::Zero(std::ssize(numerator) + std::ssize(denominator), m + n), {}};
  result.r = VectorXd::Zero(result.c.rows());
  Index row = 0;
  for (const Index power : numerator) result.c.row(row++).head(m) = powers.psi.row(power);
  for (const Index power : denominator) {
    result.c.row(row).tail(n) = powers.phi.row(power);
    result.r[row++] = -powers.lead[power];
  }
  for (Index k = 0; k < row; ++k) {
    const double norm = result.c.row(k).norm();
    result.c.row(k) /= norm;
    result.r[k] /= norm;
  }
  return result;
}

}  // namespace

CoefficientSubspace CoefficientSubspace::with_free_front(Index count) const {
  CoefficientSubspace result{VectorXd::Zero(count + offset.size()),
                             MatrixXd::Zero(count + offset.size(), count + directions.cols())};
  result.offset.tail(offset.size()) = offset;
  result.directions.topLeftCorner(count, count).setIdentity();
  result.directions.bottomRightCorner(directions.rows(), directions.cols()) = directions;
  return result;
}

CoefficientSubspace subspace_without(const RationalBasis& basis, const std::vector<Index>& numerator,
                                     const std::vector<Index>& denominator) {
  check_powers(numerator, basis.numerator_degree + 1, 'b');
  check_powers(denominator, basis.order, 'a');
  const Index size = basis.numerator_degree + 1 + basis.order;
  if (std::ssize(numerator) == basis.numerator_degree + 1) {
    fail("continuous fit: expected at least one coefficient of the numerator to remain");
  }
  if (numerator.empty() && denominator.empty()) return {VectorXd::Zero(size), MatrixXd::Identity(size, size)};
  const auto [c, r] = constraints_of(basis, numerator, denominator);
  // C' = Q R P': the offset is the shortest solution, the directions are what Q has besides.
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(c.transpose());
  const MatrixXd q = qr.householderQ();
  const Index count = c.rows();
  const VectorXd right = qr.colsPermutation().transpose() * r;
  const MatrixXd triangle = qr.matrixQR().topRows(count);
  const VectorXd inner = triangle.triangularView<Eigen::Upper>().transpose().solve(right);
  return {q.leftCols(count) * inner, q.rightCols(size - count)};
}

}  // namespace blockid::detail
