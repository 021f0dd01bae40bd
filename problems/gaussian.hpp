// Gaussian numbers that are the same with every standard library.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace blockid::problems {

/// Independent N(0, 1) numbers from std::mt19937_64 by the transformation of Box and Muller (1958). The engine's bits
/// are fixed by the C++ standard, those of std::normal_distribution are not.
class Gaussian {
 public:
  explicit Gaussian(std::uint64_t seed) : engine_(seed) {}

  /// The next number.
  double operator()();
  /// The next n numbers, (n,).
  Eigen::VectorXd vector(Eigen::Index n);

 private:
  /// Uniform in (0, 1], 53 bits.
  double uniform();

  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace blockid::problems
