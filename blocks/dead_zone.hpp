// A signal of which a middle interval is cut out.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = u_t - upper if u_t > upper, u_t - lower if u_t < lower, 0 otherwise.
///
/// theta = [lower, upper], (2,). No state. Where lower > upper both conditions may hold: the first counts.
/// Derivatives at a kink are those of the dead zone: dy/du = 0 where u equals a limit.
/// Acts on the samples; oversampled() lets it act between them.
class DeadZone {
 public:
  std::string kind() const { return "dead_zone"; }
  Index parameter_count() const { return 2; }
  std::vector<std::string> parameter_names() const { return {"lower", "upper"}; }
  /// [-1, 1].
  Eigen::VectorXd initial_parameters() const { return Eigen::Vector2d(-1.0, 1.0); }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) {
      if (u[t] > theta[1]) {
        y[t] = u[t] - theta[1];
      } else if (u[t] < theta[0]) {
        y[t] = u[t] - theta[0];
      } else {
        y[t] = 0.0 * u[t];  // not a plain zero: what is not a number must stay one that the caller notices
      }
    }
  }

  /// Limits times k, exchanged for k < 0; none where lower > upper and k < 0.
  std::optional<Rescaled> with_scaled_signals(std::span<const double> theta, double k) const;

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;
};

}  // namespace blockid
