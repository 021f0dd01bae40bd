// Numbers and roots as lists of a result file.
#pragma once

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/leaf_blocks.hpp>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <complex>
#include <vector>

namespace blockid::cli {

inline nlohmann::ordered_json numbers_json(const Eigen::VectorXd& values) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const double value : values) list.push_back(finite_or_null(value));
  return list;
}

/// Roots in the z plane.
inline nlohmann::ordered_json roots_json(const std::vector<std::complex<double>>& roots, double sample_time_s) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const std::complex<double>& root : roots) {
    list.push_back({{"real", root.real()},
                    {"imaginary", root.imag()},
                    {"modulus", std::abs(root)},
                    {"natural_frequency_hz", finite_or_null(natural_frequency_hz(root, sample_time_s))}});
  }
  return list;
}

}  // namespace blockid::cli
