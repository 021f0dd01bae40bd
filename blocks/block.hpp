// The Block contract: what a signal operator must offer, and what is deduced when it offers no more.
// blocks/README.md states the laws; <blockid/testing/block_conformance.hpp> tests them.
#pragma once

#include <Eigen/Core>
#include <concepts>
#include <cstddef>
#include <span>

namespace blockid {

using Index = Eigen::Index;

/// Largest number of samples that one call of push_forward() sees. Longer records come in tiles.
inline constexpr Index kMaxTileRows = 512;

/// Rows of a tangent tile are padded to a multiple of this many columns, so that vector kernels may read and
/// write whole groups without a remainder loop.
inline constexpr Index kColumnPadding = 8;

/// Smallest padded row length that holds `columns` columns.
constexpr Index padded_columns(Index columns) {
  return (columns + kColumnPadding - 1) / kColumnPadding * kColumnPadding;
}

/// Which columns a block appends to a tangent tile: dy/dtheta alone, or dy/dtheta and dy/dx(0).
enum class OwnColumns { parameters, parameters_and_state };

/// One tile of tangents, row-major: row t holds the derivatives of sample t.
///
/// On entry columns [0, upstream) hold du_t/dp, on exit dy_t/dp; the block writes its own derivatives at columns
/// [upstream, upstream + own). What lies beyond is padding that a block may overwrite.
/// Shape: rows x stride with rows <= kMaxTileRows, stride a multiple of kColumnPadding and >= upstream + own.
struct Tangents {
  double* data = nullptr;
  Index rows = 0;
  Index stride = 0;
  Index upstream = 0;

  double* row(Index t) const { return data + t * stride; }
  double* own(Index t) const { return row(t) + upstream; }
};

/// y = B(theta, x) u. A block is an immutable value that holds structure only; numbers are arguments.
///
/// Required members (T is double or a ceres::Jet):
///   Index parameter_count() const;
///   template <class T> void apply(std::span<const T> theta,   // (parameter_count(),)
///                                 std::span<T> x,             // (state_count(),) in: state before, out: after
///                                 std::span<const T> u,       // (N,) input
///                                 std::span<T> y) const;      // (N,) output, does not overlap u
/// Optional members, each deduced when absent (see any_block.hpp for what each means):
///   Index state_count() const;                                // default 0: a static block
///   push_forward, tangent_memory                              // default: Jets of apply
///   kind(), arguments(), parameter_names(), initial_parameters(), is_linear(), is_linear_in_parameters(),
///   frequency_response(), latency(), adapted_to(), with_scaled_input(), with_scaled_output(),
///   with_scaled_signals(), bounds()
template <class B>
concept Block = std::copy_constructible<B> &&
    requires(const B& block, std::span<const double> theta, std::span<double> x, std::span<const double> u,
             std::span<double> y) {
  { block.parameter_count() } -> std::convertible_to<Index>;
  block.apply(theta, x, u, y);
};

}  // namespace blockid
