// A block that lags on purpose.
#pragma once

#include <blockid/blocks/block.hpp>

#include <cstddef>
#include <span>

namespace blockid::testing {

// y_t = k u_{t-3}, with latency 3: whoever simulates takes the three samples back. theta = [k].
struct Lag {
  Index parameter_count() const { return 1; }
  Index state_count() const { return 3; }
  Index latency() const { return 3; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) {
      y[t] = theta[0] * x[0];
      x[0] = x[1];
      x[1] = x[2];
      x[2] = u[t];
    }
  }
};

}  // namespace blockid::testing
