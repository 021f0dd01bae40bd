#include <blockid/validation/mimo_verdict.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/detail/verdict_words.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

using detail::kSmallestNoise;
using detail::words;
using Eigen::Index;
using Eigen::MatrixXd;

/// Rounding of T_z R^-1 with a least singular value of R of 1e-6, and of the sums that confirm a verdict.
constexpr double kGainRounding = 1e-9;

/// The sides of the comparison, from the output and the certificate alone.
void confirm(const MatrixXd& v, const MatrixXd& w, double tau, const MimoVerdictOptions& options, MimoSolution solution,
             MimoVerdict& result) {
  result.output = std::move(solution.output);
  result.certificate = std::move(solution.certificate);
  result.iterations = solution.iterations;
  result.alpha_attained = mimo_noise_free_bound(v, result.output, options.relative_tau);
  result.noise_needed = (w - result.output.rightCols(w.cols())).cwiseAbs().maxCoeff() + tau * result.alpha_attained;
  result.alpha_proven = certified_mimo_alpha(v, w, result.noise_bound, result.certificate, options.relative_tau);
  if (result.alpha_proven > 1.0 + kGainRounding) {
    result.verdict = Verdict::invalidated;
  } else if (result.alpha_attained <= 1.0 + kGainRounding &&
             result.noise_needed <= result.noise_bound + kGainRounding * w.cwiseAbs().maxCoeff()) {
    result.verdict = Verdict::not_invalidated;
  }
}

/// What makes an "invalidated" doubtful.
void doubt(const MatrixXd& v, const MatrixXd& w, const MimoVerdictOptions& options, MimoVerdict& result) {
  const MimoSolution more =
      smallest_mimo_alpha(v, w, result.noise_bound, options.programme, options.relative_tau, options.absurd_alpha);
  if (more.lower_bound > options.absurd_alpha) {
    result.notes.push_back(detail::noise_bound_too_small(options.absurd_alpha));
  }
  const Index past = v.cols() - w.cols();
  if (!options.from_rest && past < options.memory) {
    result.notes.push_back(detail::past_shorter_than_memory(past, options.memory));
    result.verdict = Verdict::undecided;
  }
}

std::string evidence_of(const MimoVerdict& result) {
  switch (result.verdict) {
    case Verdict::not_invalidated:
      return words("An uncertainty of gain one or less leaves at most ", result.noise_needed,
                   ", within the noise bound of ", result.noise_bound, ".");
    case Verdict::invalidated:
      return words("Within the noise bound of ", result.noise_bound, " every uncertainty has a gain of at least ",
                   result.alpha_proven, ", proven by a multiplier, evaluated once more.");
    case Verdict::undecided:
      break;
  }
  return words("Within the noise bound of ", result.noise_bound, " the least gain is between ", result.alpha_proven,
               " and ", result.alpha_attained, ", which is not settled against 1.");
}

}  // namespace

bool MimoVerdict::has(VerdictWarning warning) const {
  return std::any_of(notes.begin(), notes.end(), [&](const VerdictNote& n) { return n.warning == warning; });
}

MimoVerdict judge_mimo_uncertainty(const MatrixXd& v, const MatrixXd& w, double noise_bound,
                                   const MimoVerdictOptions& options) {
  detail::check_verdict_options(noise_bound, options.absurd_alpha, options.memory, options.from_rest);
  if (v.size() > 0 && v.isZero(0.0)) fail("verdict: the signal v is zero, nothing excites the loop");
  MimoVerdict result;
  const double tau = options.relative_tau * block_toeplitz_norm(v);
  const double least = std::max(kSmallestNoise * (w.size() > 0 ? w.cwiseAbs().maxCoeff() : 0.0), 2.0 * tau);
  result.noise_bound = std::max(noise_bound, least);
  if (noise_bound < least) {
    result.notes.push_back(
        {VerdictWarning::noise_bound_raised,
         words("The noise bound of ", noise_bound, " was raised to ", least, ", which leaves room for rounding.")});
  }
  confirm(v, w, tau, options,
          smallest_mimo_alpha(v, w, result.noise_bound - tau, options.programme, options.relative_tau, 1.0), result);
  if (result.verdict == Verdict::invalidated) doubt(v, w, options, result);
  result.evidence = evidence_of(result);
  return result;
}

}  // namespace blockid
