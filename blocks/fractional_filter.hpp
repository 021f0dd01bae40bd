// Linear filter whose poles and zeros are present to a fractional degree.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/taylor_expansion.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace blockid {

/// Radius to which zeros near the unit circle are drawn in: their expansion would hardly die away.
inline constexpr double kLargestZeroRadius = 0.99;

/// Real roots, and complex pairs by their member with Im > 0.
struct FractionalRoots {
  std::vector<std::complex<double>> poles;
  std::vector<std::complex<double>> zeros;
};

/// y = q^-nk (1 + A_1 q^-1 + ... + A_n q^-n) u with A_k the Taylor coefficients in x = q^-1 of
///   prod_j (1 - z_j x)^beta_j / prod_i (1 - p_i x)^alpha_i   for k <= n1, and free numbers d_k for n1 < k <= n.
///
/// A pair stands for both its roots. alpha_i = 1: pole i is in the filter; 0: it is not; so for the zeros.
/// theta = [alpha_1 .., beta_1 .., d_{n1+1} .. d_n]. x = the last n + nk inputs, newest first. Zero is rest.
///
/// Zeros outside the circle (|z| > 1/0.99), whose expansion would grow as |z|^k, enter as
///   (1 - x/conj z)^beta ((1 - beta) + beta (1 - z x)/(1 - x/conj z)),
/// exact at beta = 0 and 1. Zeros with 0.99 < |z| <= 1/0.99 are drawn in to |z| = 0.99.
/// Source: Giordano and Sjoberg 2015, equations (15) and (20) to (24), with the 1/k! that (19) and (20) lack.
class FractionalFilter {
 public:
  /// Throws Error unless 0 <= n1 <= n, nk >= 0, all roots are finite with Im >= 0, and poles lie inside the circle.
  FractionalFilter(FractionalRoots roots, Index n, Index n1, Index nk = 0);
  /// n1 = n: no free coefficients.
  FractionalFilter(FractionalRoots roots, Index n) : FractionalFilter(std::move(roots), n, n) {}

  const FractionalRoots& roots() const { return roots_; }
  Index n() const { return n_; }
  Index n1() const { return n1_; }
  Index nk() const { return nk_; }
  Index exponent_count() const { return powers_.cols(); }

  std::string kind() const { return "fractional"; }
  Arguments arguments() const;
  Index parameter_count() const { return exponent_count() + n_ - n1_; }
  Index state_count() const { return n_ + nk_; }
  std::vector<std::string> parameter_names() const;
  /// All exponents 1/2; d_k as if they followed.
  Eigen::VectorXd initial_parameters() const;
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return exponent_count() == 0; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    const std::vector<T> h = response(theta);
    for (std::size_t start = 0; start < u.size(); start += static_cast<std::size_t>(kMaxTileRows)) {
      const std::size_t rows = std::min(static_cast<std::size_t>(kMaxTileRows), u.size() - start);
      filter_tile(h, x, u.subspan(start, rows), y.subspan(start, rows));
    }
  }

  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  std::complex<double> frequency_response(std::span<const double> theta, double omega) const;

  /// (n + 1,) 1, A_1 .. A_n1, d_{n1+1} .. d_n; without the delay.
  Eigen::VectorXd coefficients(std::span<const double> theta) const;
  /// (n + 1, exponents) d coefficients / d exponents.
  Eigen::MatrixXd coefficient_tangents(std::span<const double> theta) const;

 private:
  /// A zero outside the circle: which exponent it has, and delta_1 .. delta_n of allpass(x) = 1 + delta(x).
  struct OutsideZero {
    Index exponent;
    Eigen::VectorXd delta;
  };

  /// a += factor delta a, from the highest power down.
  template <class T>
  static void blend(std::vector<T>& a, const T& factor, const Eigen::VectorXd& delta) {
    for (std::size_t k = a.size(); k-- > 1;) {
      T sum(0.0);
      for (std::size_t j = 1; j <= k; ++j) sum += delta[static_cast<Index>(j) - 1] * a[k - j];
      a[k] += factor * sum;
    }
  }

  /// The expansion to `length` + 1 terms with outside zero number `left_out` not blended.
  template <class T>
  std::vector<T> expansion(std::span<const T> theta, Index length, Index left_out = -1) const {
    std::vector<T> s(static_cast<std::size_t>(length), T(0.0));
    for (Index i = 0; i < exponent_count(); ++i) {
      for (Index k = 0; k < length; ++k) {
        s[static_cast<std::size_t>(k)] += powers_(k, i) * theta[static_cast<std::size_t>(i)];
      }
    }
    std::vector<T> a = taylor_coefficients(s);
    for (Index j = 0; j < static_cast<Index>(outside_.size()); ++j) {
      const OutsideZero& zero = outside_[static_cast<std::size_t>(j)];
      if (j != left_out) blend(a, theta[static_cast<std::size_t>(zero.exponent)], zero.delta);
    }
    return a;
  }

  template <class T>
  std::vector<T> response(std::span<const T> theta) const {
    std::vector<T> h = expansion(theta, n1_);
    h.insert(h.end(), theta.begin() + exponent_count(), theta.end());
    return h;
  }

  /// Past and present inputs in the order of time: (state_count() + u.size(),); x moves on.
  template <class T>
  std::vector<T> joined(std::span<T> x, std::span<const T> u) const {
    std::vector<T> all(x.rbegin(), x.rend());
    all.insert(all.end(), u.begin(), u.end());
    std::copy_n(all.rbegin(), x.size(), x.begin());
    return all;
  }

  template <class T>
  void filter_tile(const std::vector<T>& h, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    const std::vector<T> all = joined(x, u);
    const T* input = all.data() + n_;
    if constexpr (std::is_same_v<T, double>) {
      convolve(h.data(), input, y);
    } else {
      for (std::size_t t = 0; t < y.size(); ++t) {
        y[t] = T(0.0);
        for (std::size_t k = 0; k < h.size(); ++k) y[t] += h[k] * input[static_cast<std::ptrdiff_t>(t - k)];
      }
    }
  }

  void convolve(const double* h, const double* input, std::span<double> y) const;

  FractionalRoots roots_;
  Index n_;
  Index n1_;
  Index nk_;
  /// (n, exponents): d s_k / d exponent.
  Eigen::MatrixXd powers_;
  std::vector<OutsideZero> outside_;
};

}  // namespace blockid
