// Several initialisers as one.
#pragma once

#include <blockid/estimators/candidate.hpp>
#include <blockid/init/classify.hpp>
#include <blockid/init/release.hpp>

#include <vector>

namespace blockid {

/// The candidates of all, best first. Stops at the first that was cancelled.
Initialiser combined(std::vector<Initialiser> initialisers);

struct FractionalOptions {
  ClassifyOptions classify = {};
  ReleaseOptions release = {};
};

/// The fractional approach with both its roads: classify() and release(), and beside them the Wiener and Hammerstein
/// special cases. For a chain with one filter only, where there is nothing to share out, exhaustive_split().
Initialiser fractional(FractionalOptions options = {});

}  // namespace blockid
