// Eigen vectors as spans, which is how blocks take signals, parameters and states.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

namespace blockid::detail {

inline std::span<const double> view(const Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }
inline std::span<double> view(Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

}  // namespace blockid::detail
