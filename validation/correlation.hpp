// Sums over shifted products of square matrices, by FFT.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// c(P, Q)_kl = sum_ij P_ij Q_{i+k,j+l} for (n, n) matrices, entries outside being zero, in O(n^2 log n).
class Correlation {
 public:
  explicit Correlation(Eigen::Index n);

  struct Spectrum {
    Eigen::MatrixXcd values;
  };
  Spectrum spectrum(const Eigen::MatrixXd& m) const;

  /// (n, n) c(P, Q) + c(R, S) at k, l = 0..n-1.
  Eigen::MatrixXd sums(const Spectrum& p, const Spectrum& q, const Spectrum& r, const Spectrum& s) const;
  /// (n, n) c(P, Q) + c(R, S) at k = 0..n-1 and l = 0, -1, ..., -(n-1).
  Eigen::MatrixXd crossed_sums(const Spectrum& p, const Spectrum& q, const Spectrum& r, const Spectrum& s) const;

 private:
  /// All shifts, size_ by size_, negative ones from the end.
  Eigen::MatrixXd all_sums(const Spectrum& p, const Spectrum& q, const Spectrum& r, const Spectrum& s) const;

  Eigen::Index n_;
  Eigen::Index size_;
};

}  // namespace blockid
