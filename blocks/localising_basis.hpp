// Frequency-localising basis functions: rational functions of s over decades, well conditioned.
#pragma once

#include <blockid/blocks/block.hpp>

#include <Eigen/Core>
#include <complex>
#include <functional>
#include <vector>

namespace blockid {

/// F_k(s) = s^{k-1} p_k / ((s + p_1) ... (s + p_k)),   k = 1..n, p_1 <= ... <= p_n > 0 in rad/s:
/// band-passes between p_{k-1} and p_k, F_1 a low-pass of gain 1. States of x_k' = p_k (v - x_1 - ... - x_k) are F_k v.
/// Their span is that of s^j / ((s + p_1) ... (s + p_n)), j < n.
/// Source: Welsh and Goodwin 2003, (28) with its misprint corrected.
class LocalisingBasis {
 public:
  /// Sorted on the way in. Throws Error unless there is at least one and all are positive and finite.
  explicit LocalisingBasis(std::vector<double> break_points);

  Index size() const { return static_cast<Index>(break_points_.size()); }
  /// rad/s, ascending.
  const std::vector<double>& break_points() const { return break_points_; }

  /// -P (L + 1 a'), (n, n), L lower triangular of ones: x' = matrix(a) x + input() v has
  ///   x_k = F_k / (1 + a_1 F_1 + ... + a_n F_n) v.
  template <class T>
  Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic> matrix(const Eigen::Matrix<T, Eigen::Dynamic, 1>& a) const {
    Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic> result(size(), size());
    for (Index k = 0; k < size(); ++k) {
      const double p = break_points_[static_cast<std::size_t>(k)];
      for (Index j = 0; j < size(); ++j) result(k, j) = (j <= k ? a[j] + 1.0 : a[j]) * (-p);
    }
    return result;
  }
  /// P 1, (n,)
  Eigen::VectorXd input() const;

  /// F_1(s) .. F_n(s).
  Eigen::VectorXcd at(std::complex<double> s) const;

  /// c of f = c_1 F_1 + ... + c_n F_n for a strictly proper f with poles at the -p_k, given by its values.
  Eigen::VectorXd coordinates(const std::function<std::complex<long double>(std::complex<long double>)>& f) const;

  /// a of 1 + a_1 F_1 + ... + a_n F_n = prod (s - pole_k) / prod (s + p_k). Throws Error unless there are n poles,
  /// closed under conjugation.
  Eigen::VectorXd denominator_from_poles(const std::vector<std::complex<double>>& poles) const;

  /// Roots of 1 + a_1 F_1 + ... + a_n F_n: eigenvalues of matrix(a), taken with the states in the order of descending
  /// p, then polished by Newton's iteration: slow ones keep their digits over many decades.
  Eigen::VectorXcd poles(const Eigen::VectorXd& a) const;

  /// (n, m) T: the columns are coordinates of s^j / prod (s + p_k) spans of degree below m:
  ///   N_k = F_k p_{m+1} ... p_n / ((s + p_{m+1}) ... (s + p_n)), k = 1..m, of the first m break points. m = n:
  ///   identity.
  Eigen::MatrixXd low_degree(Index m) const;

 private:
  std::vector<double> break_points_;
};

/// count break points from lower to upper rad/s, spaced like the logarithm. Throws Error unless 0 < lower <= upper and
/// count >= 1; one break point lies at the geometric mean.
std::vector<double> logarithmic_break_points(double lower, double upper, Index count);

}  // namespace blockid
