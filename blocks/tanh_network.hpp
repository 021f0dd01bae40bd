// Static network with one hidden layer of tanh units.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/signal_range.hpp>

#include <Eigen/Core>
#include <cmath>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = d + e x_t + sum_{i=1..units} w_i tanh(s_i x_t + t_i), x_t = (2 u_t - lower - upper) / (upper - lower).
///
/// theta = [d, e, w_1, s_1, t_1, w_2, s_2, t_2, ...], (2 + 3 units,). No state. On the range x lies within [-1, 1], so
/// that slopes and shifts are of order one whatever the unit of u. Beyond the range the function goes on as such.
/// Acts on the samples; oversampled() lets it act between them.
class TanhNetwork {
 public:
  /// Range [-1, 1] until adapted_to() places it. Throws Error unless units >= 1.
  explicit TanhNetwork(Index units);
  /// Throws Error unless range.lower < range.upper.
  TanhNetwork(Index units, SignalRange range);

  Index units() const { return units_; }
  SignalRange range() const { return range_; }

  std::string kind() const { return "tanh_network"; }
  Arguments arguments() const;
  Index parameter_count() const { return 2 + 3 * units_; }
  std::vector<std::string> parameter_names() const;
  /// y = u up to a hundredth of the range: units centred at equal distances, each with a small weight.
  Eigen::VectorXd initial_parameters() const;

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) {
      const T x = u[t] * scale_ + shift_;
      T sum = theta[0] + theta[1] * x;
      for (std::size_t k = 2; k < theta.size(); k += 3) sum += theta[k] * tanh(theta[k + 1] * x + theta[k + 2]);
      y[t] = sum;
    }
  }

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  /// Range of v, unless a range was given.
  TanhNetwork adapted_to(std::span<const double> v) const;
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;

 private:
  Index units_;
  SignalRange range_;
  bool range_given_;
  double scale_;
  double shift_;
};

}  // namespace blockid
