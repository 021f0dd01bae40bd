// Sums and products of the Hankel matrices K(h) = J T_h in which the convex programme is written.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// (n, n) symmetric K(h)_ij = h_{n-1-i-j} for i + j < n, 0 elsewhere: T_h with its rows in reverse order.
Eigen::MatrixXd hankel(const Eigen::VectorXd& h);

/// (n,) g_k = sum over i + j = n-1-k of M_ij = tr(E_k M) with E_k = dK / dh_k.
Eigen::VectorXd hankel_adjoint(const Eigen::MatrixXd& m);

/// (n, n) S_kl = tr(E_k X1 E_l W1) + tr(E_k X2 E_l W2), all symmetric (n, n).
///
/// tr(E_k X E_l W) is the linear convolution of X and W in two dimensions at (n-1-k, n-1-l); both terms come from the
/// real part of one convolution of X1 + i X2 with W1 - i W2 by FFT: O(n^2 log n).
Eigen::MatrixXd hankel_schur_complement(const Eigen::MatrixXd& x1, const Eigen::MatrixXd& w1, const Eigen::MatrixXd& x2,
                                        const Eigen::MatrixXd& w2);

}  // namespace blockid
