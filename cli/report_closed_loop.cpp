#include <blockid/cli/closed_loop_outcome.hpp>

#include <blockid/cli/report/figures.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/transfer_function.hpp>

#include <cmath>
#include <numbers>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

VectorXd vector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

/// "" for the first experiment, "-2" for the second.
std::string suffix(std::size_t place) { return place == 0 ? "" : "-" + std::to_string(place + 1); }

Figure signals_figure(const ClosedLoopOutcome& outcome, std::size_t place) {
  const ClosedLoopExperiment& one = outcome.experiments[place];
  Figure figure{.id = "signals" + suffix(place),
                .title = "The signals v and w that the uncertainty connects",
                .caption = "w = Delta v + delta: w is what the model's loop does not explain. Dotted: the noise bound.",
                .script = {},
                .height = 320};
  const Index n = one.signals.v.size();
  const VectorXd t = VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1)) * outcome.sample_time_s;
  figure.script = kFigureStyles + data_block("d", {t, one.signals.v, one.signals.w}) +
                  "gamma = " + number(one.noise_bound, 8) +
                  "\nset xlabel 'time [s]'\nplot $d using 1:2 with lines ls 1 title 'v', $d using 1:3 with lines ls 3 "
                  "title 'w', gamma with lines ls 4 title 'noise bound', -gamma with lines ls 4 notitle\n";
  return figure;
}

Figure windows_figure(const ClosedLoopOutcome& outcome, std::size_t place) {
  const ClosedLoopExperiment& one = outcome.experiments[place];
  std::vector<double> first;
  std::vector<double> needed;
  std::vector<double> proven;
  std::vector<double> of_record;
  for (const WindowedVerdict& w : one.windows) {
    first.push_back(static_cast<double>(w.first));
    needed.push_back(w.window.noise_needed);
    proven.push_back(w.window.noise_proven);
    of_record.push_back(w.record ? w.record->noise_proven : std::nan(""));
  }
  Figure figure{.id = "windows" + suffix(place),
                .title = "Noise that the uncertainty does not explain, window by window",
                .caption =
                    "Above the noise bound (dashed) the proven noise invalidates. The noise needed is that of a "
                    "Delta that was found; a test ends as soon as the side of the bound is known.",
                .script = {},
                .height = 320};
  figure.script =
      kFigureStyles + data_block("d", {vector(first), vector(needed), vector(proven), vector(of_record)}) +
      "gamma = " + number(one.noise_bound, 8) +
      "\nset xlabel 'first sample of the window'\nset ylabel 'noise'\nplot $d using 1:2 with linespoints ls "
      "1 pt 6 title 'needed', $d using 1:3 with linespoints ls 3 pt 7 title 'proven', $d using 1:4 with "
      "linespoints ls 2 pt 4 title 'proven by the record so far', gamma with lines ls 4 title 'bound'\n";
  return figure;
}

Figure curve_figure(const TradeOffCurve& curve, double noise_bound) {
  std::vector<double> gamma;
  std::vector<double> alpha;
  for (const TradeOffPoint& point : curve.points) {
    gamma.push_back(point.gamma);
    alpha.push_back(point.alpha);
  }
  Figure figure{.id = "curve",
                .title = "How much uncertainty the record needs for how much noise",
                .caption =
                    "On or above the curve the record is explained. At uncertainty 1 (dashed) the weight as it "
                    "is suffices.",
                .script = {},
                .width = 700};
  figure.script = kFigureStyles + data_block("d", {vector(gamma), vector(alpha)}) +
                  "set logscale x\nset xlabel 'noise bound'\nset ylabel 'uncertainty'\n";
  if (curve.elbow) {
    figure.caption += " Elbow at " + number(curve.elbow->gamma, 4) + ".";
    figure.script += "set arrow from " + number(curve.elbow->gamma, 8) + ", graph 0 to " +
                     number(curve.elbow->gamma, 8) + ", graph 1 nohead ls 4\n";
  }
  if (noise_bound > 0.0) {
    figure.caption += " Red: the noise bound of the verdict.";
    figure.script += "set arrow from " + number(noise_bound, 8) + ", graph 0 to " + number(noise_bound, 8) +
                     ", graph 1 nohead ls 3\n";
  }
  figure.script +=
      "plot $d using 1:2 with linespoints ls 2 pt 7 ps 0.6 title 'least uncertainty', 1 with lines ls 4 notitle\n";
  return figure;
}

Figure bands_figure(const ClosedLoopOutcome& outcome, std::size_t place) {
  std::vector<double> mean;
  std::vector<double> needed;
  std::vector<double> spread;
  for (const BandBound& band : outcome.experiments[place].bands) {
    mean.push_back(band.mean_omega);
    spread.push_back(band.spread_omega);
    needed.push_back(band.gain * magnitude(outcome.weight, band.mean_omega));
  }
  constexpr Index kPoints = 200;
  const VectorXd omega = VectorXd::LinSpaced(kPoints, std::log(1e-2), std::log(std::numbers::pi)).array().exp();
  const VectorXd weight = omega.unaryExpr([&](double w) { return magnitude(outcome.weight, w); });
  Figure figure{.id = "bands" + suffix(place),
                .title = "The weight and what it must at least be",
                .caption =
                    "Points: |V| times a lower bound of |Delta|, an average over the band that the horizontal "
                    "bar shows. Above the line the weight is too small there.",
                .script = {}};
  figure.script =
      kFigureStyles + data_block("v", {omega, weight}) +
      data_block("b", {vector(mean), vector(needed), vector(spread)}) +
      "set logscale xy\nset xrange [0.01:3.15]\nset xlabel 'frequency [rad/sample]'\nset ylabel "
      "'magnitude'\nplot $v using 1:2 with lines ls 1 title '|V|', $b using 1:2:3 with xerrorbars ls 3 pt 7 "
      "title 'at least'\n";
  return figure;
}

void add_windows(HtmlPage& page, const ClosedLoopExperiment& one) {
  std::vector<std::vector<std::string>> rows;
  for (const WindowedVerdict& w : one.windows) {
    rows.push_back({std::to_string(w.first), std::to_string(w.past), to_text(w.window.verdict),
                    number(w.window.noise_needed, 4), number(w.window.noise_proven, 4),
                    w.record ? to_text(w.record->verdict) : "-"});
  }
  page.table({"from sample", "past", "window", "noise needed", "noise proven", "record to its end"}, rows);
}

void add_experiment(HtmlPage& page, const ClosedLoopOutcome& outcome, std::size_t place, bool gnuplot) {
  const ClosedLoopExperiment& one = outcome.experiments[place];
  if (outcome.experiments.size() > 1) page.heading(one.source + ", samples " + one.range);
  page.paragraph("Noise bound " + number(one.noise_bound, 5) + " (" + one.noise_source +
                 "). An invalidation is one of model, uncertainty, controller and noise bound together.");
  if (outcome.whole && outcome.experiments.size() > 1) {
    page.paragraph("The Delta that was found for all experiments leaves " + number(one.noise_left, 5) + " here.");
  }
  if (one.reference) {
    std::string behind;
    if (one.reference->start > 0) {
      behind = ", behind " + start_text(*one.reference) + " to within " + number(one.reference->error_behind_start, 3);
    }
    page.paragraph("u = r - C y holds to within " + number(one.reference->error, 3) + behind + "; the largest |u| is " +
                   number(one.reference->largest, 4) + ".");
  }
  add_figure(page, signals_figure(outcome, place), gnuplot);
  if (!one.windows.empty()) {
    add_windows(page, one);
    add_figure(page, windows_figure(outcome, place), gnuplot);
  }
  if (!one.bands.empty()) add_figure(page, bands_figure(outcome, place), gnuplot);
}

}  // namespace

std::string closed_loop_report(const ClosedLoopOutcome& outcome) {
  HtmlPage page("Closed-loop validation of a model with its uncertainty");
  const bool gnuplot = gnuplot_is_there();
  std::string title;
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    title += (title.empty() ? "" : "; ") + one.source + ", samples " + one.range;
  }
  page.paragraph(title + ", sampled every " + number(outcome.sample_time_s) +
                 " s. The uncertainty is a stable Delta of gain one at most behind the weight V.");
  page.code("plant       " + to_text(outcome.plant) + "\ncontroller  " + to_text(outcome.controller) +
            "\nweight V    " + to_text(outcome.weight));
  if (!gnuplot) page.warning(kGnuplotMissing);
  for (const std::string& warning : outcome.warnings) page.warning(warning);
  page.heading("Verdict: " + to_text(outcome.verdict()));
  page.paragraph(evidence_text(outcome) + ".");
  if (outcome.curve) add_figure(page, curve_figure(*outcome.curve, outcome.noise_bound()), gnuplot);
  for (std::size_t i = 0; i < outcome.experiments.size(); ++i) add_experiment(page, outcome, i, gnuplot);
  return page.text();
}

}  // namespace blockid::cli
