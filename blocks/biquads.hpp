// Cascade of second-order sections.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace blockid {

/// G(q) = g prod_{i=1..sections} (1 + b1_i q^-1 + b2_i q^-2) / (1 + a1_i q^-1 + a2_i q^-2).
///
/// theta = [g, b1_1, b2_1, a1_1, a2_1, b1_2, ...], (1 + 4 sections,). Roots of each section move with its own four
/// numbers only, so that high orders stay well conditioned where the coefficients of one polynomial do not.
/// stable: theta = [g, b1_1, b2_1, p_1, q_1, ...] with a2_i = tanh(q_i), a1_i = (1 + a2_i) tanh(p_i): the interior of
/// the stability triangle |a2| < 1, |a1| < 1 + a2, so every theta is a stable filter (as far as tanh tells from 1:
/// |p|, |q| < 18).
/// x = transposed direct form II, two numbers a section, (2 sections,). Zero is rest.
class Biquads {
 public:
  /// Throws Error unless sections >= 1.
  explicit Biquads(Index sections, bool stable = false);

  Index sections() const { return sections_; }
  bool stable() const { return stable_; }

  std::string kind() const { return "biquads"; }
  Arguments arguments() const;
  Index parameter_count() const { return 1 + 4 * sections_; }
  Index state_count() const { return 2 * sections_; }
  std::vector<std::string> parameter_names() const;
  /// G = 1: zeros on poles, at radius 1/2 and a different angle for each section, so that they can part.
  Eigen::VectorXd initial_parameters() const;
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return false; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    if constexpr (std::is_same_v<T, double>) {
      filter(theta, x, u, y);
    } else {
      for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t];
      for (std::size_t i = 0; i < static_cast<std::size_t>(sections_); ++i) {
        const Section<T> s = section(theta, i);
        T* z = x.data() + 2 * i;
        for (T& sample : y) {
          const T input = sample;
          sample += z[0];
          z[0] = z[1] + s.b1 * input - s.a1 * sample;
          z[1] = s.b2 * input - s.a2 * sample;
        }
      }
    }
  }

  /// g, then section after section b1, b2, a1, a2 (p, q) and on request its two states.
  std::vector<Index> column_order(OwnColumns own) const;
  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  std::complex<double> frequency_response(std::span<const double> theta, double omega) const;
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;
  /// g.
  Index gain_parameter(std::span<const double>) const { return 0; }

  /// theta of g prod (1 - zero q^-1) / prod (1 - pole q^-1): up to 2 sections roots each, closed under conjugation;
  /// those that are missing lie at the origin. Throws Error on other roots, and if stable on poles with |pole| >= 1.
  Eigen::VectorXd from_roots(double g, const std::vector<std::complex<double>>& zeros,
                             const std::vector<std::complex<double>>& poles) const;
  /// (sections, 6): a row is b0, b1, b2, 1, a1, a2 of a section; the first section carries the gain.
  Eigen::MatrixXd second_order_sections(std::span<const double> theta) const;

 private:
  template <class T>
  struct Section {
    T b1, b2, a1, a2;
  };

  template <class T>
  Section<T> section(std::span<const T> theta, std::size_t i) const {
    using std::tanh;
    const T* own = theta.data() + 1 + 4 * i;
    if (!stable_) return {own[0], own[1], own[2], own[3]};
    const T a2 = tanh(own[3]);
    return {own[0], own[1], (1.0 + a2) * tanh(own[2]), a2};
  }

  void filter(std::span<const double> theta, std::span<double> x, std::span<const double> u, std::span<double> y) const;
  void set_denominator(Eigen::VectorXd& theta, Index i, double a1, double a2) const;

  Index sections_;
  bool stable_;
};

}  // namespace blockid
