// A block run at a multiple of the sampling rate.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/detail/resampler.hpp>

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y = (down M) L B (up M) u: u is interpolated to M times the rate (band-limited), B runs there.
///
/// A static B makes harmonics beyond the Nyquist frequency: on the samples alone they fold back, in a circuit they do
/// not. Around a static B the low-pass L removes them before every M-th output is kept. A B with state is taken to do
/// that itself (a chain whose last filter passes little beyond the Nyquist frequency): there L = 1.
///
/// theta: that of B; a filter within B runs at the higher rate, and its coefficients belong to that rate.
/// x = the last inputs, oldest first, then the state of B: (2 (2H - 1),) around a static B, (2H - 1 + n_x,) around
/// others. The filters are linear-phase, H samples long on either side, so the output lags by latency() = 2H - 1
/// samples (static) or H - 1; simulate() and the predictor align it. They pass up to 1 - 2.5/H of the Nyquist
/// frequency. Towards the ends of a record the signal is taken to be zero (or the periodic one) outside.
class Oversampled {
 public:
  static constexpr Index kMaxFactor = 64;
  static constexpr Index kMaxHalfLength = 100;
  static constexpr Index kDefaultHalfLength = 8;

  /// Throws Error unless 2 <= factor <= kMaxFactor, 2 <= half_length <= kMaxHalfLength, and the inner block has no
  /// latency of its own.
  Oversampled(AnyBlock inner, Index factor, Index half_length = kDefaultHalfLength);

  const AnyBlock& inner() const { return inner_; }
  Index factor() const { return resampler_.factor(); }
  Index half_length() const { return resampler_.half_length(); }
  /// The same resampling around another block.
  Oversampled around(AnyBlock inner) const { return {std::move(inner), factor(), half_length()}; }
  /// Past inputs in the state: they come first.
  Index input_history() const { return resampler_.past() * (inner_.is_static() ? 2 : 1); }
  /// v (N M,) at M times the rate for the input u (N,) from rest, in step with the block's own run.
  Eigen::VectorXd interpolated(std::span<const double> u) const;

  std::string kind() const { return "oversampled"; }
  Arguments arguments() const;
  Index parameter_count() const { return inner_.parameter_count(); }
  Index state_count() const { return input_history() + inner_.state_count(); }
  std::vector<std::string> parameter_names() const { return inner_.parameter_names(); }
  Eigen::VectorXd initial_parameters() const { return inner_.initial_parameters(); }
  ParameterBounds bounds() const { return inner_.bounds(); }
  bool is_linear() const { return inner_.is_linear(); }
  bool is_linear_in_parameters() const { return inner_.is_linear_in_parameters(); }
  Index latency() const;

  void apply(std::span<const double> theta, std::span<double> x, std::span<const double> u, std::span<double> y) const;
  void apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
             std::span<TileJet> y) const;

  /// The past inputs come first, then the columns of the inner block.
  std::vector<Index> column_order(OwnColumns own) const;
  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  std::optional<std::complex<double>> frequency_response(std::span<const double> theta, double omega) const;
  /// Placed for v between the samples. A chain inside is left to adapt_structure(), which knows its parameters.
  Oversampled adapted_to(std::span<const double> v) const;
  /// Of a static inner block.
  std::optional<Rescaled> with_scaled_input(std::span<const double> theta, double k) const;
  std::optional<Rescaled> with_scaled_output(std::span<const double> theta, double k) const;
  std::optional<Rescaled> with_scaled_signals(std::span<const double> theta, double k) const;
  std::optional<Index> gain_parameter(std::span<const double> theta) const;

 private:
  struct TileMemory;

  template <class T>
  void run(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const;

  /// Samples that are resampled at once.
  Index chunk_rows() const;

  AnyBlock inner_;
  detail::Resampler resampler_;
};

/// The block itself when it is static, the inner block of an oversampled static one, nothing for others.
std::optional<AnyBlock> static_block_of(const AnyBlock& block);

/// The chain with every oversampled static block, in nested rows and sums as well, in its plain form: a cheaper twin
/// with the same parameters in the same order.
AnyBlock without_oversampling(const AnyBlock& chain);

/// The reverse: `plain` with its static blocks oversampled where those of `pattern` are. Throws Error when the two
/// chains differ in shape.
AnyBlock with_oversampling_of(const AnyBlock& pattern, const AnyBlock& plain);

}  // namespace blockid
