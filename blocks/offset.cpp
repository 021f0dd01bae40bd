#include <blockid/blocks/offset.hpp>

namespace blockid {

void Offset::push_forward(std::span<const double> theta, std::span<double>, std::span<double>,
                          std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns) const {
  for (Index t = 0; t < tangents.rows; ++t) {
    *tangents.own(t) = 1.0;
    y[static_cast<std::size_t>(t)] = u[static_cast<std::size_t>(t)] + theta[0];
  }
}

}  // namespace blockid
