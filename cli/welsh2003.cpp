#include <blockid/cli/welsh2003.hpp>

#include <blockid/cli/report/decibels.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/estimators/frequency_fit.hpp>
#include <blockid/problems/welsh_goodwin.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;
using problems::ResonantProblem;

/// What the four other methods have in common: condition numbers and errors that rounding makes.
constexpr double kHopeless = 1e30;
constexpr double kBadDecibels = 3.0;
/// What ours is held to.
constexpr double kMeanSquare = 1e-24;
constexpr double kLargest = 1e-11;
constexpr double kPole = 1e-12;
/// The set-up was chosen to come near the printed condition number.
constexpr double kConditionShare = 0.1;

FrequencyFitOptions article_options() {
  FrequencyFitOptions options;
  options.method = FrequencyMethod::least_squares;
  options.weighting = FrequencyWeighting::none;
  options.relocate = false;
  return options;
}

/// Householder QR without a look at rank, as in equation (27).
FrequencyFitOptions without_truncation() {
  FrequencyFitOptions options = article_options();
  options.rank_tolerance = 0.0;
  return options;
}

/// Differences of the magnitudes in dB at the tones: mean of squares and largest.
struct Errors {
  double mean_square = 0.0;
  double largest = 0.0;
};

Errors errors_of(const FrequencyFit& fit, const ResonantProblem& problem) {
  const VectorXcd g = response_at(fit.model, problem.data.omega_rad_s);
  const Eigen::ArrayXd db = 20.0 * (g.array() / problem.data.response.array()).abs().log10();
  return {db.square().mean(), db.abs().maxCoeff()};
}

/// Largest relative distance of a true pole from the nearest of the model.
double pole_error(const FrequencyFit& fit, const ResonantProblem& problem) {
  const VectorXcd found = poles(fit.model);
  double worst = 0.0;
  for (const std::complex<double>& pole : problems::poles(problem.modes)) {
    worst = std::max(worst, (found.array() - pole).abs().minCoeff() / std::abs(pole));
  }
  return worst;
}

ReproducedFigure at_most(const std::string& quantity, std::optional<double> published, double reproduced, double most,
                         const std::string& unit = "") {
  return {quantity, published, reproduced, "at most " + number(most) + unit, reproduced <= most};
}

ReproducedFigure at_least(const std::string& quantity, std::optional<double> published, double reproduced, double least,
                          const std::string& unit = "") {
  return {quantity, published, reproduced, "at least " + number(least) + unit, reproduced >= least};
}

ReproducedFigure near(const std::string& quantity, std::optional<double> published, double reproduced, double expected,
                      double share) {
  return {quantity, published, reproduced, number(expected, 9) + " within " + number(100.0 * share, 3) + " %",
          std::abs(reproduced / expected - 1.0) <= share};
}

// ---------------------------------------------------------------------------------------------------------- Table 1

/// A line of table 1.
struct BasisLine {
  const char* name;
  double condition;
  double mean_square;
  double largest;
};

constexpr BasisLine kPowers = {"NLS", 5.8950e175, 2729.2, 105.2499};
constexpr BasisLine kScaledPowers = {"NLSFS", 1.0642e44, 848.2818, 68.5336};
constexpr BasisLine kChebyshev = {"TP", 6.0597e22, 898.3536, 68.2660};
constexpr BasisLine kLaguerre = {"LBF", 8.0111e17, 69.5152, 37.9211};
constexpr BasisLine kLocalising = {"FLBF", 4059.0, 9.5976e-23, 5.3152e-11};

void add_failure(const BasisLine& line, const FrequencyFit& fit, const ResonantProblem& problem,
                 std::vector<ReproducedFigure>& figures) {
  const std::string name = line.name;
  const Errors errors = errors_of(fit, problem);
  const double mean = kBadDecibels * kBadDecibels / static_cast<double>(problem.data.response.size());
  figures.push_back(at_least(name + ": condition", line.condition, fit.condition, kHopeless, " (rounding)"));
  figures.push_back(at_least(name + ": L2 [dB^2]", line.mean_square, errors.mean_square, mean, " (rounding)"));
  figures.push_back(at_least(name + ": Linf [dB]", line.largest, errors.largest, kBadDecibels, " (rounding)"));
}

/// Poles over the band, of which the one with the least mean square error counts.
FrequencyFit best_laguerre(const ResonantProblem& problem, const VectorXd& candidates) {
  FrequencyFit best;
  double least = 0.0;
  for (const double pole : candidates) {
    FrequencyFit fit = fit_frequency_response(problem.data, laguerre_basis(18, 17, pole), without_truncation());
    const double error = errors_of(fit, problem).mean_square;
    if (best.model.numerator.size() > 0 && !(error < least)) continue;
    least = error;
    best = std::move(fit);
  }
  return best;
}

RationalBasis localising(const ResonantProblem& problem) { return localising_basis(problem.break_points_rad_s, 17); }

void add_localising(const FrequencyFit& fit, const ResonantProblem& problem, std::vector<ReproducedFigure>& figures) {
  const Errors errors = errors_of(fit, problem);
  figures.push_back({"FLBF: condition", kLocalising.condition, fit.condition,
                     "within " + number(100.0 * kConditionShare) + " % of the print",
                     std::abs(fit.condition / kLocalising.condition - 1.0) <= kConditionShare});
  figures.push_back(near("FLBF: condition, digits of this set-up", std::nullopt, fit.condition, 3788.349282, 1e-6));
  figures.push_back(
      near("FLBF: condition, columns of unit norm", std::nullopt, fit.condition_normalised, 998.399788, 1e-6));
  figures.push_back(at_most("FLBF: L2 [dB^2]", kLocalising.mean_square, errors.mean_square, kMeanSquare));
  figures.push_back(at_most("FLBF: Linf [dB]", kLocalising.largest, errors.largest, kLargest));
  figures.push_back(at_most("FLBF: relative error of the poles", std::nullopt, pole_error(fit, problem), kPole));
  const double complex_condition =
      squared_condition(equation_error_matrix(spectra_of(problem.data), localising(problem)));
  figures.push_back(near("FLBF: condition, complex least squares", std::nullopt, complex_condition, 5.58008e9, 1e-5));
}

/// "Particularly easy to tune": break points that leave the band on one side by three decades.
void add_tuning(const ResonantProblem& problem, std::vector<ReproducedFigure>& figures) {
  const RationalBasis misplaced = localising_basis(break_points(1e-4, 1e8, 18), 17);
  const FrequencyFit kept = fit_frequency_response(problem.data, misplaced, without_truncation());
  figures.push_back(at_least("FLBF, break points 1e-4 to 1e8: Linf [dB]", std::nullopt,
                             errors_of(kept, problem).largest, kBadDecibels));
  FrequencyFitOptions options = article_options();
  options.relocate = true;
  const FrequencyFit moved = fit_frequency_response(problem.data, misplaced, options);
  figures.push_back(
      at_most("the same, relocated: Linf [dB]", std::nullopt, errors_of(moved, problem).largest, kLargest));
}

/// A panel of figures 1 and 2.
struct Panel {
  const char* title;
  const FrequencyFit& fit;
};

/// Close around the resonances, evenly elsewhere.
VectorXd grid_of(const ResonantProblem& problem) {
  constexpr Index kEven = 500;
  const VectorXd even = break_points(problem.data.omega_rad_s[0], problem.data.omega_rad_s.tail(1)[0], kEven);
  std::vector<double> grid(even.begin(), even.end());
  for (Index k = 0; k < problem.modes.omega_rad_s.size(); ++k) {
    for (const double width : {-3.0, -1.0, 0.0, 1.0, 3.0}) {
      grid.push_back(problem.modes.omega_rad_s[k] * (1.0 + width * problem.modes.damping[k]));
    }
  }
  std::sort(grid.begin(), grid.end());
  return Eigen::Map<const VectorXd>(grid.data(), std::ssize(grid));
}

Picture magnitudes(const std::string& stem, const std::string& title, const std::vector<Panel>& panels,
                   const ResonantProblem& problem) {
  const VectorXd grid = grid_of(problem);
  std::vector<VectorXd> columns = {grid, decibels(problems::response_at(problem.modes, grid))};
  for (const Panel& panel : panels) columns.push_back(decibels(response_at(panel.fit.model, grid)));
  std::string script = kFigureStyles + data_block("d", columns) + "set logscale x\nset format x '10^{%L}'\n" +
                       "set xrange [" + number(grid[0]) + ":" + number(grid.tail(1)[0]) +
                       "]\nset yrange [-100:100]\nset ylabel 'magnitude [dB]'\nset multiplot layout " +
                       std::to_string(panels.size()) + ",1\n";
  for (std::size_t k = 0; k < panels.size(); ++k) {
    if (k + 1 == panels.size()) script += "set xlabel 'frequency [rad/s]'\n";
    script += "set title " + plot_text(panels[k].title) + "\nplot $d using 1:" + std::to_string(k + 3) +
              " with lines ls 2 title 'estimate', $d using 1:2 with lines ls 1 dt 2 title 'true'\n";
  }
  return {stem, title, script + "unset multiplot\n", 900, 270 * static_cast<int>(panels.size())};
}

// --------------------------------------------------------------------------------------------------------- Theorem 1

/// F of the design of the theorem, (n, n): a row for each tone.
Eigen::MatrixXcd filters_at_tones(double gamma, Index filters) {
  const problems::LocalisingDesign design = problems::welsh_goodwin_theorem1(gamma, filters);
  return evaluate(localising_basis(design.break_points_rad_s, filters - 1), design.omega_rad_s).phi;
}

/// Gains of the middle filter of many at the tones: |h_k| on both sides of h_0.
struct Gains {
  double own = 0.0;
  double above = 0.0;
  double below = 0.0;
};

Gains gains_of(double gamma) {
  constexpr Index kFilters = 41;
  constexpr Index kMiddle = kFilters / 2;
  const VectorXd gains = filters_at_tones(gamma, kFilters).col(kMiddle).cwiseAbs();
  return {gains[kMiddle], gains.tail(kMiddle).sum(), gains.head(kMiddle).sum()};
}

struct GammaDigits {
  double gamma;
  double condition;
  double stacked;
};

/// Our digits for nine filters.
constexpr GammaDigits kDigits[] = {
    {3.38, 557.20562, 6.9744688}, {4.0, 225.35407, 4.8458231}, {10.0, 15.760157, 1.7759545}};

void add_digits(const GammaDigits& digits, std::vector<ReproducedFigure>& figures) {
  constexpr Index kFilters = 9;
  constexpr double kDigitsHeld = 1e-6;
  const std::string name = "gamma " + number(digits.gamma) + ", 9 filters: condition";
  const Eigen::MatrixXcd f = filters_at_tones(digits.gamma, kFilters);
  figures.push_back(near(name, std::nullopt, squared_condition(f), digits.condition, kDigitsHeld));
  figures.push_back(near(name + ", real over imaginary part", std::nullopt, squared_condition(stacked(f)),
                         digits.stacked, kDigitsHeld));
}

/// Condition numbers over the number of filters.
struct Growth {
  double gamma;
  VectorXd filters;
  VectorXd condition;
};

Growth growth_of(double gamma) {
  const std::vector<Index> counts = {2, 4, 9, 18, 36, 72};
  Growth growth{gamma, VectorXd(std::ssize(counts)), VectorXd(std::ssize(counts))};
  for (Index k = 0; k < std::ssize(counts); ++k) {
    const Index filters = counts[static_cast<std::size_t>(k)];
    growth.filters[k] = static_cast<double>(filters);
    growth.condition[k] = squared_condition(filters_at_tones(gamma, filters));
  }
  return growth;
}

void add_bound(const Growth& growth, std::vector<ReproducedFigure>& figures) {
  // A sequence that converges like 1 / n^2 grows by a quarter of that from 18 to 36 filters once more.
  constexpr double kLittle = 1.15;
  const Index last = growth.condition.size() - 1;
  figures.push_back(at_most("gamma " + number(growth.gamma) + ": condition of 72 over that of 36 filters", std::nullopt,
                            growth.condition[last] / growth.condition[last - 1], kLittle));
}

/// sum over k != 0 of |h_k| / h_0, which (41) wants below one: of the filters themselves, and with the slower of their
/// two sides on both.
double own_ratio(double gamma) {
  const Gains gains = gains_of(gamma);
  return (gains.above + gains.below) / gains.own;
}
double slow_ratio(double gamma) {
  const Gains gains = gains_of(gamma);
  return 2.0 * gains.above / gains.own;
}

/// Where a ratio that falls with gamma comes down to one.
double least_gamma(double (*ratio)(double)) {
  double low = 2.0;
  double high = 20.0;
  constexpr int kHalvings = 40;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (ratio(middle) > 1.0 ? low : high) = middle;
  }
  return high;
}

ReproducedFigure above(const std::string& quantity, std::optional<double> published, double reproduced, double limit) {
  return {quantity, published, reproduced, "above " + number(limit), reproduced > limit};
}

/// The footnote says that (41) holds at gamma = 4.
void add_footnote(std::vector<ReproducedFigure>& figures) {
  constexpr double kFootnote = 4.0;
  constexpr double kSectionFive = 3.38;
  figures.push_back(above("gamma 4: sum of |h_k| over h_0, k != 0", std::nullopt, own_ratio(kFootnote), 1.0));
  figures.push_back(above("the same with the slower side on both", std::nullopt, slow_ratio(kFootnote), 1.0));
  figures.push_back(above("gamma 3.38 of section 5: the same", std::nullopt, slow_ratio(kSectionFive), 1.0));
  figures.push_back(above("least gamma for (41)", kFootnote, least_gamma(own_ratio), kFootnote));
  figures.push_back(above("the same with the slower side on both", kFootnote, least_gamma(slow_ratio), kFootnote));
}

/// With denominators, which the theorem leaves out: one mode a decade.
void add_with_denominators(std::vector<ReproducedFigure>& figures) {
  constexpr double kFactor = 10.0;
  for (const Index decades : {3, 9, 15, 30}) {
    const ResonantProblem problem = problems::resonant_decades(decades);
    const RationalBasis basis = localising_basis(problem.break_points_rad_s, 2 * decades - 1);
    const Eigen::MatrixXd x = stacked(equation_error_matrix(spectra_of(problem.data), basis));
    const auto width = static_cast<double>(decades);
    figures.push_back(at_most("with denominators, " + std::to_string(decades) + " decades: condition", std::nullopt,
                              squared_condition(normalised_columns(x)), kFactor * width * width));
  }
}

Picture growth_picture(const std::vector<Growth>& all) {
  std::string script = kFigureStyles;
  std::string plot;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const std::string name = "g" + std::to_string(k);
    script += data_block(name, {all[k].filters, all[k].condition});
    plot += (k == 0 ? "plot $" : ", $") + name + " using 1:2 with linespoints pt 7 ps 0.5 title " +
            plot_text("ratio " + number(all[k].gamma));
  }
  return {"condition", "Condition of the normal matrix over the number of filters",
          script + "set logscale xy\nset xlabel 'filters'\nset ylabel 'condition'\n" + plot + "\n", 900, 380};
}

Picture filters_picture() {
  constexpr Index kFilters = 6;
  constexpr Index kPoints = 300;
  const problems::LocalisingDesign design = problems::welsh_goodwin_theorem1(4.0, kFilters);
  const VectorXd omega = break_points(0.02, 2e4, kPoints);
  const Eigen::MatrixXd gains =
      evaluate(localising_basis(design.break_points_rad_s, kFilters - 1), omega).phi.cwiseAbs();
  std::vector<VectorXd> columns = {omega};
  std::string plot = "plot ";
  for (Index k = 0; k < kFilters; ++k) {
    columns.emplace_back(20.0 * gains.col(k).array().log10());
    plot += (k == 0 ? "$d using 1:" : ", $d using 1:") + std::to_string(k + 2) + " with lines lw 1.4 title 'F_" +
            std::to_string(k + 1) + "'";
  }
  return {"filters", "Gains of six localising functions, break points in the ratio of 4",
          kFigureStyles + data_block("d", columns) +
              "set logscale x\nset xrange [0.02:20000]\nset yrange [-60:5]\nset xlabel 'frequency [rad/s]'\n"
              "set ylabel 'gain [dB]'\n" +
              plot + "\n",
          900, 380};
}

}  // namespace

Reproduction welsh2003(std::uint64_t) {
  const ResonantProblem problem = problems::welsh_goodwin();
  const double low = problem.data.omega_rad_s[0];
  const double high = problem.data.omega_rad_s.tail(1)[0];
  const auto fitted = [&](const RationalBasis& basis) {
    return fit_frequency_response(problem.data, basis, without_truncation());
  };
  const FrequencyFit powers = fitted(monomial_basis(18, 17));
  const FrequencyFit scaled = fitted(monomial_basis(18, 17, 0.5 * (low + high)));
  const FrequencyFit chebyshev = fitted(chebyshev_basis(18, 17, high));
  constexpr Index kCandidates = 46;
  const FrequencyFit laguerre = best_laguerre(problem, break_points(low, high, kCandidates));
  const FrequencyFit localised = fit_frequency_response(problem.data, localising(problem), article_options());
  Reproduction result;
  add_failure(kPowers, powers, problem, result.figures);
  add_failure(kScaledPowers, scaled, problem, result.figures);
  add_failure(kChebyshev, chebyshev, problem, result.figures);
  add_failure(kLaguerre, laguerre, problem, result.figures);
  add_localising(localised, problem, result.figures);
  add_tuning(problem, result.figures);
  result.pictures.push_back(magnitudes(
      "figure_1", "Estimates by powers of s and by Chebyshev polynomials",
      {{"(a) powers of s", powers}, {"(b) powers of scaled s", scaled}, {"(c) Chebyshev polynomials", chebyshev}},
      problem));
  result.pictures.push_back(
      magnitudes("figure_2", "Estimates by Laguerre and by localising functions",
                 {{"(a) Laguerre functions", laguerre}, {"(b) frequency localising functions", localised}}, problem));
  result.notes = {
      "Frequencies, dampings and gains of the nine modes are not printed: problems/welsh_goodwin.hpp says which ones "
      "we "
      "chose, because their condition number comes near the printed one; 4059 itself needs the authors' numbers.",
      "Equation (28) must read F_k = s^(k-1) p_k / prod_{l<=k} (s + p_l): as printed, the product would contain the "
      "numerator k times. Equation (33) agrees with this.",
      "The condition numbers of NLS, NLSFS, TP and LBF are rounding, not properties of the matrices: with 900 digits "
      "they are 3e195, 3e143, 3e145 and 3e50 here. They only have to be hopeless; the printed ones of TP and LBF fit "
      "the product X*X formed in double precision, those of NLS and NLSFS cond(X)^2.",
      "The errors of these four are rounding, too: the data have no noise and the model class contains the system, so "
      "that every method is exact in exact arithmetic. They change with the order of the columns.",
      "L2 is the mean, not the sum, of squares over the tones: 37.92^2 alone exceeds the printed 69.5 of LBF. Decibels "
      "are our reading; the print has no unit.",
      "36 tones and 36 unknowns make the complex least squares of (23) square. Real over imaginary parts give a "
      "condition number a million times smaller and real parameters; the printed 4059 fits this only.",
      "A frequency scale by the arithmetic mean (13) is half the highest frequency here and does nothing for "
      "conditioning; the geometric mean is the one that equalises powers of s.",
      "Break points are easy to choose within half a decade of the band; beyond, |A/E| drifts over decades and digits "
      "are lost whatever the condition number. Relocating them to the moduli of the poles found cures that.",
      "Section 6 cannot be computed anew: the data of the beam are not public."};
  return result;
}

Reproduction welsh2003_theorem1(std::uint64_t) {
  Reproduction result;
  for (const GammaDigits& digits : kDigits) add_digits(digits, result.figures);
  std::vector<Growth> all;
  for (const double gamma : {2.0, 3.38, 4.0, 10.0}) {
    all.push_back(growth_of(gamma));
    add_bound(all.back(), result.figures);
  }
  add_footnote(result.figures);
  add_with_denominators(result.figures);
  result.pictures = {growth_picture(all), filters_picture()};
  result.notes = {
      "(41) must read h_0 > 2 sum |h_k|: as printed it has the reciprocals of h_k and allows equality, for which (47) "
      "fails.",
      "(45) is a lower bound: lambda_min >= h_0 - 2 sum |h_k|.",
      "X = S S of (42) needs a real symmetric Toeplitz S. The matrix of the filters at the tones is neither real nor "
      "symmetric: phases differ, and gains fall faster towards low frequencies. The statement holds nevertheless, and "
      "for smaller ratios than (41) allows.",
      "The footnote, that (41) holds for gamma = 4, is true for h_k = gamma^-k only, not for the gains of the filters "
      "themselves. The example of section 5 has 3.38 and violates (41), without harm: the condition is sufficient, not "
      "necessary.",
      "The theorem is about numerators alone (A.1). With denominators condition numbers are not bounded: with one mode "
      "a decade, gains of alternating sign and break points alike beside each mode they grow like the square of the "
      "number of decades, which costs no digit that matters over any band."};
  return result;
}

}  // namespace blockid::cli
