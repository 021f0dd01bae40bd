// A signal clipped to a lower and an upper limit.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = min(max(u_t, lower), upper).
///
/// theta = [lower, upper], (2,). No state. With lower > upper the output is upper throughout.
/// Derivatives at a kink are those of the linear part between the limits: dy/du = 1 where u equals a limit.
/// Acts on the samples; oversampled() lets it act between them.
class Saturation {
 public:
  std::string kind() const { return "saturation"; }
  Index parameter_count() const { return 2; }
  std::vector<std::string> parameter_names() const { return {"lower", "upper"}; }
  /// [-1, 1].
  Eigen::VectorXd initial_parameters() const { return Eigen::Vector2d(-1.0, 1.0); }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) {
      const T& raised = u[t] < theta[0] ? theta[0] : u[t];
      y[t] = theta[1] < raised ? theta[1] : raised;
    }
  }

  /// Limits times k, exchanged for k < 0; none where lower > upper and k < 0.
  std::optional<Rescaled> with_scaled_signals(std::span<const double> theta, double k) const;

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;
};

}  // namespace blockid
