// Branches side by side, summed.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <complex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y = B_1 u + B_2 u + ... + B_n u, written `[a + b]` in the text form.
///
/// theta and x are those of the branches, one after the other; names as in Series.
class Parallel {
 public:
  /// Throws Error for no branch, two branches of the same label, or branches that differ in latency().
  explicit Parallel(std::vector<LabelledBlock> branches);

  const std::vector<LabelledBlock>& children() const { return blocks_; }

  std::string kind() const { return "parallel"; }
  Index parameter_count() const { return parameter_count_; }
  Index state_count() const { return state_count_; }
  std::vector<std::string> parameter_names() const;
  Eigen::VectorXd initial_parameters() const;
  ParameterBounds bounds() const;
  bool is_linear() const;
  bool is_linear_in_parameters() const;
  Index latency() const { return blocks_.front().block.latency(); }

  Index parameter_offset(Index k) const { return parameter_offsets_[static_cast<std::size_t>(k)]; }
  Index state_offset(Index k) const { return state_offsets_[static_cast<std::size_t>(k)]; }

  void apply(std::span<const double> theta, std::span<double> x, std::span<const double> u, std::span<double> y) const;
  void apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
             std::span<TileJet> y) const;

  std::vector<Index> column_order(OwnColumns own) const;
  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  /// Sum of the branches' responses; nothing when one of them has none.
  std::optional<std::complex<double>> frequency_response(std::span<const double> theta, double omega) const;

 private:
  std::vector<LabelledBlock> blocks_;
  std::vector<Index> parameter_offsets_;
  std::vector<Index> state_offsets_;
  Index parameter_count_ = 0;
  Index state_count_ = 0;
};

}  // namespace blockid
