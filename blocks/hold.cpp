#include <blockid/blocks/hold.hpp>

#include <blockid/blocks/detail/hold.hpp>

namespace blockid {

std::string to_text(Hold hold) {
  switch (hold) {
    case Hold::zero_order:
      return "zoh";
    case Hold::first_order:
      return "foh";
    case Hold::cubic:
      return "spline3";
    case Hold::quintic:
      return "spline5";
    case Hold::septic:
      return "spline7";
    case Hold::band_limited:
      return "band_limited";
  }
  return "zoh";
}

std::vector<Hold> holds() {
  return {Hold::zero_order, Hold::first_order, Hold::cubic, Hold::quintic, Hold::septic, Hold::band_limited};
}

std::optional<Hold> hold_from_text(std::string_view text) {
  for (const Hold hold : holds()) {
    if (to_text(hold) == text) return hold;
  }
  return std::nullopt;
}

Index hold_latency(Hold hold) {
  const detail::HoldPieces& pieces = detail::hold_pieces(hold);
  return pieces.reach + pieces.half_prefilter();
}

}  // namespace blockid
