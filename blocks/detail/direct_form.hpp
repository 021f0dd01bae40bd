// The recursion behind every rational block, and its tangents by shifted signals.
#pragma once

#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/kernels.hpp>

#include <algorithm>
#include <span>
#include <type_traits>
#include <vector>

namespace blockid::detail {

/// y = q^-nk B/A u with b: (nb+1,), a: (na,) without a_0 = 1; both padded to the common order max(na, nb + nk).
template <class T>
class DirectForm {
 public:
  DirectForm(std::span<const T> b, std::span<const T> a, Index nk)
      : order_(std::max(static_cast<Index>(a.size()), static_cast<Index>(b.size()) - 1 + nk)),
        coefficients_(2 * (static_cast<std::size_t>(order_) + 1), T(0.0)) {
    const auto denominator = coefficients_.begin() + order_ + 1;
    std::copy(b.begin(), b.end(), coefficients_.begin() + nk);
    std::copy(a.begin(), a.end(), denominator + 1);
    *denominator = T(1.0);
  }

  Index order() const { return order_; }
  const T* b() const { return coefficients_.data(); }
  const T* a() const { return coefficients_.data() + order_ + 1; }

  /// x: (order,), the transposed direct form II state.
  void filter(std::span<T> x, std::span<const T> u, std::span<T> y) const {
    if constexpr (std::is_same_v<T, double>) {
      kernels().filter_signal(b(), a(), order_, x.data(), u.data(), y.data(), static_cast<KernelIndex>(u.size()));
    } else {
      filter_plain(x, u, y);
    }
  }

 private:
  void filter_plain(std::span<T> x, std::span<const T> u, std::span<T> y) const {
    const std::size_t order = static_cast<std::size_t>(order_);
    const T* b = this->b();
    const T* a = this->a();
    for (std::size_t t = 0; t < u.size(); ++t) {
      y[t] = b[0] * u[t];
      if (order == 0) continue;
      y[t] += x[0];
      for (std::size_t k = 0; k + 1 < order; ++k) x[k] = x[k + 1] + b[k + 1] * u[t] - a[k + 1] * y[t];
      x[order - 1] = b[order] * u[t] - a[order] * y[t];
    }
  }

  Index order_;
  /// b, then a.
  std::vector<T> coefficients_;
};

/// Tangents of a rational filter started with state z(0):
///   A y = B u + z(0)  =>  dy/db_k = q^-(nk+k) u/A,  dy/da_k = -q^-k y/A,  dy/dz_j(0) = q^-j 1/A,
/// with u, y zero before the record: exact for any z(0), so two all-pole filters and shifted reads give all own
/// columns.
class DirectFormTangents {
 public:
  /// Shape of the problem; `own` columns are b_{first_b} .. b_nb, a_1 .. a_na and, on request, z_0 .. z_{order-1}.
  struct Shape {
    Index nb;
    Index na;
    Index nk;
    Index first_b = 0;
    Index order() const { return std::max(na, nb + nk); }
    Index own(OwnColumns columns) const {
      return nb + 1 - first_b + na + (columns == OwnColumns::parameters_and_state ? order() : 0);
    }
  };

  static Index memory(const Shape& shape, Index upstream) {
    return shape.order() * padded_columns(upstream) + 3 * (shape.order() + kMaxTileRows) + 1;
  }

  /// One tile of y = B/A u with tangents; arguments as AnyBlock::push_forward.
  static void push(const DirectForm<double>& filter, const Shape& shape, std::span<double> x, std::span<double> memory,
                   std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own);

  /// The same without columns of the state, the rows -dy/dp packed into `target`; arguments as
  /// AnyBlock::push_negated.
  static bool push_negated(const DirectForm<double>& filter, const Shape& shape, std::span<double> x,
                           std::span<double> memory, std::span<const double> u, std::span<double> y,
                           const Tangents& tangents, double* target);
};

}  // namespace blockid::detail
