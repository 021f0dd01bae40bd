// The single blocks of a chain with their places, signals and roots.
#pragma once

#include <blockid/blocks/model.hpp>

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// A block that has no children, and where it stands in the chain.
struct LeafBlock {
  /// As in parameter names: "G1", or "branch1.G" in a nested chain.
  std::string path;
  AnyBlock block;
  /// Place of its first parameter.
  Index offset = 0;
  /// (n_theta of the block,)
  Eigen::VectorXd parameters;
};

/// In signal order, branch after branch.
std::vector<LeafBlock> leaf_blocks(const Model& model);

/// The signal (N,) at the input of each leaf when u (N,) drives the model from its initial state.
std::vector<Eigen::VectorXd> leaf_inputs(const Model& model, const Eigen::VectorXd& u);

/// Zeros and poles of a linear block in the z plane; those at the origin and at infinity are left out.
struct LinearRoots {
  std::vector<std::complex<double>> zeros;
  std::vector<std::complex<double>> poles;
};

/// Nothing for blocks that are not rational, fir or biquads, or whose numerator is zero.
std::optional<LinearRoots> linear_roots(const AnyBlock& block, const Eigen::VectorXd& parameters);

/// f_n = |ln z| / (2 pi sample_time_s) in Hz.
double natural_frequency_hz(std::complex<double> root, double sample_time_s);

/// G(1); nothing for blocks without a frequency response.
std::optional<double> dc_gain(const AnyBlock& block, const Eigen::VectorXd& parameters);

/// "0.7+0.3i"
std::string to_text(std::complex<double> root);

}  // namespace blockid::cli
