// Whether records contradict |Delta| <= 1 and the noise bound: a verdict of three values with its evidence.
#pragma once

#include <blockid/validation/uncertainty_programme.hpp>

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

namespace blockid {

enum class Verdict {
  not_invalidated,  ///< a Delta with |Delta| <= 1 is known that leaves no more than the noise bound
  invalidated,      ///< there is none: proven by multipliers
  undecided,        ///< neither is known
};

/// "not invalidated", "invalidated", "undecided".
std::string to_text(Verdict verdict);

enum class VerdictWarning {
  past_shorter_than_memory,  ///< what is not recorded of v may stand in w: nothing can be proven
  noise_bound_too_small,     ///< a much larger Delta does not explain the record either
  output_before_input,       ///< w moves before v: the disturbance, or signals that do not belong together
  noise_bound_raised,        ///< the given bound is below what the rounding of w allows
};

struct VerdictNote {
  VerdictWarning warning;
  std::string text;  ///< one sentence
};

struct VerdictOptions {
  /// Samples after which Delta has forgotten its input, see uncertainty_memory(); needed for windows not from rest.
  Eigen::Index memory = 0;
  /// An alpha that, if it does not explain the record either, makes the noise bound the first suspect.
  double absurd_alpha = 8.0;
  /// Finds gamma*(1) itself, not only on which side of the noise bound it is: the figures are then the best there are.
  bool to_the_end = false;
  ProgrammeOptions programme;
};

struct UncertaintyVerdict {
  Verdict verdict = Verdict::undecided;
  std::string evidence;  ///< one or two sentences with the figures
  std::vector<VerdictNote> notes;
  double noise_bound = 0.0;   ///< gamma that the verdict was found with
  double noise_needed = 0.0;  ///< max |w - A h| / shape of the h below: the Delta that it belongs to explains the rest
  double noise_proven = 0.0;  ///< no |Delta| <= 1 leaves less than this, by the certificate
  double alpha_proven = 0.0;  ///< no |Delta| below this leaves the noise bound or less, by the certificate
  Eigen::VectorXd h;          ///< (n,) with |T_h| <= 1
  DualCertificate certificate;
  int iterations = 0;  ///< of the programme with alpha = 1; 0 when a ridge regression already explains the record

  bool has(VerdictWarning warning) const;
};

/// Compares gamma*(1) = min over |T_h| <= 1 of max_t |w - A h|_t / shape_t with the noise bound; the programme stops as
/// soon as the side is known, and is not solved when a ridge regression explains the record. All windows are explained
/// by the same Delta.
///
/// Both sides are computed once more from h and from the certificate alone, and what they do not confirm is undecided.
/// "Invalidated" is said of the model, its uncertainty and the noise bound together; a window that is not from rest
/// and whose past is shorter than options.memory turns it to undecided. A noise bound below 1e-7 max|w|, zero included,
/// is raised to that.
/// Throws Error as uncertainty_programme() does, when v is zero, for a noise bound that is negative or not finite, for
/// an absurd_alpha of 1 or less, and for a window not from rest without a memory.
/// Source: Crowder and de Callafon, lemma 2, with the response to the past tied to the same Delta.
UncertaintyVerdict judge_uncertainty(std::span<const UncertaintyWindow> windows, double noise_bound,
                                     const VerdictOptions& options = {});
UncertaintyVerdict judge_uncertainty(const UncertaintyWindow& window, double noise_bound,
                                     const VerdictOptions& options = {});

}  // namespace blockid
