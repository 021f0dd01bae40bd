#include <blockid/blocks/gain.hpp>

namespace blockid {

void Gain::push_forward(std::span<const double> theta, std::span<double>, std::span<double>, std::span<const double> u,
                        std::span<double> y, const Tangents& tangents, OwnColumns) const {
  const double k = theta[0];
  for (Index t = 0; t < tangents.rows; ++t) {
    const double input = u[static_cast<std::size_t>(t)];
    double* row = tangents.row(t);
    for (Index c = 0; c < tangents.upstream; ++c) row[c] *= k;
    row[tangents.upstream] = input;
    y[static_cast<std::size_t>(t)] = k * input;
  }
}

Rescaled Gain::with_scaled_input(std::span<const double> theta, double k) const {
  return {*this, Eigen::VectorXd::Constant(1, theta[0] / k)};
}

Rescaled Gain::with_scaled_output(std::span<const double> theta, double k) const {
  return {*this, Eigen::VectorXd::Constant(1, theta[0] * k)};
}

}  // namespace blockid
