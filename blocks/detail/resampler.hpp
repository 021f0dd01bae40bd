// Band-limited resampling by a whole factor: the filters around an oversampled block.
#pragma once

#include <blockid/blocks/block.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace blockid::detail {

/// h(t) = sinc(t) kaiser(t / H) sampled at t = j / M, |j| < H M: an M-th band low-pass, so that samples pass unchanged
/// and the values between them are interpolated.
///
///   up:   v_{n,m} = sum_k h((m + 1)/M + k - H) u_{n-k}, m = 0 .. M-1, at the times n - H + (m + 1)/M
///   down: y_n = 1/M sum_j h(j/M) w at the times n - 2 H + 1 - j/M
///
/// Each of the M phases of h adds up to 1: a constant passes unchanged. Stop band -80 dB; pass band up to 1 - 2.5/H of
/// the Nyquist frequency, stop band from 1 + 2.5/H on. Both need `past()` samples of their input's past, M numbers each
/// on the way down. Rows are rows of tangent tiles: all columns are resampled alike. Source: Kaiser and Schafer, IEEE
/// Trans. ASSP 28 (1980) 105-107, for the window.
class Resampler {
 public:
  Resampler(Index factor, Index half_length);

  Index factor() const { return factor_; }
  Index half_length() const { return half_length_; }
  /// 2 H - 1.
  Index past() const { return 2 * half_length_ - 1; }

  /// h(j / M), zero for |j| >= H M.
  double tap(Index j) const;
  /// sum_j h(j / M) e^{-i w j}, w in radians a sample of the higher rate; real, for h is even.
  double response(double omega) const;

  /// window: (past + n,) -> fine: (n M,).
  template <class T>
  void up(std::span<const T> window, std::span<T> fine) const;
  /// window: ((past + n) M,) -> y: (n,).
  template <class T>
  void down(std::span<const T> window, std::span<T> y) const;

  /// The same on the first `columns` columns of rows; more, up to the next multiple of kColumnPadding, are written.
  void up_rows(const double* window, Index stride, Index rows, double* fine, Index fine_stride, Index columns) const;
  void down_rows(const double* window, Index stride, Index rows, double* target, Index target_stride,
                 Index columns) const;

 private:
  /// Weights of u_{n-k} in v_{n,m}, and of w_{n-k,m} in y_n.
  double up_tap(Index m, Index k) const { return tap(m + 1 + (k - half_length_) * factor_); }
  double down_tap(Index m, Index k) const {
    return tap(m + 1 + (half_length_ - 1 - k) * factor_) / static_cast<double>(factor_);
  }

  Index factor_;
  Index half_length_;
  /// h(j / M), j = 0 .. H M.
  std::vector<double> taps_;
  /// Weights as the kernel mix_rows() takes them: for phases of up in groups, for several and for single rows of down.
  std::vector<double> up_weights_;
  std::vector<double> down_weights_;
  std::vector<double> down_single_;
};

template <class T>
void Resampler::up(std::span<const T> window, std::span<T> fine) const {
  const Index rows = static_cast<Index>(fine.size()) / factor_;
  std::vector<T> sum(static_cast<std::size_t>(rows));
  for (Index m = 0; m < factor_; ++m) {
    std::fill(sum.begin(), sum.end(), T(0.0));
    for (Index k = 0; k <= past(); ++k) {
      const double weight = up_tap(m, k);
      if (weight == 0.0) continue;
      const T* input = window.data() + past() - k;
      for (Index n = 0; n < rows; ++n) sum[static_cast<std::size_t>(n)] += weight * input[n];
    }
    for (Index n = 0; n < rows; ++n) fine[static_cast<std::size_t>(n * factor_ + m)] = sum[static_cast<std::size_t>(n)];
  }
}

template <class T>
void Resampler::down(std::span<const T> window, std::span<T> y) const {
  const Index rows = static_cast<Index>(y.size());
  std::vector<T> phase(static_cast<std::size_t>(past() + rows));
  std::fill(y.begin(), y.end(), T(0.0));
  for (Index m = 0; m < factor_; ++m) {
    for (std::size_t n = 0; n < phase.size(); ++n) {
      phase[n] = window[n * static_cast<std::size_t>(factor_) + static_cast<std::size_t>(m)];
    }
    for (Index k = 0; k <= past(); ++k) {
      const double weight = down_tap(m, k);
      if (weight == 0.0) continue;
      const T* input = phase.data() + past() - k;
      for (Index n = 0; n < rows; ++n) y[static_cast<std::size_t>(n)] += weight * input[n];
    }
  }
}

}  // namespace blockid::detail
