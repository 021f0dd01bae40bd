// Banks of fixed continuous-time filters: models that are linear in their parameters.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/held_filter.hpp>
#include <blockid/blocks/hold.hpp>

#include <Eigen/Core>
#include <complex>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y = theta_1 F_1 u + ... + theta_n F_n u with fixed continuous-time filters F_k.
///
/// dy/dtheta_k = F_k u: the own columns of push_forward() *are* the signals of the bank, tile by tile. So they serve as
/// the rows of a regression, and the sums of estimators/accumulators.hpp take them as they come.
///
/// | kind                                   | F_k                                                              |
/// |----------------------------------------|------------------------------------------------------------------|
/// | `flbf(break_points)`                   | s^{k-1} p_k / ((s + p_1) ... (s + p_k)), localising_basis.hpp     |
/// | `svf(order, pole)`                     | s^{k-1} p^{n-k+1} / (s + p)^n: derivatives of a low-passed signal |
/// | `laguerre(order, pole)`                | sqrt(2p)/(s + p) ((s - p)/(s + p))^{k-1}                         |
/// | `kautz(pairs, frequency, damping)`     | sqrt(2b) s/D V^{i-1}, sqrt(2bc)/D V^{i-1} for i = 1..pairs        |
///
/// D = s^2 + b s + c with b = 2 damping frequency, c = frequency^2, V = (s^2 - b s + c)/D. Poles, frequencies and break
/// points in rad/s. Laguerre and Kautz functions are orthonormal in the mean over frequency. x as in
/// ContinuousRational. Sources: Young 1964 (state-variable filter), Welsh and Goodwin 2003, Wahlberg 1991, 1994.
class ContinuousBank {
 public:
  /// Each throws Error unless sizes are at least 1 and frequencies, dampings and the sample time positive.
  static ContinuousBank flbf(std::vector<double> break_points, Sampling sampling);
  static ContinuousBank svf(Index order, double pole, Sampling sampling);
  static ContinuousBank laguerre(Index order, double pole, Sampling sampling);
  static ContinuousBank kautz(Index pairs, double frequency, double damping, Sampling sampling);

  const Sampling& sampling() const { return sampling_; }
  /// x' = A x + B u, F_k u = x_k.
  const Eigen::MatrixXd& state_matrix() const { return state_matrix_; }
  const Eigen::VectorXd& input_vector() const { return input_vector_; }
  /// F_1(s) .. F_n(s).
  Eigen::VectorXcd at(std::complex<double> s) const;

  std::string kind() const { return kind_; }
  Arguments arguments() const;
  Index parameter_count() const { return input_vector_.size(); }
  Index state_count() const { return parameter_count() + detail::held_taps(sampling_.hold) - 1; }
  Index latency() const { return hold_latency(sampling_.hold); }
  /// c1, c2, ...
  std::vector<std::string> parameter_names() const;
  /// The first filter alone.
  Eigen::VectorXd initial_parameters() const { return Eigen::VectorXd::Unit(parameter_count(), 0); }
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    filter(theta).filter(x, u, y);
  }

  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  /// Of the sampled filter, hold and latency included.
  std::complex<double> frequency_response(std::span<const double> theta, double omega) const;
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;
  /// The largest number.
  Index gain_parameter(std::span<const double> theta) const;

 private:
  ContinuousBank(std::string kind, Arguments own_arguments, Sampling sampling, Eigen::MatrixXd state_matrix,
                 Eigen::VectorXd input_vector);

  template <class T>
  detail::HeldFilter<T> filter(std::span<const T> theta) const {
    const detail::VectorOf<T> output = Eigen::Map<const detail::VectorOf<T>>(theta.data(), parameter_count());
    return {{system_.transition.template cast<T>(), system_.heads.template cast<T>(), system_.entry.template cast<T>()},
            output,
            T(0.0),
            latency()};
  }

  detail::HeldTangents tangents_for(Index upstream) const;

  std::string kind_;
  Arguments own_arguments_;
  Sampling sampling_;
  Eigen::MatrixXd state_matrix_;
  Eigen::VectorXd input_vector_;
  detail::HeldSystem<double> system_;
};

}  // namespace blockid
