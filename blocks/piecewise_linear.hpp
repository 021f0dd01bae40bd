// Static function made of straight pieces.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/scalar_part.hpp>
#include <blockid/blocks/knots.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = v_i + (v_{i+1} - v_i) (u_t - k_i) / (k_{i+1} - k_i) where k_i <= u_t < k_{i+1}; the first and the last piece
/// go on beyond the end knots.
///
/// theta = [v_1 .. v_K], (K,): the values at the knots k_1 < .. < k_K. No state.
/// At a knot dy/du is the slope of the piece on its right, at the last knot that of the last piece.
/// Acts on the samples; oversampled() lets it act between them.
class PiecewiseLinear {
 public:
  /// Knots uniform on [-1, 1] until adapted_to() places them. Throws Error unless 2 <= knots <= 1000.
  explicit PiecewiseLinear(Index knots, KnotPlacement placement = KnotPlacement::mixed);
  /// Knots uniform over the range. Throws Error likewise, and unless range.lower < range.upper.
  PiecewiseLinear(Index knots, SignalRange range);
  /// Throws Error unless there are 2 .. 1000 finite, strictly increasing knots.
  explicit PiecewiseLinear(std::vector<double> knots);

  /// (K,) in increasing order.
  const std::vector<double>& knots() const { return knots_.values(); }

  std::string kind() const { return "piecewise_linear"; }
  Arguments arguments() const { return knots_.arguments(); }
  Index parameter_count() const { return knots_.count(); }
  std::vector<std::string> parameter_names() const;
  /// y = u.
  Eigen::VectorXd initial_parameters() const;
  bool is_linear() const { return false; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    const PieceFinder find = knots_.finder();
    for (std::size_t t = 0; t < u.size(); ++t) {
      const auto i = static_cast<std::size_t>(interval(find, detail::scalar_part(u[t])));
      const T part = (u[t] - find.knots[i]) / (find.knots[i + 1] - find.knots[i]);
      y[t] = theta[i] + part * (theta[i + 1] - theta[i]);
    }
  }

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  /// Knots placed for v, unless knots or a range were given.
  PiecewiseLinear adapted_to(std::span<const double> v) const;
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;

  /// (K,) theta with y = f(u) at the knots.
  Eigen::VectorXd coefficients_of(const std::function<double(double)>& f) const;

 private:
  explicit PiecewiseLinear(Knots knots) : knots_(std::move(knots)) {}

  static std::int32_t interval(const PieceFinder& find, double u) { return std::clamp(find(u) - 1, 0, find.count - 2); }

  Knots knots_;
};

}  // namespace blockid
