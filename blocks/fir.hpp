// Finite impulse response filter.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/rational.hpp>

#include <Eigen/Core>
#include <complex>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = sum_{k=0..nb} b_k u_{t-nk-k}, G(q) = q^-nk (b_0 + b_1 q^-1 + ... + b_nb q^-nb).
///
/// theta = [b_0 .. b_nb], (nb + 1,). nb is the polynomial's *degree*, nk the delay in samples.
/// x = what the past adds to the next outputs, (nb + nk,). Zero is rest.
/// The rational filter with na = 0.
class Fir {
 public:
  /// Throws Error unless nb and nk are >= 0.
  explicit Fir(Index nb, Index nk = 0);

  Index nb() const { return filter_.nb(); }
  Index nk() const { return filter_.nk(); }

  std::string kind() const { return "fir"; }
  Arguments arguments() const;
  Index parameter_count() const { return filter_.parameter_count(); }
  Index state_count() const { return filter_.state_count(); }
  std::vector<std::string> parameter_names() const { return filter_.parameter_names(); }
  /// b_0 = 1, all else 0: the delay alone.
  Eigen::VectorXd initial_parameters() const { return filter_.initial_parameters(); }
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    filter_.apply(theta, x, u, y);
  }

  Index tangent_memory(Index upstream, OwnColumns own) const { return filter_.tangent_memory(upstream, own); }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  std::complex<double> frequency_response(std::span<const double> theta, double omega) const {
    return filter_.frequency_response(theta, omega);
  }
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;
  /// The largest coefficient.
  Index gain_parameter(std::span<const double> theta) const { return filter_.gain_parameter(theta); }

 private:
  Rational filter_;
};

}  // namespace blockid
