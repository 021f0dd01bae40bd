// Local search over the places of the roots: what refits alone cannot cross.
#pragma once

#include <blockid/estimators/candidate.hpp>

namespace blockid {

struct RootSearchOptions {
  /// Candidates of the initialiser that are refitted before the search begins.
  int starts = 8;
  /// Models whose neighbours are tried, at most; the search ends sooner when the best `width` have been tried.
  int rounds = 8;
  int width = 2;
  /// Levenberg-Marquardt iterations of all neighbours, and of those that are best after them.
  int first_iterations = 4;
  int iterations = 25;
  int survivors = 4;
  /// Samples of each record that are used; 0 for all.
  Index samples = 5000;
  /// Models handed on.
  Index keep = 3;
};

/// Best-first search from the candidates of another initialiser, each refitted: the neighbours (root_moves.hpp) of the
/// best model not yet searched are refitted in a race and join the models found, until the best few have no neighbour
/// that is better. The static block is eliminated throughout, so that a move need not wait for it.
///
/// The cost of a round grows with the product of the filters' orders. For chains with two filters and a static block
/// that is linear in its parameters; others get the candidates as they are.
Initialiser root_search(Initialiser initialiser, RootSearchOptions options = {});

}  // namespace blockid
