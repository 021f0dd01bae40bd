// Wiener-Hammerstein systems drawn at random: what initialisers are compared on.
#pragma once

#include <blockid/problems/gaussian.hpp>
#include <blockid/problems/problem.hpp>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace blockid::problems {

/// The static block of a random system. tanh is a tanh network of one unit.
enum class StaticKind { polynomial, saturation, dead_zone, tanh };

/// All of them, in the order of the declaration.
std::vector<StaticKind> static_kinds();

/// "polynomial", "saturation", "dead_zone", "tanh".
std::string to_text(StaticKind kind);

struct RandomWienerHammersteinOptions {
  /// Poles, and zeros, of each of the two filters.
  Eigen::Index order = 3;
  StaticKind static_kind = StaticKind::polynomial;
  Eigen::Index samples = 5000;
  Eigen::Index test_samples = 5000;
  /// 20 log10 (std of the noise-free output / std of the noise); infinite for no noise.
  double snr_db = 40.0;
  std::uint64_t seed = 1;
};

/// y = G2 f(G1 u) + e with white Gaussian u of deviation 1 and white Gaussian e, from rest.
///
/// Roots are real or come in pairs, at random. Poles: radius uniform in [0.3, 0.9]. Zeros: likewise, each real zero or
/// pair reflected to 1 / radius with probability 1/4, hence outside the circle. Both filters are scaled to give white
/// unit input the deviation 1, so that v = G1 u has deviation 1 whatever the filter. f at random:
///
///   polynomial  f(v) = v + c2 v^2 + c3 v^3, |c2| in [0.1, 0.3], |c3| in [0.1, 0.2], signs at random
///   saturation  limits -lower and upper in [0.5, 1.2]
///   dead_zone   limits -lower and upper in [0.3, 0.8]
///   tanh        f(v) = e v + tanh(s v + t), e in [0, 0.1], s in [1, 2], t in [-0.5, 0.5]
/// The slope of the best line through (v, f(v)) is never near zero, so the best linear approximation exists; at least
/// one percent of the variance of f(v) is left by that line.
/// Throws Error for order < 1, record lengths < 1 and a snr_db that is not a number.
Problem random_wiener_hammerstein(const RandomWienerHammersteinOptions& options = {});

/// One of a suite of short noise-free records: orders of the two filters drawn from 1..5, f a tanh network of two
/// units, 400 samples, outputs of deviation 1. `index` selects the system and is its seed; systems 0..255 are the
/// suite.
///
/// In the manner of Forgione et al., sysid-transformers: their systems are not these, their figures are beside.
Problem short_wiener_hammerstein(std::uint64_t index);

/// The structure of a problem's truth with unsettled ranges: what an estimator is told when it knows the structure.
/// Throws Error when the problem has no truth.
AnyBlock true_structure(const Problem& problem);

}  // namespace blockid::problems
