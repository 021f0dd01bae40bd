// The chain of the fractional approach: two filters that share their poles and zeros to fractional degrees.
#pragma once

#include <blockid/blocks/tied.hpp>
#include <blockid/init/root_groups.hpp>

#include <vector>

namespace blockid {

struct FractionalChainOptions {
  /// Coefficients of each expansion; 0: expansion_length() of the roots.
  Index n = 0;
  /// How many of them follow the exponents; -1: all.
  Index n1 = -1;
  /// Delay of the whole chain, in front; infinite zeros add to it.
  Index nk = 0;
};

/// yhat = G_H(1 - alpha, 1 - beta) f(G_W(alpha, beta) q^-nk u), Giordano and Sjoberg 2015, (10), (15) and (16).
///
/// G_W and G_H are FractionalFilter of the same roots, named W, f and H. theta = [alpha, beta, free coefficients of
/// G_W, those of G_H, theta_f], all exponents starting at 1/2. Both filters begin with 1: the gain belongs to f. Throws
/// Error for poles outside the circle.
Tied fractional_chain(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros, const AnyBlock& f,
                      const FractionalChainOptions& options = {});

/// Smallest n with r^n <= tolerance for the largest radius r of the poles and of the zeros as expanded, within
/// [1, longest].
Index expansion_length(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros,
                       double tolerance = 1e-3, Index longest = 500);

}  // namespace blockid
