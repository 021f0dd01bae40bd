// Blocks as a user writes them: nothing but the sizes and apply<T>.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <cmath>
#include <cstddef>
#include <span>

namespace blockid::testing {

// y_t = theta_0 tanh(theta_1 u_t).
struct CustomTanh {
  Index parameter_count() const { return 2; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * tanh(theta[1] * u[t]);
  }
};

// x_{t+1} = a x_t + tanh(b u_t), y_t = x_t + c sin(z_t), z_{t+1} = x_t; theta = [a, b, c].
struct CustomLag {
  Index parameter_count() const { return 3; }
  Index state_count() const { return 2; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    using std::sin;
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) {
      y[t] = x[0] + theta[2] * sin(x[1]);
      const T next = theta[0] * x[0] + tanh(theta[1] * u[t]);
      x[1] = x[0];
      x[0] = next;
    }
  }
};

// y_t = u_t |u_t|: no numbers at all.
struct CustomSquare {
  Index parameter_count() const { return 0; }

  template <class T>
  void apply(std::span<const T>, std::span<T>, std::span<const T> u, std::span<T> y) const {
    using std::abs;
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = u[t] * abs(u[t]);
  }
};

// More parameters than one Jet carries: y_t = sum_k theta_k cos(k u_t), k = 0..10.
struct CustomCosines {
  Index parameter_count() const { return 11; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    using std::cos;
    for (std::size_t t = 0; t < u.size(); ++t) {
      y[t] = T(0.0);
      for (std::size_t k = 0; k < theta.size(); ++k) y[t] += theta[k] * cos(static_cast<double>(k) * u[t]);
    }
  }
};

}  // namespace blockid::testing
