#include <blockid/validation/hankel_products.hpp>

#include <blockid/validation/plane_transform.hpp>

#include <Eigen/Core>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXcd pair(const MatrixXd& real, const MatrixXd& imaginary) {
  MatrixXcd m(real.rows(), real.cols());
  m.real() = real;
  m.imag() = imaginary;
  return m;
}

}  // namespace

MatrixXd hankel(const VectorXd& h) {
  const Index n = h.size();
  MatrixXd k = MatrixXd::Zero(n, n);
  for (Index j = 0; j < n; ++j) k.col(j).head(n - j) = h.head(n - j).reverse();
  return k;
}

VectorXd hankel_adjoint(const MatrixXd& m) {
  const Index n = m.rows();
  VectorXd g = VectorXd::Zero(n);
  for (Index j = 0; j < n; ++j) g.head(n - j) += m.col(j).head(n - j).reverse();
  return g;
}

MatrixXd hankel_schur_complement(const MatrixXd& x1, const MatrixXd& w1, const MatrixXd& x2, const MatrixXd& w2) {
  const Index n = x1.rows();
  const Index size = transform_size(2 * n - 1);
  const MatrixXcd product = plane_spectrum(pair(x1, x2), size).cwiseProduct(plane_spectrum(pair(w1, -w2), size));
  return plane_from_spectrum(product, n, n).real().reverse();
}

}  // namespace blockid
