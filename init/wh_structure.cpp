#include <blockid/blocks/oversampled.hpp>
#include <blockid/data/error.hpp>
#include <blockid/init/wh_structure.hpp>

namespace blockid {

const Rational* WienerHammersteinStructure::g_w() const {
  return first_filter ? blocks[*first_filter].block.target<Rational>() : nullptr;
}

const Rational* WienerHammersteinStructure::g_h() const {
  return second_filter ? blocks[*second_filter].block.target<Rational>() : nullptr;
}

WienerHammersteinStructure wiener_hammerstein_structure(const AnyBlock& chain, const std::string& who) {
  const auto expected = [&](const std::string& got) {
    fail(who, ": expected a chain 'rational | static block | rational' (either filter may be missing), got ", got);
  };
  WienerHammersteinStructure result;
  result.blocks = chain.target<Series>() != nullptr ? chain.children() : std::vector<LabelledBlock>{{"", chain}};
  std::optional<std::size_t> middle;
  for (std::size_t k = 0; k < result.blocks.size(); ++k) {
    const AnyBlock& block = result.blocks[k].block;
    if (block.target<Rational>() != nullptr) {
      std::optional<std::size_t>& place = middle ? result.second_filter : result.first_filter;
      if (place) expected("two filters in a row");
      place = k;
    } else if (static_block_of(block) && !block.is_linear()) {
      if (middle) expected("two static blocks");
      middle = k;
    } else {
      expected("a block of kind '" + block.kind() + "'");
    }
  }
  if (!middle) expected("no static block");
  result.static_block = *middle;
  return result;
}

}  // namespace blockid
