// A constant added to a signal.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = u_t + c.
///
/// theta = [c], (1,). No state. Affine in c, and not linear in u: superposition fails unless c = 0.
class Offset {
 public:
  std::string kind() const { return "offset"; }
  Index parameter_count() const { return 1; }
  std::vector<std::string> parameter_names() const { return {"c"}; }
  /// y = u.
  Eigen::VectorXd initial_parameters() const { return Eigen::VectorXd::Zero(1); }
  bool is_linear() const { return false; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = u[t] + theta[0];
  }

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;
};

}  // namespace blockid
