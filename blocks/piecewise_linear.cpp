#include <blockid/blocks/piecewise_linear.hpp>

namespace blockid {

PiecewiseLinear::PiecewiseLinear(Index knots, KnotPlacement placement) : knots_("piecewise_linear", knots, placement) {}

PiecewiseLinear::PiecewiseLinear(Index knots, SignalRange range) : knots_("piecewise_linear", knots, range) {}

PiecewiseLinear::PiecewiseLinear(std::vector<double> knots) : knots_("piecewise_linear", std::move(knots)) {}

std::vector<std::string> PiecewiseLinear::parameter_names() const {
  std::vector<std::string> names;
  for (Index k = 1; k <= parameter_count(); ++k) names.push_back("v" + std::to_string(k));
  return names;
}

Eigen::VectorXd PiecewiseLinear::initial_parameters() const {
  return Eigen::Map<const Eigen::VectorXd>(knots().data(), knots_.count());
}

void PiecewiseLinear::push_forward(std::span<const double> theta, std::span<double>, std::span<double>,
                                   std::span<const double> u, std::span<double> y, const Tangents& tangents,
                                   OwnColumns) const {
  const PieceFinder find = knots_.finder();
  for (Index t = 0; t < tangents.rows; ++t) {
    const auto now = static_cast<std::size_t>(t);
    const auto i = static_cast<std::size_t>(interval(find, u[now]));
    const double width = find.knots[i + 1] - find.knots[i];
    const double part = (u[now] - find.knots[i]) / width;
    const double rise = theta[i + 1] - theta[i];
    y[now] = theta[i] + part * rise;
    const double slope = rise / width;
    double* row = tangents.row(t);
    for (Index c = 0; c < tangents.upstream; ++c) row[c] *= slope;
    double* own = tangents.own(t);
    std::fill_n(own, theta.size(), 0.0);
    own[i] = 1.0 - part;
    own[i + 1] = part;
  }
}

PiecewiseLinear PiecewiseLinear::adapted_to(std::span<const double> v) const {
  return PiecewiseLinear(knots_.adapted_to(v));
}

Rescaled PiecewiseLinear::with_scaled_input(std::span<const double> theta, double k) const {
  Eigen::VectorXd values = Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count());
  if (k < 0.0) values.reverseInPlace();
  return {PiecewiseLinear(knots_.scaled(k)), values};
}

Rescaled PiecewiseLinear::with_scaled_output(std::span<const double> theta, double k) const {
  return {*this, k * Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count())};
}

Eigen::VectorXd PiecewiseLinear::coefficients_of(const std::function<double(double)>& f) const {
  return initial_parameters().unaryExpr(f);
}

}  // namespace blockid
