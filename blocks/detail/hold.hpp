// x' = A x + B u from sample to sample, exact for an input that is piecewise polynomial.
#pragma once

#include <blockid/blocks/detail/jet_push_forward.hpp>
#include <blockid/blocks/hold.hpp>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <type_traits>

namespace blockid::detail {

template <class T>
using MatrixOf = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
template <class T>
using VectorOf = Eigen::Matrix<T, Eigen::Dynamic, 1>;

/// A hold in numbers. With c = prefilter * u (or c = u) and h the sample time,
///   d^m u / ds^m (t + s h) at s = 0+  =  sum_{j=0..taps-1} weights(m, j) c_{t+1+reach-j},   m = 0..degree.
struct HoldPieces {
  /// (degree + 1, taps)
  Eigen::MatrixXd weights;
  /// c_{t+1+reach} is the newest coefficient that the piece from t to t + 1 depends on.
  Index reach = 0;
  /// (2K + 1,) symmetric: c_t = sum_k prefilter_{K+k} u_{t+k}, truncated where it falls below 1e-10.
  Eigen::VectorXd prefilter;

  Index degree() const { return weights.rows() - 1; }
  Index taps() const { return weights.cols(); }
  Index half_prefilter() const { return prefilter.size() / 2; }
};

/// Computed once.
const HoldPieces& hold_pieces(Hold hold);

/// Coefficients c_{-reach} .. c_{N-1+reach} of the spline through all N samples, its first and last pieces being one
/// polynomial ("not a knot"): (N + 2 reach,). The samples themselves for the other holds.
/// Throws Error when there are fewer than 2 degree + 2 samples.
Eigen::VectorXd interpolation_coefficients(const Eigen::VectorXd& samples, Hold hold);

/// exp(M) by Eigen's scaling, Pade approximation and squaring. NaN for an M that is not finite.
Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& m);

/// exp(M) for any scalar: Taylor series of M / 2^k with a norm below 1/2, squared k times.
template <class T>
MatrixOf<T> exponential_by_series(const MatrixOf<T>& m) {
  T norm(0.0);
  for (Index i = 0; i < m.rows(); ++i) {
    T sum(0.0);
    for (Index j = 0; j < m.cols(); ++j) sum += m(i, j) < T(0.0) ? T(-m(i, j)) : m(i, j);
    if (sum > norm) norm = sum;
  }
  int squarings = 0;
  T factor(1.0);
  for (; norm * factor > T(0.5) && squarings < 1100; ++squarings) factor *= T(0.5);
  constexpr int kTerms = 24;  // 0.5^25 / 25! < 1e-32
  const MatrixOf<T> scaled = m * factor;
  MatrixOf<T> sum = MatrixOf<T>::Identity(m.rows(), m.cols());
  for (int k = kTerms; k >= 1; --k) {
    sum = (scaled * sum / T(static_cast<double>(k))).eval();
    sum.diagonal().array() += T(1.0);
  }
  for (int k = 0; k < squarings; ++k) sum = (sum * sum).eval();
  return sum;
}

template <class T>
MatrixOf<T> exponential(const MatrixOf<T>& m) {
  if constexpr (std::is_same_v<T, double>) {
    return matrix_exponential(m);
  } else {
    return exponential_by_series(m);
  }
}

/// x_{t+1} = transition x_t + sum_j gains_j c_{t+1+reach-j}.
template <class T>
struct SampledSystem {
  /// (n, n)
  MatrixOf<T> transition;
  /// (n, taps)
  MatrixOf<T> gains;
};

/// The step of x' = A x + B u over one sample: one exponential of A h bordered by the derivatives of u.
template <class T>
SampledSystem<T> sampled_system(const MatrixOf<T>& a, const VectorOf<T>& b, const Sampling& sampling) {
  const HoldPieces& pieces = hold_pieces(sampling.hold);
  const Index n = a.rows();
  const Index m = pieces.degree() + 1;
  MatrixOf<T> bordered = MatrixOf<T>::Constant(n + m, n + m, T(0.0));
  bordered.topLeftCorner(n, n) = a * T(sampling.sample_time_s);
  bordered.col(n).head(n) = b * T(sampling.sample_time_s);
  for (Index k = 0; k + 1 < m; ++k) bordered(n + k, n + k + 1) = T(1.0);
  const MatrixOf<T> step = exponential(bordered);
  const MatrixOf<T> weights = pieces.weights.template cast<T>();
  return {step.topLeftCorner(n, n), step.topRightCorner(n, m) * weights};
}
extern template SampledSystem<double> sampled_system(const MatrixOf<double>&, const VectorOf<double>&, const Sampling&);

/// The same as a causal filter of u, lagging by hold_latency():
///   x_t = sum_{j=0..M-1} heads_j u_{t-j} + xi_t,   xi_{t+1} = transition xi_t + entry u_{t-M+1}.
template <class T>
struct HeldSystem {
  /// (n, n)
  MatrixOf<T> transition;
  /// (n, M), M = held_taps(hold)
  MatrixOf<T> heads;
  /// (n,)
  VectorOf<T> entry;
};

/// M: 1 for zero- and first-order hold.
Index held_taps(Hold hold);

template <class T>
HeldSystem<T> held_system(const MatrixOf<T>& a, const VectorOf<T>& b, const Sampling& sampling) {
  const HoldPieces& pieces = hold_pieces(sampling.hold);
  const SampledSystem<T> sampled = sampled_system(a, b, sampling);
  const Index n = a.rows();
  const Index length = held_taps(sampling.hold) + 1;
  MatrixOf<T> taps = MatrixOf<T>::Constant(n, length, T(0.0));
  for (Index j = 0; j < pieces.taps(); ++j) {
    for (Index k = 0; k < pieces.prefilter.size(); ++k) {
      taps.col(j + k) += sampled.gains.col(j) * T(pieces.prefilter[k]);
    }
  }
  HeldSystem<T> system{sampled.transition, MatrixOf<T>(n, length - 1), {}};
  VectorOf<T> x = taps.col(0);
  for (Index j = 0; j + 1 < length; ++j) {
    system.heads.col(j) = x;
    x = (sampled.transition * x + taps.col(j + 1)).eval();
  }
  system.entry = x;
  return system;
}
extern template HeldSystem<double> held_system(const MatrixOf<double>&, const VectorOf<double>&, const Sampling&);
extern template HeldSystem<TileJet> held_system(const MatrixOf<TileJet>&, const VectorOf<TileJet>&, const Sampling&);

}  // namespace blockid::detail
