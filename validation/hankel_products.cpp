#include <blockid/validation/hankel_products.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <unsupported/Eigen/FFT>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// The smallest number of the form 2^a 3^b 5^c that is at least `least`.
Index fast_size(Index least) {
  for (Index size = least;; ++size) {
    Index rest = size;
    for (const Index factor : {2, 3, 5}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return size;
  }
}

/// (size, columns) from the columns of m, padded with zeros.
MatrixXcd transformed_columns(Eigen::FFT<double>& fft, const MatrixXcd& m, Index size) {
  MatrixXcd result(size, m.cols());
  VectorXcd padded = VectorXcd::Zero(size);
  VectorXcd spectrum(size);
  for (Index j = 0; j < m.cols(); ++j) {
    padded.head(m.rows()) = m.col(j);
    fft.fwd(spectrum, padded);
    result.col(j) = spectrum;
  }
  return result;
}

/// The first `rows` rows of the columns transformed back.
MatrixXcd restored_columns(Eigen::FFT<double>& fft, const MatrixXcd& m, Index rows) {
  MatrixXcd result(rows, m.cols());
  VectorXcd spectrum(m.rows());
  VectorXcd column(m.rows());
  for (Index j = 0; j < m.cols(); ++j) {
    spectrum = m.col(j);
    fft.inv(column, spectrum);
    result.col(j) = column.head(rows);
  }
  return result;
}

MatrixXcd transformed(Eigen::FFT<double>& fft, const MatrixXd& real, const MatrixXd& imaginary, Index size) {
  MatrixXcd m(real.rows(), real.cols());
  m.real() = real;
  m.imag() = imaginary;
  return transformed_columns(fft, transformed_columns(fft, m, size).transpose(), size);
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
  const Index size = fast_size(std::max<Index>(2 * n - 1, 2));  // Eigen's transform has no plan for one point
  Eigen::FFT<double> fft;
  const MatrixXcd product = transformed(fft, x1, x2, size).cwiseProduct(transformed(fft, w1, -w2, size));
  const MatrixXcd half = restored_columns(fft, product, n).transpose();
  return restored_columns(fft, half, n).real().reverse();
}

}  // namespace blockid
