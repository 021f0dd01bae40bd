#include <blockid/validation/plane_transform.hpp>

#include <algorithm>
#include <unsupported/Eigen/FFT>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

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

}  // namespace

Index transform_size(Index least) {
  // Eigen's transform has no plan for one point.
  for (Index size = std::max<Index>(least, 2);; ++size) {
    Index rest = size;
    for (const Index factor : {2, 3, 5}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return size;
  }
}

MatrixXcd plane_spectrum(const MatrixXcd& m, Index size) {
  Eigen::FFT<double> fft;
  return transformed_columns(fft, transformed_columns(fft, m.transpose(), size).transpose(), size);
}

MatrixXcd plane_from_spectrum(const MatrixXcd& spectrum, Index rows, Index columns) {
  Eigen::FFT<double> fft;
  return restored_columns(fft, restored_columns(fft, spectrum, rows).transpose(), columns).transpose();
}

}  // namespace blockid
