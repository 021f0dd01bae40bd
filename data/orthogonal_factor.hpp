/// Products with the orthogonal factor of a QR factorisation, compiled once.
#pragma once

#include <Eigen/Householder>

namespace blockid {

/// The factor Q of HouseholderQR and ColPivHouseholderQR of real matrices, as their householderQ() returns it.
using OrthogonalFactor = Eigen::HouseholderSequence<Eigen::MatrixXd, Eigen::VectorXd>;

/// Q X.
/// @param q (n, n)
/// @param x (n, k)
Eigen::MatrixXd q_times(const OrthogonalFactor& q, Eigen::MatrixXd x);

/// Q' X.
/// @param q (n, n)
/// @param x (n, k)
Eigen::MatrixXd q_transpose_times(const OrthogonalFactor& q, Eigen::MatrixXd x);

}  // namespace blockid
