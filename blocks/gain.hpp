// A gain.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>

#include <Eigen/Core>
#include <complex>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = k u_t.
///
/// theta = [k], (1,). No state.
class Gain {
 public:
  std::string kind() const { return "gain"; }
  Index parameter_count() const { return 1; }
  std::vector<std::string> parameter_names() const { return {"k"}; }
  /// y = u.
  Eigen::VectorXd initial_parameters() const { return Eigen::VectorXd::Ones(1); }
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t];
  }

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  std::complex<double> frequency_response(std::span<const double> theta, double) const { return theta[0]; }
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;
  Index gain_parameter(std::span<const double>) const { return 0; }
};

}  // namespace blockid
