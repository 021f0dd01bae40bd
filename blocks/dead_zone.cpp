#include <blockid/blocks/dead_zone.hpp>

#include <algorithm>

namespace blockid {

void DeadZone::push_forward(std::span<const double> theta, std::span<double> x, std::span<double>,
                            std::span<const double> u, std::span<double> y, const Tangents& tangents,
                            OwnColumns) const {
  apply(theta, x, u, y);
  for (Index t = 0; t < tangents.rows; ++t) {
    const double input = u[static_cast<std::size_t>(t)];
    const bool high = input > theta[1];
    const bool low = !high && input < theta[0];
    double* own = tangents.own(t);
    own[0] = low ? -1.0 : 0.0;
    own[1] = high ? -1.0 : 0.0;
    if (!low && !high) std::fill_n(tangents.row(t), tangents.upstream, 0.0);
  }
}

std::optional<Rescaled> DeadZone::with_scaled_signals(std::span<const double> theta, double k) const {
  if (k >= 0.0) return Rescaled{*this, Eigen::Vector2d(k * theta[0], k * theta[1])};
  if (theta[0] > theta[1]) return std::nullopt;
  return Rescaled{*this, Eigen::Vector2d(k * theta[1], k * theta[0])};
}

}  // namespace blockid
