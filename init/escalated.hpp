// Initialisers in turn, until one of them explains the data.
#pragma once

#include <blockid/estimators/candidate.hpp>

#include <vector>

namespace blockid {

struct EscalationOptions {
  /// Candidates of each stage that are refitted, and iterations of that.
  int refits = 2;
  int iterations = 60;
  /// Samples of each record that they are refitted on and tested on; 0 for all.
  Index samples = 5000;
  /// Residuals below this share of the output's deviation need no explanation: the structure's own limits show there
  /// before a wrong place of its roots does.
  double negligible = 0.005;
  /// Models handed on.
  Index keep = 4;
};

/// Stage after stage; the best candidates of each are refitted, and the search ends with the first stage after which
/// the residuals of the best model are like noise (noise_test.hpp) or negligible. Stage k draws from the seed + k.
///
/// For stages of rising cost: hard data get the costly ones, easy data do not pay for them. Residuals that no model of
/// the structure makes white are tried by all stages.
Initialiser escalated(std::vector<Initialiser> stages, EscalationOptions options = {});

}  // namespace blockid
