// How large an uncertainty must be around given frequencies: lower bounds from narrow-band test signals.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// A lower bound of |Delta| averaged over a band.
struct BandBound {
  double omega = 0.0;         ///< rad per sample, as asked
  double gain = 0.0;          ///< sqrt of the weighted mean of |Delta|^2 is at least this
  double mean_omega = 0.0;    ///< mean of |omega| in [0, pi] under the weight
  double spread_omega = 0.0;  ///< its standard deviation: the leakage
};

/// gain = max over x in span{x_c, x_s} of |T_w x| / |T_v x|, less what the noise may add; x_c and x_s are cos(omega k)
/// and sin(omega k), k = 0..length-1, under Hann's window 1/2 (1 - cos(2 pi (k + 1) / (length + 1))).
///
/// (1 / 2 pi) int |Delta|^2 |F(T_v x)|^2 d omega >= |T_w x - T_delta x|^2 for every x, so that sqrt of the mean of
/// |Delta|^2 under the weight |F(T_v x)|^2 is at least gain: a statement about a band, not about omega alone. Where the
/// record does not excite omega, the weight lies elsewhere, which mean_omega and spread_omega show. What the weight V
/// must at least be is |V| gain. |T_delta x| is bounded by gamma times the norm of the partial sums of |x_k|.
///
/// v, w (N,) from rest and complete, 1 <= length <= N, omegas (count,) in [0, pi], gamma >= 0; throws Error otherwise,
/// and when v is zero.
std::vector<BandBound> band_bounds(const Eigen::VectorXd& v, const Eigen::VectorXd& w, const Eigen::VectorXd& omegas,
                                   Eigen::Index length, double gamma = 0.0);

}  // namespace blockid
