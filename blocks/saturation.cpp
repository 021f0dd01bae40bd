#include <blockid/blocks/saturation.hpp>

#include <algorithm>

namespace blockid {

void Saturation::push_forward(std::span<const double> theta, std::span<double> x, std::span<double>,
                              std::span<const double> u, std::span<double> y, const Tangents& tangents,
                              OwnColumns) const {
  apply(theta, x, u, y);
  for (Index t = 0; t < tangents.rows; ++t) {
    const double input = u[static_cast<std::size_t>(t)];
    const bool low = input < theta[0];
    const bool high = theta[1] < (low ? theta[0] : input);
    double* own = tangents.own(t);
    own[0] = low && !high ? 1.0 : 0.0;
    own[1] = high ? 1.0 : 0.0;
    if (low || high) std::fill_n(tangents.row(t), tangents.upstream, 0.0);
  }
}

std::optional<Rescaled> Saturation::with_scaled_signals(std::span<const double> theta, double k) const {
  if (k >= 0.0) return Rescaled{*this, Eigen::Vector2d(k * theta[0], k * theta[1])};
  if (theta[0] > theta[1]) return std::nullopt;
  return Rescaled{*this, Eigen::Vector2d(k * theta[1], k * theta[0])};
}

}  // namespace blockid
