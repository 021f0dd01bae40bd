// Amplitudes and powers in decibels.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace blockid::cli {

/// 20 log10 |g|.
inline Eigen::VectorXd decibels(const Eigen::VectorXcd& g) { return 20.0 * g.array().abs().log10(); }

/// 10 log10 of the power; not a number where it is not positive.
inline Eigen::VectorXd power_decibels(const Eigen::VectorXd& power) {
  return power.unaryExpr([](double p) { return p > 0.0 ? 10.0 * std::log10(p) : std::nan(""); });
}

}  // namespace blockid::cli
