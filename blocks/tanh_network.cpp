#include <blockid/blocks/tanh_network.hpp>

#include <blockid/blocks/detail/format.hpp>
#include <blockid/blocks/detail/signal_range.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>

namespace blockid {

TanhNetwork::TanhNetwork(Index units) : TanhNetwork(units, SignalRange{}) { range_given_ = false; }

TanhNetwork::TanhNetwork(Index units, SignalRange range)
    : units_(units),
      range_(range),
      range_given_(true),
      scale_(2.0 / (range.upper - range.lower)),
      shift_(-(range.upper + range.lower) / (range.upper - range.lower)) {
  if (units < 1) fail("tanh_network: expected at least 1 unit, got ", units);
  detail::check_range(range, "tanh_network");
}

Arguments TanhNetwork::arguments() const {
  Arguments result = {{"units", std::to_string(units_)}};
  if (range_given_) result.emplace_back("range", detail::list_text({range_.lower, range_.upper}));
  return result;
}

std::vector<std::string> TanhNetwork::parameter_names() const {
  std::vector<std::string> names = {"d", "e"};
  for (Index i = 1; i <= units_; ++i) {
    for (const char* name : {"w", "s", "t"}) names.push_back(name + std::to_string(i));
  }
  return names;
}

Eigen::VectorXd TanhNetwork::initial_parameters() const {
  const double half_width = 0.5 * (range_.upper - range_.lower);
  const double units = static_cast<double>(units_);
  Eigen::VectorXd theta(parameter_count());
  theta[0] = 0.5 * (range_.upper + range_.lower);
  theta[1] = half_width;
  for (Index i = 0; i < units_; ++i) {
    // With slope = units neighbouring transitions just meet.
    const double centre = (2.0 * static_cast<double>(i) + 1.0) / units - 1.0;
    theta.segment<3>(2 + 3 * i) << 0.01 * half_width / units, units, -units * centre;
  }
  return theta;
}

void TanhNetwork::push_forward(std::span<const double> theta, std::span<double>, std::span<double>,
                               std::span<const double> u, std::span<double> y, const Tangents& tangents,
                               OwnColumns) const {
  for (Index t = 0; t < tangents.rows; ++t) {
    const double x = u[static_cast<std::size_t>(t)] * scale_ + shift_;
    double* own = tangents.own(t);
    own[0] = 1.0;
    own[1] = x;
    double value = theta[0] + theta[1] * x;
    double slope = theta[1];
    for (std::size_t k = 2; k < theta.size(); k += 3) {
      const double unit = std::tanh(theta[k + 1] * x + theta[k + 2]);
      const double inner = theta[k] * (1.0 - unit * unit);
      own[k] = unit;
      own[k + 1] = inner * x;
      own[k + 2] = inner;
      value += theta[k] * unit;
      slope += inner * theta[k + 1];
    }
    y[static_cast<std::size_t>(t)] = value;
    slope *= scale_;
    double* row = tangents.row(t);
    for (Index c = 0; c < tangents.upstream; ++c) row[c] *= slope;
  }
}

TanhNetwork TanhNetwork::adapted_to(std::span<const double> v) const {
  return range_given_ ? *this : TanhNetwork(units_, detail::range_of(v, "tanh_network"));
}

Rescaled TanhNetwork::with_scaled_input(std::span<const double> theta, double k) const {
  Eigen::VectorXd scaled = Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count());
  if (k < 0.0) {
    scaled[1] = -scaled[1];
    for (Index i = 0; i < units_; ++i) scaled[3 + 3 * i] = -scaled[3 + 3 * i];
  }
  const double a = k * range_.lower;
  const double b = k * range_.upper;
  return {TanhNetwork(units_, {std::min(a, b), std::max(a, b)}), scaled};
}

Rescaled TanhNetwork::with_scaled_output(std::span<const double> theta, double k) const {
  Eigen::VectorXd scaled = Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count());
  scaled.head<2>() *= k;
  for (Index i = 0; i < units_; ++i) scaled[2 + 3 * i] *= k;
  return {*this, scaled};
}

}  // namespace blockid
