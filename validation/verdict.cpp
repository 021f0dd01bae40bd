#include <blockid/validation/verdict.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/dense_product.hpp>
#include <blockid/validation/detail/verdict_words.hpp>
#include <blockid/validation/hankel_products.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace blockid {
namespace {

using detail::kSmallestNoise;
using detail::words;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rounding of the sums that confirm a verdict: some thousand products of relative error 1e-16, with room.
constexpr double kSumRounding = 1e-11;
/// An input below this part of its largest sample is no input.
constexpr double kSilence = 1e-12;
/// Negative powers of ten of the ridge, in units of the trace.
constexpr int kFirstWitnessRidge = 3;
constexpr int kLastWitnessRidge = 12;

void check_options(std::span<const UncertaintyWindow> windows, double noise_bound, const VerdictOptions& options) {
  const bool all_from_rest =
      std::all_of(windows.begin(), windows.end(), [](const UncertaintyWindow& w) { return w.from_rest; });
  detail::check_verdict_options(noise_bound, options.absurd_alpha, options.memory, all_from_rest);
}

/// The shortest past among the windows whose v goes on before it; -1 when there is none.
Index shortest_past(std::span<const UncertaintyWindow> windows) {
  Index shortest = -1;
  for (const UncertaintyWindow& window : windows) {
    const Index past = window.v.size() - window.w.size();
    if (!window.from_rest && (shortest < 0 || past < shortest)) shortest = past;
  }
  return shortest;
}

/// The first row whose inputs are all silent and whose output is more than noise; -1 when there is none.
Index output_before_input(const UncertaintyProgramme& programme, double gamma) {
  const double silence = kSilence * programme.a.cwiseAbs().maxCoeff();
  for (Index t = 0; t < programme.w.size(); ++t) {
    if (std::abs(programme.w[t]) > gamma && programme.a.row(t).cwiseAbs().maxCoeff() <= silence) return t;
  }
  return -1;
}

/// |T_h| <= alpha up to rounding.
bool has_gain(const VectorXd& h, double alpha) {
  const MatrixXd k = hankel(h);
  const MatrixXd bound = alpha * (1.0 + kSumRounding) * MatrixXd::Identity(h.size(), h.size());
  return CholeskyFactor(bound + k).positive() && CholeskyFactor(bound - k).positive();
}

/// An h of a ridge regression that keeps |T_h| <= alpha and the noise bound, for a fraction of the programme's time;
/// empty when there is none among those tried, which says nothing.
std::optional<VectorXd> ridge_witness(const UncertaintyProgramme& programme, double alpha, double gamma) {
  const MatrixXd turned = programme.a.transpose();
  const MatrixXd gram = weighted_gram(turned, VectorXd::Ones(turned.rows()));
  for (int decade = kFirstWitnessRidge; decade <= kLastWitnessRidge; ++decade) {
    MatrixXd damped = gram;
    damped.diagonal().array() += std::pow(10.0, -decade) * gram.trace();
    const VectorXd h = turned * CholeskyFactor(std::move(damped)).solve(programme.w);
    if (!((programme.w - programme.a * h).cwiseAbs().maxCoeff() <= gamma)) continue;
    // Less damping makes h longer.
    if (h.norm() <= alpha && has_gain(h, alpha)) return h;
    return std::nullopt;
  }
  return std::nullopt;
}

/// The programme's answer when h is one that explains the record.
ProgrammeSolution explained_by(const UncertaintyProgramme& programme, VectorXd h) {
  const Index n = h.size();
  ProgrammeSolution solution;
  solution.status = ProgrammeStatus::target_reached;
  solution.h = std::move(h);
  solution.certificate = {MatrixXd::Identity(n, n), MatrixXd::Identity(n, n), VectorXd::Zero(programme.w.size())};
  return solution;
}

ProgrammeSolution decide(const UncertaintyProgramme& programme, double gamma, const VerdictOptions& options) {
  if (options.to_the_end) return smallest_gamma(programme, 1.0, options.programme);
  if (std::optional<VectorXd> h = ridge_witness(programme, 1.0, gamma)) return explained_by(programme, std::move(*h));
  return smallest_gamma(programme, 1.0, options.programme, gamma);
}

/// Whether no |Delta| <= alpha leaves the noise bound or less; false when that is not proven.
bool is_out_of_reach(const UncertaintyProgramme& programme, double alpha, double gamma,
                     const ProgrammeOptions& options) {
  return !ridge_witness(programme, alpha, gamma) &&
         smallest_gamma(programme, alpha, options, gamma).lower_bound > gamma;
}

/// The sides of the comparison, from h and the certificate alone.
void confirm(const UncertaintyProgramme& programme, const ProgrammeSolution& solution, UncertaintyVerdict& result) {
  const double rounding = kSumRounding * programme.w.cwiseAbs().maxCoeff();
  result.h = solution.h;
  result.certificate = solution.certificate;
  result.iterations = solution.iterations;
  result.noise_needed = (programme.w - programme.a * result.h).cwiseAbs().maxCoeff();
  result.noise_proven = certified_gamma(programme, 1.0, result.certificate);
  result.alpha_proven = certified_alpha(programme, result.noise_bound, result.certificate);
  if (result.noise_proven > result.noise_bound + rounding) {
    result.verdict = Verdict::invalidated;
  } else if (result.noise_needed <= result.noise_bound + rounding && has_gain(result.h, 1.0)) {
    result.verdict = Verdict::not_invalidated;
  }
}

void note(UncertaintyVerdict& result, VerdictWarning warning, std::string text) {
  result.notes.push_back({warning, std::move(text)});
}

/// What makes an "invalidated" doubtful.
void doubt(const UncertaintyProgramme& programme, std::span<const UncertaintyWindow> windows,
           const VerdictOptions& options, UncertaintyVerdict& result) {
  if (const Index t = output_before_input(programme, result.noise_bound); t >= 0) {
    note(result, VerdictWarning::output_before_input,
         words("Sample ", t, " of w is ", programme.w[t],
               " before v has moved: no uncertainty of any size explains that, the noise bound or the signals are "
               "wrong."));
  } else if (is_out_of_reach(programme, options.absurd_alpha, result.noise_bound, options.programme)) {
    result.notes.push_back(detail::noise_bound_too_small(options.absurd_alpha));
  }
  const Index past = shortest_past(windows);
  if (past >= 0 && past < options.memory) {
    result.notes.push_back(detail::past_shorter_than_memory(past, options.memory));
    result.verdict = Verdict::undecided;
  }
}

std::string evidence_of(const UncertaintyVerdict& result) {
  switch (result.verdict) {
    case Verdict::not_invalidated:
      return words("An uncertainty of gain one or less leaves at most ", result.noise_needed,
                   ", within the noise bound of ", result.noise_bound, ".");
    case Verdict::invalidated:
      return words("Every uncertainty of gain one or less leaves at least ", result.noise_proven,
                   " somewhere, more than the noise bound of ", result.noise_bound, "; within it the gain is at least ",
                   result.alpha_proven, ". Both are proven by multipliers, evaluated once more.");
    case Verdict::undecided:
      break;
  }
  return words("The least noise is between ", result.noise_proven, " and ", result.noise_needed,
               ", and the noise bound of ", result.noise_bound, " is not settled by that.");
}

}  // namespace

std::string to_text(Verdict verdict) {
  switch (verdict) {
    case Verdict::not_invalidated:
      return "not invalidated";
    case Verdict::invalidated:
      return "invalidated";
    case Verdict::undecided:
      break;
  }
  return "undecided";
}

bool UncertaintyVerdict::has(VerdictWarning warning) const {
  return std::any_of(notes.begin(), notes.end(), [&](const VerdictNote& n) { return n.warning == warning; });
}

UncertaintyVerdict judge_uncertainty(std::span<const UncertaintyWindow> windows, double noise_bound,
                                     const VerdictOptions& options) {
  const UncertaintyProgramme programme = uncertainty_programme(windows);
  check_options(windows, noise_bound, options);
  if (programme.a.isZero(0.0)) fail("verdict: the signal v is zero, nothing excites the loop");
  UncertaintyVerdict result;
  const double least = kSmallestNoise * programme.w.cwiseAbs().maxCoeff();
  result.noise_bound = std::max(noise_bound, least);
  if (noise_bound < least) {
    note(result, VerdictWarning::noise_bound_raised,
         words("The noise bound of ", noise_bound, " was raised to ", least, ", which leaves room for rounding."));
  }
  confirm(programme, decide(programme, result.noise_bound, options), result);
  if (result.verdict == Verdict::invalidated) doubt(programme, windows, options, result);
  result.evidence = evidence_of(result);
  return result;
}

UncertaintyVerdict judge_uncertainty(const UncertaintyWindow& window, double noise_bound,
                                     const VerdictOptions& options) {
  return judge_uncertainty(std::span<const UncertaintyWindow>(&window, 1), noise_bound, options);
}

}  // namespace blockid
