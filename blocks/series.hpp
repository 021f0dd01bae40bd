// Blocks in a row.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <complex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y = B_n(... B_2(B_1 u)).
///
/// theta and x are those of the blocks, one after the other. Parameter names carry the block's label (or its kind and
/// place when it has none): `G1.b0`. A Series is a block itself and nests.
class Series {
 public:
  /// Throws Error for an empty row or for two blocks of the same label.
  explicit Series(std::vector<LabelledBlock> blocks);

  const std::vector<LabelledBlock>& children() const { return blocks_; }

  std::string kind() const { return "series"; }
  Index parameter_count() const { return parameter_count_; }
  Index state_count() const { return state_count_; }
  std::vector<std::string> parameter_names() const;
  Eigen::VectorXd initial_parameters() const;
  ParameterBounds bounds() const;
  bool is_linear() const;
  /// True when at most one block has parameters that matter, all behind it are linear, and it is linear in them itself.
  bool is_linear_in_parameters() const;
  Index latency() const;

  /// Place of the first parameter and the first state of child k.
  Index parameter_offset(Index k) const { return parameter_offsets_[static_cast<std::size_t>(k)]; }
  Index state_offset(Index k) const { return state_offsets_[static_cast<std::size_t>(k)]; }

  void apply(std::span<const double> theta, std::span<double> x, std::span<const double> u, std::span<double> y) const;
  void apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
             std::span<TileJet> y) const;

  std::vector<Index> column_order(OwnColumns own) const;
  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;
  bool push_negated(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, double* target) const;

  /// Product of the blocks' responses; nothing when one of them has none.
  std::optional<std::complex<double>> frequency_response(std::span<const double> theta, double omega) const;

 private:
  /// push(k, theta, x, memory, u, y, tangents) for each child k in turn.
  template <class Push>
  void push_children(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                     std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own,
                     Push&& push) const;

  std::vector<LabelledBlock> blocks_;
  std::vector<Index> parameter_offsets_;
  std::vector<Index> state_offsets_;
  Index parameter_count_ = 0;
  Index state_count_ = 0;
};

}  // namespace blockid
