#include <blockid/cli/crowder_callafon.hpp>

#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/transfer_function.hpp>
#include <blockid/problems/crowder_callafon.hpp>
#include <blockid/validation/noise_free_bound.hpp>
#include <blockid/validation/uncertainty_programme.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using problems::CrowderCallafon;

constexpr Index kSamples = 501;
constexpr Index kWindow = 200;
constexpr Index kStarts = 300;
constexpr double kTau = 1e-8;
/// As a share of max|w|: the noise bound that stands for none.
constexpr double kNoNoise = 1e-6;
/// Reference values with this tau carry 1e-6; those of the convex programme 2e-5, its tolerance twice.
constexpr double kBoundTolerance = 1e-6;
constexpr double kProgrammeTolerance = 2e-5;

DiscreteTransferFunction system_of(const problems::Polynomials& g) { return {g.numerator, g.denominator}; }

struct Loop {
  CrowderCallafon source = {};
  DiscreteTransferFunction plant = system_of(source.plant());
  DiscreteTransferFunction model = system_of(source.model());
  DiscreteTransferFunction controller = system_of(source.controller());

  UncertainLoop with_weight(double k) const {
    return {coprime_factors(model, source.pole()), coprime_factors(controller, source.pole()),
            system_of(source.weight(k))};
  }
  UncertainLoop as_printed() const {
    return {trivial_factors(model), trivial_factors(controller), system_of(source.weight(source.kCoversPrinted))};
  }
};

/// ct = (1 - q)^2 + Ts q (c1 + c0 q): the true loop's poles.
VectorXd true_characteristic(const Loop& loop) {
  const double ts = loop.source.sample_time_s;
  const VectorXd& c = loop.controller.numerator;
  return Vector3d(1.0, -2.0 + ts * c[0], 1.0 + ts * c[1]);
}

/// Delta V = Dc^-1 (1 + P C)^-1 (P - Phat) Dhat = (Ts q (1 - p q) - b q (1 - q)) / ct.
DiscreteTransferFunction uncertainty(const Loop& loop) {
  const double ts = loop.source.sample_time_s;
  const double p = loop.source.pole();
  const double b = loop.model.numerator[1];
  return {Vector3d(0.0, ts - b, b - ts * p), true_characteristic(loop)};
}

/// For Nc = C, Dc = 1 it is (1 + P C)^-1 (P - Phat): the same times (1 - q) / (1 - p q).
double trivial_uncertainty(const Loop& loop, double omega) {
  const DiscreteTransferFunction ratio{Eigen::Vector2d(1.0, -1.0), Eigen::Vector2d(1.0, -loop.source.pole())};
  return magnitude(uncertainty(loop), omega) * magnitude(ratio, omega);
}

/// Equation (9) as printed, with the model in the sensitivity: (1 + Phat C)^-1 (P - Phat).
double printed_uncertainty(const Loop& loop, double omega) {
  const std::complex<double> model = response(loop.model, omega);
  return std::abs((response(loop.plant, omega) - model) / (1.0 + model * response(loop.controller, omega)));
}

VectorXd logarithmic_grid() {
  constexpr Index kPoints = 400;
  return VectorXd::LinSpaced(kPoints, std::log(1e-3), std::log(std::numbers::pi)).array().exp();
}

/// max over omega of f(omega) on a grid of 1e5 frequencies: a smooth peak is missed by less than 1e-8 of it.
template <class F>
double largest(F&& f) {
  constexpr int kGrid = 100000;
  double result = 0.0;
  for (int k = 1; k <= kGrid; ++k) result = std::max(result, f(std::numbers::pi * k / kGrid));
  return result;
}

UncertaintySignals signals_of(const Loop& loop, const UncertainLoop& uncertain, std::uint64_t seed) {
  const VectorXd r = problems::crowder_reference(kSamples, static_cast<std::uint32_t>(seed));
  const ClosedLoopRecord record = simulate_closed_loop(loop.plant, loop.controller, r, VectorXd::Zero(kSamples));
  return uncertainty_signals(uncertain, record.u, record.y);
}

/// Our value beside a reference value, which counts for the reference signal only.
ReproducedFigure beside(const std::string& quantity, double reproduced, double reference, double tolerance,
                        std::uint64_t seed) {
  const bool comparable = seed == 1;
  return {quantity, std::nullopt, reproduced,
          comparable ? number(reference, 9) + " within " + number(100.0 * tolerance, 2) + " %" : "any (another seed)",
          !comparable || std::abs(reproduced / reference - 1.0) <= tolerance};
}

ReproducedFigure statement(const std::string& quantity, double reproduced, const std::string& text, bool holds) {
  return {quantity, std::nullopt, reproduced, text, holds};
}

// ---------------------------------------------------------------------------------------------------------------
// Figure 2

void add_figure_2(Reproduction& result, const Loop& loop) {
  const DiscreteTransferFunction delta = uncertainty(loop);
  const DiscreteTransferFunction weight = system_of(loop.source.weight(CrowderCallafon::kCovers));
  const DiscreteTransferFunction printed_weight = system_of(loop.source.weight(CrowderCallafon::kCoversPrinted));
  const double norm = largest([&](double w) { return magnitude(delta, w) / magnitude(weight, w); });
  const double of_print =
      largest([&](double w) { return printed_uncertainty(loop, w) / magnitude(printed_weight, w); });
  const double of_true = largest([&](double w) { return trivial_uncertainty(loop, w) / magnitude(printed_weight, w); });
  const DiscreteTransferFunction tight_weight = system_of(loop.source.weight(CrowderCallafon::kTight));
  const double tight = largest([&](double w) { return magnitude(delta, w) / magnitude(tight_weight, w); });
  // The grid's 1e-8, and references of eight digits.
  constexpr double kNorm = 1e-7;
  result.figures.push_back(statement("figure 2: |Delta| under V, at most 1", norm, "0.95198548 within 1e-5 %",
                                     norm <= 1.0 && std::abs(norm / 0.95198548 - 1.0) <= kNorm));
  result.figures.push_back(statement("|Delta| under a weight that is too small", tight, "1.11064973 within 1e-5 %",
                                     std::abs(tight / 1.11064973 - 1.0) <= kNorm));
  result.figures.push_back(statement("|Delta| by (9) as printed, under a V for it", of_print, "0.95213 within 0.001 %",
                                     std::abs(of_print / 0.95213 - 1.0) <= 1e-5));
  result.figures.push_back(statement("the true |Delta| under that V", of_true, "1.12009867 within 1e-5 %",
                                     std::abs(of_true / 1.12009867 - 1.0) <= kNorm));

  const VectorXd omega = logarithmic_grid();
  const VectorXd multiplicative = omega.unaryExpr([&](double w) {
    return std::abs((response(loop.plant, w) - response(loop.model, w)) / response(loop.model, w));
  });
  const VectorXd ours = omega.unaryExpr([&](double w) { return magnitude(delta, w); });
  const VectorXd over = omega.unaryExpr([&](double w) { return magnitude(weight, w); });
  const VectorXd additive =
      omega.unaryExpr([&](double w) { return std::abs(response(loop.plant, w) - response(loop.model, w)); });
  Picture picture{
      .stem = "figure2", .title = "Coprime factor uncertainty and the weight over it", .script = {}, .width = 760};
  picture.script =
      kFigureStyles + data_block("d", {omega / loop.source.sample_time_s, ours, over, additive, multiplicative}) +
      "set logscale xy\nset yrange [1e-3:1e3]\nset xlabel 'frequency [rad/s]'\nset ylabel 'magnitude'\n"
      "plot $d using 1:2 with lines ls 1 title 'coprime factors', $d using 1:3 with lines ls 4 lw 2 title "
      "'weight V', $d using 1:4 with lines ls 3 title 'additive, unbounded', $d using 1:5 with lines ls 2 title "
      "'multiplicative, unbounded'\n";
  result.pictures.push_back(picture);
}

// ---------------------------------------------------------------------------------------------------------------
// Corollary 1 from rest

void add_bounds_from_rest(Reproduction& result, const Loop& loop, std::uint64_t seed) {
  const auto bound = [&](const UncertainLoop& uncertain, Index count) {
    const UncertaintySignals s = signals_of(loop, uncertain, seed);
    return noise_free_bound(s.v.head(count), s.w.head(count), kTau);
  };
  const UncertainLoop covers = loop.with_weight(CrowderCallafon::kCovers);
  const UncertainLoop tight = loop.with_weight(CrowderCallafon::kTight);
  result.figures.push_back(
      beside("corollary 1 from rest, N = 200", bound(covers, kWindow), 0.92287205, kBoundTolerance, seed));
  result.figures.push_back(beside("the same, N = 499", bound(covers, 499), 0.94618617, kBoundTolerance, seed));
  result.figures.push_back(
      beside("weight too small, N = 200", bound(tight, kWindow), 1.0766841, kBoundTolerance, seed));
  result.figures.push_back(
      beside("V for (9) as printed, N = 200", bound(loop.as_printed(), kWindow), 1.0772946, kBoundTolerance, seed));
}

// ---------------------------------------------------------------------------------------------------------------
// Figure 3

/// alpha(n) without the response to the past, n = 1..300.
VectorXd without_past(const UncertaintySignals& s) {
  constexpr double kSmallTau = 1e-10;
  VectorXd alpha(kStarts);
  for (Index n = 0; n < kStarts; ++n) {
    alpha[n] = noise_free_bound(s.v.segment(n, kWindow), s.w.segment(n, kWindow), kSmallTau);
  }
  return alpha;
}

struct WithPast {
  Index start;
  double reference;
};

/// alpha(n) with the past tied to the same Delta, by the convex programme.
const std::vector<WithPast>& with_past() {
  static const std::vector<WithPast> kStartsShown = {
      {1, 0.922840},   {2, 0.922865},   {5, 0.922896},   {10, 0.924241},  {20, 0.927727},  {30, 0.922116},
      {50, 0.925476},  {70, 0.925785},  {100, 0.903913}, {130, 0.860697}, {150, 0.822721}, {170, 0.777019},
      {200, 0.791908}, {230, 0.826803}, {250, 0.801819}, {280, 0.830732}, {300, 0.750907}};
  return kStartsShown;
}

void add_figure_3(Reproduction& result, const Loop& loop, std::uint64_t seed) {
  const UncertaintySignals s = signals_of(loop, loop.with_weight(CrowderCallafon::kCovers), seed);
  const VectorXd plain = without_past(s);
  const double least = plain.tail(kStarts - 1).minCoeff();
  result.figures.push_back(statement("figure 3 by corollary 1 alone: smallest alpha(n), n = 2..300", least,
                                     "above 1: all windows but the first invalidate", least > 1.0));
  const double noise = kNoNoise * s.w.cwiseAbs().maxCoeff();
  std::vector<double> starts;
  std::vector<double> alphas;
  for (const WithPast& one : with_past()) {
    ProgrammeOptions options;
    options.tolerance = 1e-5;
    const UncertaintyWindow window = cut_window(s.v, s.w, one.start - 1, kWindow, one.start - 1);
    const double alpha = smallest_alpha(uncertainty_programme(window), noise, options).value;
    starts.push_back(static_cast<double>(one.start));
    alphas.push_back(alpha);
    result.figures.push_back(beside("figure 3 with the past, n = " + std::to_string(one.start), alpha, one.reference,
                                    kProgrammeTolerance / one.reference, seed));
  }
  const double largest_alpha = *std::max_element(alphas.begin(), alphas.end());
  result.figures.push_back(statement("figure 3: largest alpha(n) with the past", largest_alpha,
                                     "at most 1: not invalidated from any start", largest_alpha <= 1.0));

  Picture picture{.stem = "figure3",
                  .title = "Validation for different starts of the data, with and without their past",
                  .script = {},
                  .width = 760};
  const auto as_vector = [](const std::vector<double>& values) {
    return VectorXd(Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size())));
  };
  picture.script = kFigureStyles +
                   data_block("plain", {VectorXd::LinSpaced(kStarts, 1.0, static_cast<double>(kStarts)), plain}) +
                   data_block("past", {as_vector(starts), as_vector(alphas)}) +
                   "set logscale y\nset yrange [0.5:1e10]\nset format y '10^{%L}'\nset xlabel 'first sample n'\nset "
                   "ylabel 'least uncertainty'\nplot $plain using 1:2 with lines ls 3 title 'without the past', $past "
                   "using 1:2 with linespoints ls 2 pt 7 title 'with the past', 1 with lines ls 4 title 'invalidated "
                   "above'\n";
  result.pictures.push_back(picture);
}

/// gamma*(1) / max|w| of windows without their past: what an uncertainty of gain one must leave at least.
void add_least_noise(Reproduction& result, const Loop& loop, std::uint64_t seed) {
  struct Case {
    Index start;
    double reference;
    const char* noted;
  };
  // An independent prototype has the last with all its digits and the others as figures of two digits.
  const std::vector<Case> cases = {
      {10, 0.039963, "0.054"}, {100, 0.108893, "0.16"}, {200, 0.368631, "0.39"}, {300, 0.05993976, "0.0599"}};
  const UncertaintySignals s = signals_of(loop, loop.with_weight(CrowderCallafon::kCovers), seed);
  const double size = s.w.cwiseAbs().maxCoeff();
  for (const Case& one : cases) {
    const UncertaintyProgramme programme = uncertainty_programme(cut_window(s.v, s.w, one.start - 1, kWindow, 0));
    ReproducedFigure figure =
        beside("least noise without the past, in units of max|w|, n = " + std::to_string(one.start),
               smallest_gamma(programme, 1.0).value / size, one.reference, kProgrammeTolerance, seed);
    if (seed == 1) figure.tolerance += "; the prototype noted " + std::string(one.noted);
    result.figures.push_back(figure);
  }
}

// ---------------------------------------------------------------------------------------------------------------

std::vector<std::string> crowder_callafon_notes() {
  return {
      "The paper gives neither eps, gains, sample time, weight nor reference: eps = 0.5, Kp = Ki = 1, Ts = 0.1 s and V "
      "are ours; the printed figures are pictures without numbers, so statements are compared, and values with an "
      "independent computation.",
      "(8), (9): the sensitivity must hold the true plant, Dc^-1 (1 + P C)^-1 (P - Phat) Dhat; the print has the "
      "model. w = Delta v fails by half of max|w| with it.",
      "(10) follows from (9) and is up to 38 % too small: a V that just covers it has |Delta| = 1.12, and a correct "
      "test invalidates the paper's own example.",
      "Section V: a PI controller is not stable, so Nc = C, Dc = 1 are no factors over stable functions; D = 1 - C "
      "Delta is unstable unless Delta vanishes at frequency zero. Dc = s / (s + a), Nc = (Kp s + Ki) / (s + a) "
      "repair it.",
      "Theorem 2, corollary 2, lemma 2, corollary 3: rho is free, and rho = w gives alpha = 0. It has to come from the "
      "same Delta as the window.",
      "Corollary 2: the bracket is (T_w - T_rho)(T_v' T_v)^-1/2, not T_w - T_rho (T_v' T_v)^-1/2.",
      "Corollaries 2 and 3: the matrix inequality bounds the square of the norm; alpha is its root.",
      "Corollary 1: v_1 other than zero gives full rank and nothing else; T_v has condition numbers of 1e10 to 1e19 "
      "here, so T_v' T_v cannot be inverted in double precision. A QR factor with a small tau is sound.",
      "v_1 is zero whenever V is strictly proper, whatever u_1: V must be biproper.",
      "Figure 3 does not come from corollary 1: without the past every window after the first invalidates.",
      "(21) counts the direct term as h_0, (16) as h_1.",
      "Section V: the window n..n + N has N + 1 samples; the numerator of (2) is P - Phat; |Delta| < 1 and <= 1 are "
      "mixed, (19) is for <= 1.",
      "Section IV: the state of loop and filters at the start enters w like noise; filters must run from the start of "
      "the experiment and not from that of a window.",
      "The test is one of the sampled loop: V, model and controller have to be sampled alike, and what happens between "
      "samples is not tested."};
}

}  // namespace

Reproduction crowder_callafon(std::uint64_t seed) {
  const Loop loop;
  Reproduction result;
  add_figure_2(result, loop);
  add_bounds_from_rest(result, loop, seed);
  add_figure_3(result, loop, seed);
  add_least_noise(result, loop, seed);
  result.notes = crowder_callafon_notes();
  return result;
}

}  // namespace blockid::cli
