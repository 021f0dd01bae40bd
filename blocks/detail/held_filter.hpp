// Running a continuous-time filter over samples, with its tangents: what the blocks of this kind share.
#pragma once

#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/hold.hpp>
#include <blockid/blocks/detail/kernels.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <span>
#include <type_traits>
#include <vector>

namespace blockid::detail {

/// y_t = direct u_{t-lag} + output' x_t with x_t = sum_{j<M} heads_j u_{t-j} + xi_t. The block's state is xi (n,), then
/// the M - 1 last inputs, newest first.
template <class T>
class HeldFilter {
 public:
  HeldFilter(HeldSystem<T> system, VectorOf<T> output, T direct, Index lag)
      : system_(std::move(system)), output_(std::move(output)), direct_(direct), lag_(lag) {
    const VectorOf<T> heads = system_.heads.transpose() * output_;
    response_.assign(heads.begin(), heads.end());
    response_[static_cast<std::size_t>(lag)] += direct;
  }

  Index order() const { return system_.transition.rows(); }
  /// M
  Index taps() const { return system_.heads.cols(); }
  Index lag() const { return lag_; }
  const T& direct() const { return direct_; }
  const HeldSystem<T>& system() const { return system_; }
  const VectorOf<T>& output() const { return output_; }
  /// (M,) the first outputs for a unit impulse from rest.
  const std::vector<T>& response() const { return response_; }

  void filter(std::span<T> x, std::span<const T> u, std::span<T> y) const {
    for (std::size_t start = 0; start < u.size(); start += static_cast<std::size_t>(kMaxTileRows)) {
      const std::size_t rows = std::min(static_cast<std::size_t>(kMaxTileRows), u.size() - start);
      filter_tile(x, u.subspan(start, rows), y.subspan(start, rows));
    }
  }

 private:
  void filter_tile(std::span<T> x, std::span<const T> u, std::span<T> y) const {
    const auto n = static_cast<std::size_t>(order());
    const std::span<T> past = x.subspan(n);
    std::vector<T> all(past.rbegin(), past.rend());
    all.insert(all.end(), u.begin(), u.end());
    const T* input = all.data() + past.size();
    if constexpr (std::is_same_v<T, double>) {
      kernels().convolve_signal(response_.data(), taps() - 1, input, y.data(), std::ssize(u));
    } else {
      for (std::size_t t = 0; t < y.size(); ++t) {
        y[t] = T(0.0);
        for (std::size_t j = 0; j < response_.size(); ++j) {
          y[t] += response_[j] * input[static_cast<std::ptrdiff_t>(t) - static_cast<std::ptrdiff_t>(j)];
        }
      }
    }
    std::vector<T> next(n);
    for (std::size_t t = 0; t < u.size(); ++t) {
      const T& entering = all[t];
      for (std::size_t i = 0; i < n; ++i) next[i] = system_.entry[static_cast<Index>(i)] * entering;
      for (std::size_t k = 0; k < n; ++k) {
        const T state = x[k];
        y[t] += output_[static_cast<Index>(k)] * state;
        const T* column = system_.transition.data() + k * n;
        for (std::size_t i = 0; i < n; ++i) next[i] += column[i] * state;
      }
      std::copy(next.begin(), next.end(), x.begin());
    }
    std::copy_n(all.rbegin(), past.size(), past.begin());
  }

  HeldSystem<T> system_;
  VectorOf<T> output_;
  T direct_;
  Index lag_;
  std::vector<T> response_;
};

/// G(e^{jw}) with w in radians a sample.
std::complex<double> frequency_response(const HeldFilter<double>& filter, double omega);

/// What the tangents are made of, at one theta:
///   dy/dtheta_i = direct_i u_{t-lag} + own_i' s_t + free_i' f_t.
/// s: the states of `signals`, driven by the input from rest; the first n of them are those of the filter itself.
/// f_{t+1} = free_transition f_t: what xi at the start of the record adds.
struct HeldTangentSources {
  HeldSystem<double> signals;
  /// (n_theta, states of signals)
  Eigen::MatrixXd own;
  /// (n_theta,)
  Eigen::VectorXd direct;
  /// (m, m), (m,), (n_theta, m)
  Eigen::MatrixXd free_transition;
  Eigen::VectorXd free_start;
  Eigen::MatrixXd free_own;
};

/// push_forward of a held filter. Sizes are known without theta; numbers come at the first tile and stay in `memory`.
class HeldTangents {
 public:
  struct Shape {
    Index order = 0;
    Index taps = 1;
    Index lag = 0;
    Index parameters = 0;
    /// States of `signals` and of the autonomous part.
    Index signals = 0;
    Index free = 0;
  };

  HeldTangents(const Shape& shape, Index upstream);

  Index memory() const { return size_; }
  /// True before the first tile of a record.
  static bool is_new(std::span<const double> memory) { return memory[0] == 0.0; }
  /// Fills `memory` before the first tile.
  void start(std::span<double> memory, const HeldFilter<double>& filter, const HeldTangentSources& sources) const;
  /// One tile; arguments as AnyBlock::push_forward.
  void push(std::span<double> x, std::span<double> memory, std::span<const double> u, std::span<double> y,
            const Tangents& tangents, OwnColumns own) const;

 private:
  struct Parts;
  Parts parts(std::span<double> memory) const;
  void push_upstream(Parts& parts, const Tangents& tangents) const;
  void push_own(Parts& parts, std::span<const double> all, std::span<double> x, std::span<double> y,
                const Tangents& tangents) const;
  void push_states(Parts& parts, const Tangents& tangents) const;

  Shape shape_;
  Index upstream_;
  Index stride_;
  Index size_ = 0;
};

}  // namespace blockid::detail
