// Taylor coefficients of products of powers, by the power sums of their roots.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace blockid {

using Index = Eigen::Index;

/// A_0 .. A_n of A(x) = exp(sum_k s_k x^k / k): A_0 = 1, k A_k = sum_{j=1..k} s_j A_{k-j}.
///
/// s = s_1 .. s_n, (n,); result (n + 1,). For A = prod (1 - r_i x)^{-e_i} the power sums are s_k = sum_i e_i r_i^k,
/// linear in the exponents e. T is double or a ceres::Jet. O(n^2).
template <class T>
std::vector<T> taylor_coefficients(const std::vector<T>& s) {
  std::vector<T> a(s.size() + 1, T(0.0));
  a[0] = T(1.0);
  for (std::size_t k = 1; k < a.size(); ++k) {
    for (std::size_t j = 1; j <= k; ++j) a[k] += s[j - 1] * a[k - j];
    a[k] /= static_cast<double>(k);
  }
  return a;
}

/// As above: (n,) -> (n + 1,).
Eigen::VectorXd taylor_coefficients(const Eigen::VectorXd& power_sums);

/// The inverse, Newton's identities: s_k = k A_k - sum_{j<k} s_j A_{k-j} for A scaled to A_0 = 1. (n + 1,) -> (n,).
/// Throws Error when there is no coefficient or A_0 is 0.
Eigen::VectorXd power_sums(const Eigen::VectorXd& coefficients);

/// dA for ds: dA_k = sum_{j=1..k} A_{k-j} ds_j / j, since dA_k/ds_j = A_{k-j}/j. (n + 1,), (n,) -> (n + 1,).
Eigen::VectorXd taylor_tangent(const Eigen::VectorXd& coefficients, const Eigen::VectorXd& power_sum_tangent);

/// r, r^2, .. r^n of a real root; 2 Re r^k of the pair r, conj(r) when Im r is not zero. (n,).
Eigen::VectorXd root_powers(std::complex<double> root, Index n);

}  // namespace blockid
