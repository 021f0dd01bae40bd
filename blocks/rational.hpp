// Discrete-time rational filter B(q)/A(q).
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/direct_form.hpp>

#include <Eigen/Core>
#include <complex>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = sum_{k=0..nb} b_k u_{t-nk-k} - sum_{k=1..na} a_k y_{t-k},
/// G(q) = q^-nk (b_0 + b_1 q^-1 + ... + b_nb q^-nb) / (1 + a_1 q^-1 + ... + a_na q^-na).
///
/// theta = [b_0 .. b_nb, a_1 .. a_na], (nb + 1 + na,). nb and na are polynomial *degrees*, nk the delay in samples.
/// x = what the past adds to the next outputs, (max(na, nb + nk),): transposed direct form II, the `zi` of the field's
/// filter routines. Zero is rest.
/// Source: Giordano and Sjoberg 2015, equation (5).
class Rational {
 public:
  /// Throws Error unless nb, na and nk are >= 0.
  Rational(Index nb, Index na, Index nk = 0);

  Index nb() const { return nb_; }
  Index na() const { return na_; }
  Index nk() const { return nk_; }

  std::string kind() const { return "rational"; }
  Arguments arguments() const;
  Index parameter_count() const { return nb_ + 1 + na_; }
  Index state_count() const { return order_; }
  std::vector<std::string> parameter_names() const;
  /// b_0 = 1, all else 0: the delay alone.
  Eigen::VectorXd initial_parameters() const;
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return na_ == 0; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    detail::DirectForm<T>(theta.subspan(0, static_cast<std::size_t>(nb_) + 1),
                          theta.subspan(static_cast<std::size_t>(nb_) + 1), nk_)
        .filter(x, u, y);
  }

  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;
  bool push_negated(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, double* target) const;

  std::complex<double> frequency_response(std::span<const double> theta, double omega) const;
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;
  /// The largest numerator coefficient.
  Index gain_parameter(std::span<const double> theta) const;

  /// (nb + nk + 1,) numerator in powers of q^-1, the delay included.
  Eigen::VectorXd numerator(std::span<const double> theta) const;
  /// (na + 1,) denominator in powers of q^-1, a_0 = 1.
  Eigen::VectorXd denominator(std::span<const double> theta) const;

 private:
  Index nb_;
  Index na_;
  Index nk_;
  Index order_;
};

}  // namespace blockid
