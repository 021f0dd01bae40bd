// Continuous-time rational filter, in coordinates that stay well conditioned over decades.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/held_filter.hpp>
#include <blockid/blocks/hold.hpp>
#include <blockid/blocks/localising_basis.hpp>

#include <Eigen/Core>
#include <complex>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y = G(s) u,   G = (b_0 + sum_k b_k N_k) / (1 + sum_{k=1..na} a_k F_k),
/// F_k the localising basis of the break points p_1 <= ... <= p_na, N_k = F_k (or their part of degree nb, nb < na -
/// 1).
///
/// It is any B(s)/A(s) with a numerator of degree nb and a denominator of degree na; b_0 is there for nb = na only.
/// theta = [b_0, b_1 .., a_1 .. a_na], (nb + 1 + na,), the b counted from 1 when nb < na: (nb + 1,) of them.
/// Realised as x' = -P (L + 1 a') x + P 1 u, y = b' x + b_0 u, and carried from sample to sample exactly for an input
/// that runs between its samples as `sampling.hold` says. a = 0 puts the poles at the -p_k.
/// x = the states of the realisation, then past inputs for the spline holds. Zero is rest.
/// Source: Garnier, Goodwin and Welsh 2004, section 4; the realisation and its tangents, docs/mathematics.md.
class ContinuousRational {
 public:
  /// Break points in rad/s, na of them; none given: default_break_points(). Throws Error unless 0 <= nb <= na, na >= 1
  /// and the sample time is positive.
  ContinuousRational(Index nb, Index na, Sampling sampling, std::vector<double> break_points = {});

  /// na of them over two decades and a half up to half the Nyquist frequency.
  static std::vector<double> default_break_points(Index na, double sample_time_s);

  Index nb() const { return nb_; }
  Index na() const { return basis_.size(); }
  const Sampling& sampling() const { return sampling_; }
  const LocalisingBasis& basis() const { return basis_; }

  std::string kind() const { return "continuous_rational"; }
  Arguments arguments() const;
  Index parameter_count() const { return nb_ + 1 + na(); }
  Index state_count() const { return na() + detail::held_taps(sampling_.hold) - 1; }
  Index latency() const { return hold_latency(sampling_.hold); }
  std::vector<std::string> parameter_names() const;
  /// The low-pass p_1/(s + p_1) (times those of the break points left over by a low nb): gain 1 at frequency zero.
  Eigen::VectorXd initial_parameters() const;
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return false; }

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
  /// The largest numerator coefficient.
  Index gain_parameter(std::span<const double> theta) const;

  /// G(s) itself.
  std::complex<double> transfer_function(std::span<const double> theta, std::complex<double> s) const;
  /// (na,) poles in rad/s.
  Eigen::VectorXcd poles(std::span<const double> theta) const;
  /// (na,) coefficients of all F_k in the numerator, for any nb.
  Eigen::VectorXd numerator(std::span<const double> theta) const;
  /// theta of gain prod (s - zero) / prod (s - pole): na poles and up to nb zeros, closed under conjugation. Throws
  /// Error on other roots.
  Eigen::VectorXd from_roots(double gain, const std::vector<std::complex<double>>& zeros,
                             const std::vector<std::complex<double>>& poles) const;

 private:
  bool has_direct() const { return nb_ == na(); }
  Index b_count() const { return has_direct() ? na() : nb_ + 1; }

  template <class T>
  detail::HeldFilter<T> filter(std::span<const T> theta) const {
    using Vector = detail::VectorOf<T>;
    const Index first = has_direct() ? 1 : 0;
    const Vector b = Eigen::Map<const Vector>(theta.data() + first, b_count());
    const Vector a = Eigen::Map<const Vector>(theta.data() + nb_ + 1, na());
    return {detail::held_system<T>(basis_.matrix<T>(a), basis_.input().template cast<T>(), sampling_),
            low_degree_.template cast<T>() * b, has_direct() ? theta[0] : T(0.0), latency()};
  }

  detail::HeldTangents tangents_for(Index upstream) const;
  detail::HeldTangentSources sources(std::span<const double> theta, std::span<const double> x) const;

  Index nb_;
  Sampling sampling_;
  LocalisingBasis basis_;
  /// (na, b_count()) coordinates of the N_k.
  Eigen::MatrixXd low_degree_;
};

namespace detail {

/// Throws Error, beginning with `kind`, unless the sample time is positive and finite.
void check_sampling(const char* kind, const Sampling& sampling);

}  // namespace detail
}  // namespace blockid
