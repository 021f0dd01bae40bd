// From the expansions of the two filters to a model: all Taylor coefficients set free, then reduced.
#pragma once

#include <blockid/estimators/candidate.hpp>

namespace blockid {

struct ReleaseOptions {
  /// Coefficients of each expansion; 0: until the slowest pole has died to 1 %, within [20, 60].
  Index coefficients = 0;
  /// Starts: exponents of 1/2 first, then near-corner exponents drawn from InitialiserOptions::seed.
  int starts = 4;
  /// Levenberg-Marquardt iterations of the free coefficients.
  int iterations = 12;
  /// Samples of each record that are used; 0 for all.
  Index samples = 20000;
};

/// FIR | f | FIR started from fractional expansions of the best linear approximation, a few Levenberg-Marquardt steps
/// with all coefficients free, then each FIR reduced to its rational filter on the signals that pass it: u to v for
/// G_W, f(v) to yhat for G_H, by best_linear_approximation(). The signals weigh the reduction by what was excited.
///
/// Repairs what no split of the roots can: real roots of two filters that the best linear approximation merged into a
/// pair, and roots that it misplaced. Cost: linear in the starts, quadratic in the coefficients; the orders matter only
/// through the reduction. Extends the free coefficients of Giordano and Sjoberg 2015, (20) to (24).
Initialiser release(ReleaseOptions options = {});

}  // namespace blockid
