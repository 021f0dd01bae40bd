// The parts of a chain that is a Wiener-Hammerstein model: filter | static block | filter.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>

#include <optional>
#include <string>
#include <vector>

namespace blockid {

/// G_W and G_H are the positions of the rational blocks in the row, absent for Hammerstein and Wiener chains.
struct WienerHammersteinStructure {
  std::vector<LabelledBlock> blocks;
  std::optional<std::size_t> first_filter;
  std::size_t static_block = 0;
  std::optional<std::size_t> second_filter;

  const Rational* g_w() const;
  const Rational* g_h() const;
};

/// Takes apart `rational | static | rational` (either filter may be missing); the static block may be oversampled.
/// Throws Error for any other chain; `who` asks, for the message.
WienerHammersteinStructure wiener_hammerstein_structure(const AnyBlock& chain, const std::string& who);

}  // namespace blockid
