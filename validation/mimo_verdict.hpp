// Whether a record of several inputs and outputs contradicts |Delta| <= 1 and the noise bound.
#pragma once

#include <blockid/validation/mimo_programme.hpp>
#include <blockid/validation/verdict.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid {

struct MimoVerdictOptions {
  /// False when v was not zero before its first sample, but is not recorded.
  bool from_rest = true;
  /// Samples after which Delta has forgotten its input, see uncertainty_memory(); needed when not from rest.
  Eigen::Index memory = 0;
  /// A gain that, if it does not explain the record either, makes the noise bound the first suspect.
  double absurd_alpha = 8.0;
  /// Of the programme. Squared it has to be above the rounding of T_v'T_v, which is singular for one input.
  double relative_tau = 1e-6;
  ProgrammeOptions programme;
};

struct MimoVerdict {
  Verdict verdict = Verdict::undecided;
  std::string evidence;  ///< one or two sentences with the figures
  std::vector<VerdictNote> notes;
  double noise_bound = 0.0;     ///< gamma that the verdict was found with
  double noise_needed = 0.0;    ///< max |w - Delta v| of a Delta with |Delta| <= alpha_attained
  double alpha_attained = 0.0;  ///< of the output below; at most 1 when not invalidated
  double alpha_proven = 0.0;    ///< no |Delta| below this leaves the noise bound or less, by the certificate
  Eigen::MatrixXd output;       ///< (p, n) z, with T_z'T_z <= alpha_attained^2 (T_v'T_v + tau^2 I)
  MimoCertificate certificate;
  int iterations = 0;

  bool has(VerdictWarning warning) const;
};

/// Compares alpha*(gamma) of smallest_mimo_alpha() with 1, which stops as soon as the side is known.
///
/// Both sides are computed once more from the output and from the certificate alone, and what they do not confirm is
/// undecided. T_z'T_z <= T_v'T_v + tau^2 I says that a Delta of gain one leaves at most |w - z| + tau at any sample:
/// (v, tau e_1) has the output z under a contraction (Delta, Delta_1), and Delta_1 tau e_1 is no larger than tau. That
/// tau is part of noise_needed, and the programme runs with gamma - tau; what it proves holds for gamma. A noise bound
/// below 1e-7 max|w| or 2 tau |T_v|, zero included, is raised to that.
/// v (m, n) with n - N samples of the past, w (p, N) without gaps. Throws Error as smallest_mimo_alpha() does, when v
/// is zero, for a noise bound that is negative or not finite, for an absurd_alpha of 1 or less, and when not from rest
/// without a memory. "Invalidated" becomes undecided when the past is shorter than the memory.
MimoVerdict judge_mimo_uncertainty(const Eigen::MatrixXd& v, const Eigen::MatrixXd& w, double noise_bound,
                                   const MimoVerdictOptions& options = {});

}  // namespace blockid
