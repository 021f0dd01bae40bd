// A Wiener-Hammerstein system made up for demonstrations and recovery tests.
#pragma once

#include <blockid/problems/problem.hpp>

#include <cstdint>

namespace blockid::problems {

struct SyntheticWienerHammersteinOptions {
  Eigen::Index train_samples = 20000;
  Eigen::Index test_samples = 10000;
  /// 20 log10 (std of the noise-free output / std of the noise).
  double signal_to_noise_db = 40.0;
  std::uint64_t seed = 1;
};

/// y = G2 f(G1 u) + e: third-order filters, f a saturating polynomial of degree 5, white Gaussian u and e, 1 kHz.
///
///   G1: poles 0.7, 0.5 +- 0.6i, zeros -0.3, 0.2 +- 0.6i;  G2: poles 0.8, 0.6 +- 0.3i, zeros 0.3, -0.3 +- 0.5i
///   f(v) = v + 0.05 v^2 - 0.07 v^3 - 0.003 v^4 + 0.0023 v^5 with v of standard deviation 1.5
/// The truth is the chain `G1=rational(nb=3,na=3) | f=polynomial(degree=5) | G2=rational(nb=3,na=3)`.
/// Throws Error for record lengths < 1.
Problem synthetic_wiener_hammerstein(const SyntheticWienerHammersteinOptions& options = {});

}  // namespace blockid::problems
