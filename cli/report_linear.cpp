#include <blockid/cli/linear_outcome.hpp>

#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/figures.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/cli/report_evaluation.hpp>
#include <blockid/cli/text_table.hpp>

#include <cmath>
#include <complex>
#include <numbers>

namespace blockid::cli {
namespace {

void add_scores(HtmlPage& page, const LinearOutcome& outcome, const std::string& output_unit) {
  const std::string unit = output_unit.empty() ? "" : " [" + output_unit + "]";
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const std::string& name, const Metrics& metrics) {
    rows.push_back({name, number(metrics.rmse), number(metrics.nrmse), number(metrics.fit_percent), number(metrics.r2),
                    std::to_string(metrics.samples)});
  };
  for (const LinearScore& score : outcome.scores) add("train, " + score.name, score.train);
  for (const LinearScore& score : outcome.scores) {
    if (score.test) add("test, " + score.name, *score.test);
  }
  page.table({"data, prediction", "RMSE" + unit, "NRMSE", "fit %", "R²", "samples"}, rows);
}

void add_response(HtmlPage& page, const PolynomialFit& fit, const char* name,
                  std::complex<double> (*response)(const PolynomialModel&, double), bool gnuplot) {
  const double h = fit.model.sample_time_s;
  const Eigen::VectorXd frequency = logarithmic_frequencies(h, kBodeDecades, kBodePoints);
  const ResponseFunction of_theta = [&](const Eigen::VectorXd& theta) {
    PolynomialModel model = fit.model;
    model.theta = theta;
    Eigen::VectorXcd g(frequency.size());
    for (Index k = 0; k < g.size(); ++k) g[k] = response(model, 2.0 * std::numbers::pi * frequency[k] * h);
    return g;
  };
  const Index parameters = fit.model.theta.size();
  const Eigen::MatrixXd covariance =
      fit.covariance ? Eigen::MatrixXd(fit.covariance->parameters.topLeftCorner(parameters, parameters))
                     : Eigen::MatrixXd();
  const bool known = covariance.size() > 0 && covariance.allFinite();
  add_figure(
      page,
      bode_figure(name, bode_band(of_theta, fit.model.theta, known ? covariance : Eigen::MatrixXd(), frequency), {}),
      gnuplot);
}

void add_roots(HtmlPage& page, const PolynomialModel& model, bool gnuplot) {
  for (const LeafBlock& leaf : leaf_blocks(deterministic_part(model))) {
    if (leaf.path != "G") continue;
    const std::optional<LinearRoots> roots = linear_roots(leaf.block, leaf.parameters);
    if (roots) add_figure(page, pole_zero_figure("G", *roots), gnuplot);
  }
}

void add_coefficients(HtmlPage& page, const PolynomialFit& fit) {
  page.heading("Coefficients");
  std::vector<std::vector<std::string>> rows;
  const std::vector<std::string> names = parameter_names(fit.model.orders);
  for (Index k = 0; k < fit.model.theta.size(); ++k) {
    rows.push_back({names[static_cast<std::size_t>(k)], number(fit.model.theta[k], 8),
                    fit.covariance ? number(fit.covariance->standard_deviations[k], 3) : "-"});
  }
  page.table({"name", "value", "standard deviation"}, rows);
}

}  // namespace

std::string linear_report(const LinearCommand& command, const LinearOutcome& outcome) {
  const bool gnuplot = gnuplot_is_there();
  const PolynomialFit& fit = outcome.found.fit;
  HtmlPage page("Linear model of " + command.data.output.value_or("the output") + " from " + command.data.input);
  page.paragraph(command.data.file + ", sampled every " + number(fit.model.sample_time_s) + " s; structure " +
                 command.structure + ", trained on samples " + to_text(outcome.train_ranges) +
                 (outcome.test ? ", tested on samples " + to_text(outcome.test_ranges) : "") + ".");
  page.paragraph(blockid::to_text(fit.status) + " after " + std::to_string(fit.iterations) + " iterations from " +
                 outcome.found.how + "; standard deviation of e: " +
                 with_unit(number(std::sqrt(fit.model.noise_variance)), command.data.output_unit) + ".");
  for (const std::string& warning : outcome.warnings) page.warning(warning);
  if (!gnuplot) page.warning(kGnuplotMissing);
  page.heading("How good the model is");
  add_scores(page, outcome, command.data.output_unit);
  const Shown shown = shown_record(outcome.train, outcome.train_ranges, outcome.test, outcome.test_ranges);
  add_simulation(page, shown, gnuplot);
  page.heading("Frequency responses of the path G and of the noise H");
  add_response(page, fit, "G", &blockid::response, gnuplot);
  add_response(page, fit, "H", &blockid::noise_response, gnuplot);
  add_roots(page, fit.model, gnuplot);
  if (outcome.judgement) {
    page.paragraph("The tests below are of the errors one step ahead.");
    add_judgement(page, *outcome.judgement, command.data.output_unit, gnuplot);
  } else {
    page.heading("Residual tests");
    page.warning("Not made. " + outcome.not_judged);
  }
  add_coefficients(page, fit);
  return page.text();
}

}  // namespace blockid::cli
