#include <blockid/validation/correlation.hpp>

#include <blockid/validation/plane_transform.hpp>

namespace blockid {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

Correlation::Correlation(Index n) : n_(n), size_(transform_size(2 * n - 1)) {}

Correlation::Spectrum Correlation::spectrum(const MatrixXd& m) const { return {plane_spectrum(m, size_)}; }

MatrixXd Correlation::all_sums(const Spectrum& p, const Spectrum& q, const Spectrum& r, const Spectrum& s) const {
  const MatrixXcd product = p.values.conjugate().cwiseProduct(q.values) + r.values.conjugate().cwiseProduct(s.values);
  return plane_from_spectrum(product, n_, size_).real();
}

MatrixXd Correlation::sums(const Spectrum& p, const Spectrum& q, const Spectrum& r, const Spectrum& s) const {
  return all_sums(p, q, r, s).leftCols(n_);
}

MatrixXd Correlation::crossed_sums(const Spectrum& p, const Spectrum& q, const Spectrum& r, const Spectrum& s) const {
  const MatrixXd all = all_sums(p, q, r, s);
  MatrixXd crossed(n_, n_);
  crossed.col(0) = all.col(0);
  for (Index l = 1; l < n_; ++l) crossed.col(l) = all.col(size_ - l);
  return crossed;
}

}  // namespace blockid
