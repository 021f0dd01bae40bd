// Filters of random stable poles and zeros as starts: the baseline that every initialiser must beat.
#pragma once

#include <blockid/estimators/candidate.hpp>

namespace blockid {

struct RandomStartsOptions {
  int starts = 16;
  /// Poles and zeros are drawn uniformly from the disc of this radius, as real ones or pairs with equal chance.
  double radius = 0.95;
  /// Samples of each record that rank the starts; 0 for all.
  Index ranking_samples = 20000;
};

/// G_W and G_H of random poles and zeros drawn from InitialiserOptions::seed, the static block by least squares.
/// Source of the idea: Wills and Ninness 2012.
Initialiser random_starts(RandomStartsOptions options = {});

}  // namespace blockid
