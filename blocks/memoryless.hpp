// A static block from the user's own function.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/data/error.hpp>

#include <Eigen/Core>
#include <concepts>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace blockid {

/// y_t = f(theta, u_t).
///
/// f(std::span<const T> theta, T u) -> T for T = double and ceres::Jet, without side effects; a generic lambda will do:
///
///     const Memoryless cubic([](auto theta, auto u) { return theta[0] * u + theta[1] * u * u * u; }, 2);
///
/// theta: (parameter_count,). No state. Tangents come from Jets that carry u and theta alone; upstream columns are
/// scaled by dy/du, so their number costs nothing.
template <class F>
requires std::copy_constructible<F> && std::invocable < const F&, std::span<const double>,
double > &&std::invocable<const F&, std::span<const TileJet>, TileJet> class Memoryless {
 public:
  /// names: (parameter_count,) or empty for theta1, theta2 ...; initial: (parameter_count,) or empty for zeros.
  /// Throws Error on other sizes and on parameter_count < 0.
  Memoryless(F f, Index parameter_count, std::vector<std::string> names = {}, Eigen::VectorXd initial = {})
      : f_(std::move(f)), parameter_count_(parameter_count), names_(std::move(names)), initial_(std::move(initial)) {
    if (parameter_count < 0) fail("memoryless: parameter_count must be >= 0, got ", parameter_count);
    if (names_.empty()) {
      for (Index k = 1; k <= parameter_count; ++k) names_.push_back("theta" + std::to_string(k));
    }
    if (initial_.size() == 0) initial_ = Eigen::VectorXd::Zero(parameter_count);
    if (std::ssize(names_) != parameter_count || initial_.size() != parameter_count) {
      fail("memoryless: expected ", parameter_count, " names and initial parameters, got ", names_.size(), " and ",
           initial_.size());
    }
  }

  std::string kind() const { return "memoryless"; }
  Index parameter_count() const { return parameter_count_; }
  std::vector<std::string> parameter_names() const { return names_; }
  Eigen::VectorXd initial_parameters() const { return initial_; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = T(f_(theta, u[t]));
  }

 private:
  F f_;
  Index parameter_count_;
  std::vector<std::string> names_;
  Eigen::VectorXd initial_;
};

}  // namespace blockid
