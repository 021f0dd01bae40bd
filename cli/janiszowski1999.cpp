#include <blockid/cli/janiszowski1999.hpp>

#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/estimators/recursive_trends.hpp>
#include <blockid/estimators/trend_fit.hpp>
#include <blockid/problems/janiszowski.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace blockid::cli {
namespace {

using problems::servo_record;
using problems::ServoConditions;
using problems::ServoPlant;

constexpr int kRecords = 9;
/// What a reconstructed experiment can be held to: the size of an error, not its digits.
constexpr double kAllowedFactor = 3.0;
/// At other sample times the unknown reconstruction of the velocity matters more.
constexpr double kSampleTimeFactor = 5.0;
/// Errors below this, in percent, count as small in both.
constexpr double kSmall = 1.0;
constexpr double kCoefficient = 0.02;
constexpr double kOvermodelled = 0.1;

// ---------------------------------------------------------------------------------------------------------------
// Table 1

/// One line of table 1: errors in percent, convergence times 1000, settling time in ms.
struct ServoLine {
  double xi = 0.0;
  double w0 = 0.0;
  double gain = 0.0;
  double convergence = 0.0;
  double settling_ms = 0.0;
};

struct Row {
  const char* name;
  ServoConditions conditions;
  ServoLine goodwin;
  ServoLine tustin;
  double factor = kAllowedFactor;
};

/// As printed, with the error columns renamed (see the notes).
const std::vector<Row>& table_1() {
  static const std::vector<Row> kRows = {
      {"w = 100 um", {1e-3, 100, 1, 2, 1}, {5.9, 0.42, 0.75, 0.166, 93}, {0.23, 0.17, 0.49, 0.100, 89}},
      {"w = 1 mm", {1e-3, 1000, 1, 2, 1}, {6.1, 0.42, 0.77, 0.216, 97}, {0.24, 0.19, 0.51, 0.179, 97}},
      {"w = 2 mm", {1e-3, 2000, 1, 2, 1}, {8.1, 0.34, 0.35, 1.47, 132}, {0.1, 0.59, 0.69, 1.53, 133}},
      {"w = 5 mm", {1e-3, 5000, 1, 2, 1}, {59.2, 2.49, 11.1, 6.17, 324}, {6.6, 10.4, 3.5, 8.16, 308}},
      {"w = 10 mm", {1e-3, 10000, 1, 2, 1}, {184.5, 2.55, 39.4, 9.10, 356}, {22.9, 40.3, 10.7, 18.2, 409}},
      {"eta = 10 um", {1e-3, 100, 10, 2, 1}, {6.3, 0.39, 0.70, 0.48, 101}, {0.19, 0.23, 0.54, 0.47, 106}},
      {"eta = 100 um", {1e-3, 100, 100, 2, 1}, {40.1, 4.22, 7.53, 3.95, 228}, {2.01, 3.27, 1.53, 4.62, 171}},
      {"eta = 200 um", {1e-3, 100, 200, 2, 1}, {138.1, 16.3, 30.8, 6.29, 317}, {8.1, 12.2, 4.11, 9.56, 299}},
      {"eta = 500 um", {1e-3, 100, 500, 2, 1}, {591.2, 55.3, 137.7, 12.56, 422}, {37.6, 72.2, 17.6, 28.46, 466}},
      {"epsilon = 5 um", {1e-3, 100, 10, 5, 1}, {6.3, 0.39, 0.70, 0.58, 105}, {0.19, 0.24, 0.54, 0.52, 109}},
      {"epsilon = 10 um", {1e-3, 100, 10, 10, 1}, {6.6, 0.34, 0.61, 0.64, 107}, {0.18, 0.25, 0.53, 0.64, 113}},
      {"epsilon = 20 um", {1e-3, 100, 10, 20, 1}, {7.73, 0.21, 0.34, 1.03, 125}, {0.12, 0.36, 0.56, 1.06, 127}},
      {"epsilon = 50 um", {1e-3, 100, 10, 50, 1}, {15.55, 0.88, 1.63, 2.04, 144}, {0.43, 1.16, 0.81, 2.28, 144}},
      {"epsilon = 100 um", {1e-3, 100, 10, 100, 1}, {42.2, 4.11, 7.71, 4.02, 234}, {2.33, 3.83, 1.88, 4.90, 183}},
      {"D = 0.25 ms",
       {0.25e-3, 100, 10, 10, 1},
       {110.6, 25.3, 22.1, 15.8, 164},
       {1.88, 3.63, 0.62, 18.9, 172},
       kSampleTimeFactor},
      {"D = 0.5 ms",
       {0.5e-3, 100, 10, 10, 1},
       {31.1, 11.3, 7.61, 6.64, 133},
       {0.2, 1.63, 0.25, 6.95, 134},
       kSampleTimeFactor},
      {"D = 2 ms",
       {2e-3, 100, 10, 10, 1},
       {10.2, 1.0, 2.53, 1.07, 147},
       {0.36, 0.80, 1.98, 0.67, 144},
       kSampleTimeFactor},
      {"D = 5 ms",
       {5e-3, 100, 10, 10, 1},
       {38.6, 2.90, 12.46, 0.14, 280},
       {15.25, 1.73, 8.65, 0.15, 179},
       kSampleTimeFactor}};
  return kRows;
}

TrendStructure three_coefficients(TrendScheme scheme) { return {scheme, 2, {1, 0}, {0}, 0}; }

double percent_off(double value, double truth) { return 100.0 * std::abs(value / truth - 1.0); }

ServoLine line_of(const Record& record, TrendScheme scheme) {
  const TrendFit fit = fit_trends(record, three_coefficients(scheme));
  // Noise can turn the sign of a0, which leaves no natural frequency: its magnitude then stands for it.
  const double w0 = std::sqrt(std::abs(fit.a[0]));
  ServoLine line;
  line.xi = percent_off(fit.a[1] / (2.0 * w0), 0.5);
  line.w0 = percent_off(w0, std::sqrt(ServoPlant::kA0));
  line.gain = percent_off(fit.b[0] / fit.a[0], ServoPlant::kB0 / ServoPlant::kA0);
  Eigen::VectorXd y = record.y;
  for (Index k = 0; k < y.size(); ++k) {
    if (is_missing(record, k)) y[k] = std::numeric_limits<double>::quiet_NaN();
  }
  const Eigen::MatrixXd history = trend_history(record.u, y, three_coefficients(scheme), record.sample_time_s);
  const auto sample_at = [&](double t) { return static_cast<Index>(std::llround(t / record.sample_time_s)); };
  line.convergence = 1e3 * convergence(history, sample_at(0.5), sample_at(1.0));
  line.settling_ms = 1e3 * record.sample_time_s * static_cast<double>(settling_sample(history));
  return line;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Medians over the records, quantity by quantity.
ServoLine median_line(ServoConditions conditions, TrendScheme scheme, std::uint64_t seed) {
  std::vector<ServoLine> lines;
  for (int k = 0; k < kRecords; ++k) {
    conditions.seed = seed + static_cast<std::uint64_t>(k);
    lines.push_back(line_of(servo_record(conditions), scheme));
  }
  ServoLine result;
  for (double ServoLine::*quantity :
       {&ServoLine::xi, &ServoLine::w0, &ServoLine::gain, &ServoLine::convergence, &ServoLine::settling_ms}) {
    std::vector<double> values;
    for (const ServoLine& line : lines) values.push_back(line.*quantity);
    result.*quantity = median(values);
  }
  return result;
}

ReproducedFigure within_factor(const std::string& quantity, double published, double reproduced, double factor,
                               double small) {
  const bool both_small = published <= small && reproduced <= small;
  const double ratio = reproduced / published;
  return {quantity, published, reproduced,
          "within a factor of " + number(factor) + (small > 0.0 ? ", or both below " + number(small) + " %" : ""),
          both_small || (ratio <= factor && ratio >= 1.0 / factor)};
}

ReproducedFigure relative(const std::string& quantity, double published, double reproduced, double tolerance) {
  return {quantity, published, reproduced, "within " + number(100.0 * tolerance) + " %",
          std::abs(reproduced / published - 1.0) <= tolerance};
}

ReproducedFigure between(const std::string& quantity, std::optional<double> published, double reproduced, double lower,
                         double upper) {
  return {quantity, published, reproduced, number(lower) + ".." + number(upper),
          reproduced >= lower && reproduced <= upper};
}

void add_lines(const Row& row, const ServoLine& goodwin, const ServoLine& tustin,
               std::vector<ReproducedFigure>& figures) {
  const std::string name = row.name;
  figures.push_back(within_factor(name + ": xi, Goodwin [%]", row.goodwin.xi, goodwin.xi, row.factor, kSmall));
  figures.push_back(within_factor(name + ": xi, Tustin [%]", row.tustin.xi, tustin.xi, row.factor, kSmall));
  figures.push_back({name + ": xi, Goodwin / Tustin", row.goodwin.xi / row.tustin.xi, goodwin.xi / tustin.xi,
                     "Tustin is better", goodwin.xi > tustin.xi});
}

void add_convergence(const Row& row, const ServoLine& goodwin, const ServoLine& tustin,
                     std::vector<ReproducedFigure>& figures) {
  const std::string name = row.name;
  figures.push_back(within_factor(name + ": CONV, Goodwin", row.goodwin.convergence, goodwin.convergence, 2.0, 0.0));
  figures.push_back(within_factor(name + ": CONV, Tustin", row.tustin.convergence, tustin.convergence, 2.0, 0.0));
  figures.push_back(within_factor(name + ": T_ss, Tustin [ms]", row.tustin.settling_ms, tustin.settling_ms, 1.5, 0.0));
}

/// Rows for which the definition of CONV that we found fits: noise and resolution at low drift.
bool shows_convergence(const Row& row) {
  return row.conditions.sample_time_s == 1e-3 && row.conditions.drift_um == 100.0 && row.conditions.noise_um <= 100.0;
}

/// Figure 1: estimates over the true values while samples come in, w = 200 um, eta = 20 um, epsilon = 10 um.
Picture figure_1(std::uint64_t seed) {
  const ServoConditions conditions{1e-3, 200.0, 20.0, 10.0, seed};
  const Record record = servo_record(conditions);
  constexpr Index kShown = 300;
  Eigen::VectorXd y = record.y.head(kShown);
  y.head(2).setConstant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::VectorXd t = 1e3 * record.sample_time_s * Eigen::VectorXd::LinSpaced(kShown, 0.0, kShown - 1.0);
  const Eigen::RowVector3d truth(ServoPlant::kA1, ServoPlant::kA0, ServoPlant::kB0);
  std::string script;
  for (const TrendScheme scheme : {TrendScheme::goodwin, TrendScheme::tustin}) {
    const Eigen::MatrixXd history =
        trend_history(record.u.head(kShown), y, three_coefficients(scheme), record.sample_time_s);
    const Eigen::MatrixXd share = history.array().rowwise() / truth.array();
    script += data_block(scheme == TrendScheme::goodwin ? "goodwin" : "tustin",
                         {t, share.col(0), share.col(1), share.col(2)});
  }
  script += "set yrange [0:2]\nset xlabel 'time [ms]'\nset ylabel 'estimate / true value'\nset multiplot layout 1,2\n";
  for (const char* name : {"goodwin", "tustin"}) {
    script += "set title " + plot_text(name == std::string("goodwin") ? "Goodwin" : "modified Tustin") + "\nplot $" +
              name + " using 1:2 with lines ls 1 title 'a1', $" + name + " using 1:3 with lines ls 2 title 'a0', $" +
              name + " using 1:4 with lines ls 3 title 'b0'\n";
  }
  return {"figure_1", "Coefficients while samples come in, w = 200 um, eta = 20 um, epsilon = 10 um",
          script + "unset multiplot\n", 900, 380};
}

const std::vector<std::string>& set_up_notes() {
  static const std::vector<std::string> kNotes = {
      "Input, drift, length and the reconstruction of the velocity are not printed: problems/janiszowski.hpp says "
      "which "
      "ones we chose, because their errors are of the size of the printed ones.",
      "Equation (3) lacks an exponent: (1 - q^-1)^i in the sum over a_i; in (8), p_{d-m} is p_{d+m}; in (10), the sums "
      "run over i."};
  return kNotes;
}

// ---------------------------------------------------------------------------------------------------------------
// Table 2

struct Fits {
  TrendFit goodwin;
  TrendFit tustin;
};

Fits fits_of(const Record& record, Index order, const std::vector<Index>& a, const std::vector<Index>& b) {
  return {fit_trends(record, {TrendScheme::goodwin, order, a, b, 0}),
          fit_trends(record, {TrendScheme::tustin, order, a, b, 0})};
}

/// b_i and a_i in the units of the table: b over 10^6.
double in_table(double b) { return b / ServoPlant::kB0; }

void add_first_order(const Fits& fits, std::vector<ReproducedFigure>& figures) {
  figures.push_back(within_factor("m = 1, Goodwin: a0", -3.888, fits.goodwin.a[0], kAllowedFactor, -1e300));
  figures.push_back(within_factor("m = 1, Tustin: a0", -4.011, fits.tustin.a[0], kAllowedFactor, -1e300));
  const auto b0 = [&](const std::string& name, double published, double reproduced) {
    figures.push_back({name, published, reproduced, "a tenth of the print, within 12 %",
                       std::abs(10.0 * reproduced / published - 1.0) <= 0.12});
  };
  b0("m = 1, Goodwin: b0", 0.125, in_table(fits.goodwin.b[0]));
  b0("m = 1, Tustin: b0", 0.116, in_table(fits.tustin.b[0]));
}

void add_three(const std::string& name, const TrendFit& fit, const Eigen::Vector3d& published,
               std::vector<ReproducedFigure>& figures) {
  figures.push_back(relative(name + ": a1", published[0], fit.a[1], kCoefficient));
  figures.push_back(relative(name + ": a0", published[1], fit.a[0], kCoefficient));
  figures.push_back(relative(name + ": b0", published[2], in_table(fit.b[0]), kCoefficient));
}

/// Order three, normalised by a2 as in the table; published a3, a1, a0, b1, b0.
void add_overmodelled(const std::string& name, const TrendFit& fit, const std::vector<double>& published,
                      std::vector<ReproducedFigure>& figures) {
  const double a2 = fit.a[2];
  figures.push_back(within_factor(name + ": a3", published[0], 1.0 / a2, kAllowedFactor, 0.0));
  figures.push_back(relative(name + ": a1", published[1], fit.a[1] / a2, kOvermodelled));
  figures.push_back(relative(name + ": a0", published[2], fit.a[0] / a2, kOvermodelled));
  figures.push_back(within_factor(name + ": b1", published[3], in_table(fit.b[1] / a2), kAllowedFactor, 0.0));
  figures.push_back(relative(name + ": b0", published[4], in_table(fit.b[0] / a2), kOvermodelled));
}

}  // namespace

Reproduction janiszowski1999_table1(std::uint64_t seed) {
  Reproduction result;
  std::vector<std::pair<double, double>> over_sample_time;
  for (const Row& row : table_1()) {
    const ServoLine goodwin = median_line(row.conditions, TrendScheme::goodwin, seed);
    const ServoLine tustin = median_line(row.conditions, TrendScheme::tustin, seed);
    add_lines(row, goodwin, tustin, result.figures);
    if (shows_convergence(row)) add_convergence(row, goodwin, tustin, result.figures);
    const bool standard = row.conditions.noise_um == 10.0 && row.conditions.resolution_um == 10.0;
    if (standard) over_sample_time.emplace_back(tustin.xi, 1e3 * row.conditions.sample_time_s);
  }
  const auto best = std::min_element(over_sample_time.begin(), over_sample_time.end());
  result.figures.push_back(between("best sample time, Tustin [ms]", 1.0, best->second, 0.5, 1.0));
  result.pictures.push_back(figure_1(seed));
  result.notes = set_up_notes();
  result.notes.emplace_back(
      "The error columns, printed as those of C, w_0 and xi, hold those of xi, w_0 and C: with b_1 left out Goodwin's "
      "a_1 "
      "is off by (D/2)|s|^2, 6 % here, and its gain by less than 1 %; table 2 says the same of the same conditions.");
  result.notes.emplace_back(
      "CONV is not defined in print. The mean over 0.5 to 1 s of the largest relative step of the coefficients fits "
      "the "
      "rows of noise and resolution; it does not fit the rows of drift.");
  return result;
}

Reproduction janiszowski1999_table2(std::uint64_t seed) {
  const Record record = servo_record({1e-3, 100.0, 10.0, 10.0, seed});
  const Fits first = fits_of(record, 1, {0}, {0});
  const Fits three = fits_of(record, 2, {1, 0}, {0});
  const Fits four = fits_of(record, 2, {1, 0}, {1, 0});
  const Fits five = fits_of(record, 3, {2, 1, 0}, {1, 0});
  Reproduction result;
  add_first_order(first, result.figures);
  add_three("m = 2, M = 3, Goodwin", three.goodwin, {21.24, 400.6, 0.9937}, result.figures);
  add_three("m = 2, M = 3, Tustin", three.tustin, {19.95, 400.4, 0.9941}, result.figures);
  add_three("m = 2, M = 4, Goodwin", four.goodwin, {20.29, 395.7, 0.9861}, result.figures);
  result.figures.push_back(
      between("m = 2, M = 4, Goodwin: b1", 0.00051, in_table(four.goodwin.b[1]), 0.00045, 0.00052));
  add_three("m = 2, M = 4, Tustin", four.tustin, {19.95, 400.1, 0.9935}, result.figures);
  result.figures.push_back({"m = 2, M = 4, Tustin: b1", 0.000035, in_table(four.tustin.b[1]),
                            "a fifth of Goodwin's at most",
                            std::abs(four.tustin.b[1]) <= 0.2 * std::abs(four.goodwin.b[1])});
  add_overmodelled("m = 3, M = 5, Goodwin", five.goodwin, {0.00133, 22.25, 392.9, 0.00087, 0.9761}, result.figures);
  result.figures.push_back(between("IQ(m = 1) / IQ(m = 2), Goodwin", 324.8 / 0.1042,
                                   first.goodwin.squared_error / three.goodwin.squared_error, 2500.0, 4500.0));
  result.figures.push_back(between("IQ(m = 1) / IQ(m = 2), Tustin", 340.5 / 0.1033,
                                   first.tustin.squared_error / three.tustin.squared_error, 2500.0, 4500.0));
  result.notes = set_up_notes();
  result.notes.emplace_back(
      "b_0 for m = 1 is printed ten times too large: for any stationary input it cannot exceed b_0 / a_1 = 0.05.");
  result.notes.emplace_back(
      "Tustin's rows for m = 3 cannot be reproduced: under noise the free pole goes to s = 0 and a_3 to 1/20, as "
      "theory "
      "says; the printed 0.001 points to a recursion that had not yet converged. They are left out.");
  return result;
}

}  // namespace blockid::cli
