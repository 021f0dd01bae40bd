// From data to a model: candidates of an initialiser, the best of them refitted and ranked.
#pragma once

#include <blockid/estimators/candidate.hpp>
#include <blockid/estimators/refit.hpp>

#include <string>
#include <vector>

namespace blockid {

struct FitOptions {
  RefitOptions refit = {};
  /// Candidates that enter the first round.
  int best = 8;
  /// First round: iterations on the first samples of each record only; then the worse candidates are dropped.
  int first_round_iterations = 25;
  Index first_round_samples = 20000;
  /// Candidates that go on to the final round on all data.
  int finalists = 2;
  /// Final round: as often as this the knots are placed anew for the signal that now reaches the static block, after so
  /// many iterations each; then Levenberg-Marquardt to the end. 0 keeps the knots of the candidate.
  int knot_rounds = 3;
  int knot_round_iterations = 25;
  std::uint64_t seed = 1;
  int threads = 1;
  ProgressFunction progress = {};
};

/// One candidate with what became of it.
struct Trial {
  Candidate candidate;
  RefitReport refit;
  /// False for candidates that were ranked but not refitted.
  bool refitted = false;

  /// All that led to the parameters of `refit`: the initialiser's own and the refit's.
  int iterations() const { return candidate.iterations + refit.iterations; }
};

struct FitResult {
  /// The best model with standard deviations; normalised unless parameters were frozen.
  Model model;
  RefitReport report;
  /// Refitted trials first, best first, where a stable model precedes an unstable one of up to 2 % less RMSE; then the
  /// others in the initialiser's order.
  std::vector<Trial> trials = {};
  double wall_seconds = 0.0;

  /// All that led to `model`, the initialiser's own included.
  int iterations() const { return report.iterations + (trials.empty() ? 0 : trials.front().candidate.iterations); }
};

/// Candidates by `initialiser` for `chain`, the best refitted, all returned, best first.
///
/// A finalist with poles outside the unit circle is refitted from the reflected poles as well, and a stable model is
/// taken when it costs no more than 2 % of RMSE; at the end with_untouched_straightened() applies. Neither with frozen
/// parameters or bounds.
///
/// Throws Error for a caller's mistake (see refit()). A cancelled fit returns the best model so far with the status
/// cancelled; when not even a candidate was found, the blocks' initial parameters.
FitResult fit(const AnyBlock& chain, const DataSet& data, const Initialiser& initialiser,
              const FitOptions& options = {});

}  // namespace blockid
