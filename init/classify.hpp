// From fractional exponents to a model: every root goes to the filter that has more of it.
#pragma once

#include <blockid/estimators/candidate.hpp>

namespace blockid {

struct ClassifyOptions {
  /// Fractional fits: from 1/2 first, then from near-corner exponents drawn from InitialiserOptions::seed.
  int starts = 3;
  /// Levenberg-Marquardt iterations of each fractional fit.
  int iterations = 30;
  /// Pull of the exponents to 1/2, in standard deviations of the output for a unit: without it they wander to +-50.
  double pull = 3e-3;
  /// Coefficients of the expansions; 0: until the slowest pole has died to 1 %, 60 at most.
  Index coefficients = 0;
  /// Roundings of each fit that become candidates: the nearest one and its neighbours.
  Index neighbours = 4;
  /// Samples of each record that are used; 0 for all.
  Index samples = 20000;
};

/// Fractional fit of the exponents of the best linear approximation's poles and zeros (fractional_chain.hpp), the
/// static block eliminated; exponents rounded to {0, 1} so that the degrees come out as wanted, nearest first; poles
/// and zeros placed, the static block by least squares.
///
/// The nearest roundings are found by dynamic programming: no cost grows exponentially with the orders. A complex pair
/// is broken into real roots when no rounding fits the degrees. Source: Giordano and Sjoberg 2015, section 4.
Initialiser classify(ClassifyOptions options = {});

}  // namespace blockid
