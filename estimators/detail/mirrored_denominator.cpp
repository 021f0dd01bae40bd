#include <blockid/estimators/detail/mirrored_denominator.hpp>

#include <blockid/estimators/continuous_model.hpp>
#include <blockid/estimators/frequency_fit.hpp>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>

namespace blockid::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Where a pole on the imaginary axis is put, relative to its modulus.
constexpr double kLeastDamping = 1e-6;

}  // namespace

VectorXd mirrored_denominator(const RationalBasis& basis, const VectorXd& a) {
  const VectorXcd roots = poles({basis, a, VectorXd::Zero(basis.numerator_degree + 1)});
  if ((roots.real().array() < 0.0).all()) return a;
  const VectorXd moduli = roots.cwiseAbs();
  const double highest = std::max(moduli.maxCoeff(), basis.points[0]);
  const double lowest = std::max(moduli.minCoeff(), 1e-12 * highest);
  const VectorXd omega = break_points(lowest / 3.0, 3.0 * highest, 6 * basis.order);
  const BasisValues values = evaluate(basis, omega);
  VectorXcd denominator = values.lead + values.phi * a;
  for (const Complex& root : roots) {
    if (root.real() < 0.0) continue;
    const Complex mirrored(std::min(-root.real(), -kLeastDamping * std::abs(root)), root.imag());
    for (Index k = 0; k < omega.size(); ++k) {
      const Complex s(0.0, omega[k]);
      denominator[k] *= (s - mirrored) / (s - root);
    }
  }
  // Rows of equal size, columns of equal size.
  const VectorXcd weights = denominator.cwiseAbs().cwiseInverse().cast<Complex>();
  const MatrixXd x = stacked(weights.asDiagonal() * values.phi);
  const VectorXd y = stacked(weights.cwiseProduct(denominator - values.lead));
  const VectorXd norms = x.colwise().norm();
  return (x * norms.cwiseInverse().asDiagonal()).colPivHouseholderQr().solve(y).cwiseQuotient(norms);
}

}  // namespace blockid::detail
