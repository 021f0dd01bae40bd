// Static polynomial in the Chebyshev basis of its input's range.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/signal_range.hpp>

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = sum_{k=0..degree} c_k T_k(x_t), x_t = (2 u_t - lower - upper) / (upper - lower).
///
/// theta = [c_0 .. c_degree], (degree + 1,). T_k are the Chebyshev polynomials: on the range they lie within [-1, 1],
/// so the columns stay well conditioned where powers of u would not. Beyond the range the polynomial goes on as such.
class Polynomial {
 public:
  static constexpr Index kMaxDegree = 60;

  /// Range [-1, 1] until adapted_to() places it. Throws Error unless 0 <= degree <= 60.
  explicit Polynomial(Index degree);
  /// Throws Error unless range.lower < range.upper.
  Polynomial(Index degree, SignalRange range);

  Index degree() const { return degree_; }
  SignalRange range() const { return range_; }

  std::string kind() const { return "polynomial"; }
  Arguments arguments() const;
  Index parameter_count() const { return degree_ + 1; }
  std::vector<std::string> parameter_names() const;
  /// y = u on the range.
  Eigen::VectorXd initial_parameters() const;
  bool is_linear() const { return false; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    if constexpr (std::is_same_v<T, double>) {
      detail_apply(theta, u, y);
    } else {
      for (std::size_t t = 0; t < u.size(); ++t) {
        const T x = u[t] * scale_ + shift_;
        T d1(0.0);
        T d2(0.0);
        for (std::size_t k = theta.size() - 1; k >= 1; --k) {
          const T d0 = 2.0 * x * d1 - d2 + theta[k];
          d2 = d1;
          d1 = d0;
        }
        y[t] = x * d1 - d2 + theta[0];
      }
    }
  }

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  /// Range of v, unless a range was given.
  Polynomial adapted_to(std::span<const double> v) const;
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;

  /// theta of the polynomial p_0 + p_1 u + p_2 u^2 + ... : (degree + 1,) powers in, (degree + 1,) theta out.
  Eigen::VectorXd from_powers(const Eigen::VectorXd& powers) const;
  /// The inverse of from_powers().
  Eigen::VectorXd to_powers(const Eigen::VectorXd& theta) const;

 private:
  void detail_apply(std::span<const double> theta, std::span<const double> u, std::span<double> y) const;

  Index degree_;
  SignalRange range_;
  bool range_given_;
  double scale_;
  double shift_;
};

}  // namespace blockid
