// Fourier transforms in two dimensions.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// The smallest number of the form 2^a 3^b 5^c that is at least `least`, and at least 2.
Eigen::Index transform_size(Eigen::Index least);

/// (size, size) F_uv = sum_jk m_jk exp(-2 pi i (u j + v k) / size), m with zeros beyond its entries; size >= 2 and not
/// below the sizes of m.
Eigen::MatrixXcd plane_spectrum(const Eigen::MatrixXcd& m, Eigen::Index size);

/// The first (rows, columns) entries of the m with that spectrum.
Eigen::MatrixXcd plane_from_spectrum(const Eigen::MatrixXcd& spectrum, Eigen::Index rows, Eigen::Index columns);

}  // namespace blockid
