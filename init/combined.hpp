// Several initialisers as one.
#pragma once

#include <blockid/estimators/candidate.hpp>
#include <blockid/init/classify.hpp>
#include <blockid/init/escalated.hpp>
#include <blockid/init/random_starts.hpp>
#include <blockid/init/release.hpp>
#include <blockid/init/root_search.hpp>
#include <blockid/init/split.hpp>

#include <vector>

namespace blockid {

/// The candidates of all, best first, each model once. Stops at the first that was cancelled.
Initialiser combined(std::vector<Initialiser> initialisers);

/// The candidates for the chain with its static block in plain form (without oversampling, and a spline in place of one
/// that is not linear in its parameters), with the chain's own static block put back.
Initialiser with_plain_static_block(Initialiser initialiser);

struct FractionalOptions {
  ClassifyOptions classify = {};
  ReleaseOptions release = {};
  /// Few enough partitions not to grow with the orders.
  SplitOptions split = {.max_partitions = 64, .ranking_samples = 5000, .keep = 4};
  /// Around what these find.
  RootSearchOptions search = {};
  /// Where that leaves more than noise: random starts and the search around them, so many times.
  int random_stages = 3;
  RandomStartsOptions random = {.starts = 64, .ranking_samples = 1000};
  RootSearchOptions random_search = {.starts = 64, .rounds = 12, .width = 6, .samples = 1000};
  EscalationOptions escalation = {};
};

/// The fractional approach with both its roads, release() and classify(), and beside them a few splits and the Wiener
/// and Hammerstein special cases, which cost little and find what the roads miss. For a chain with one filter only,
/// where there is nothing to share out, exhaustive_split().
Initialiser fractional(FractionalOptions options = {});

}  // namespace blockid
