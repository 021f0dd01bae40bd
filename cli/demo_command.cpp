#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/initialisers.hpp>
#include <blockid/cli/interrupt.hpp>
#include <blockid/cli/judgement.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/progress_display.hpp>
#include <blockid/cli/report_fit.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/gauges.hpp>
#include <blockid/problems/synthetic_wh.hpp>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <utility>

namespace blockid::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kChain = "G1=rational(nb=3,na=3) | f=polynomial(degree=5) | G2=rational(nb=3,na=3)";
constexpr double kSecondsBetweenLines = 0.25;

/// The truth's numbers in the coordinates of the model: gains by the same convention, the polynomial over the range
/// that the model's has.
Eigen::VectorXd comparable_truth(const Model& truth, const Model& model) {
  const Model normal = normalise(truth);
  const std::vector<ChildParameters> parts = top_level_blocks(normal);
  const std::vector<ChildParameters> fitted = top_level_blocks(model);
  Eigen::VectorXd result = Eigen::VectorXd::Constant(model.parameters.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 0; k < fitted.size(); ++k) {
    Eigen::VectorXd part = parts[k].parameters;
    const auto* from = parts[k].block.target<Polynomial>();
    const auto* to = fitted[k].block.target<Polynomial>();
    if (from != nullptr && to != nullptr) part = to->from_powers(from->to_powers(part));
    result.segment(fitted[k].offset, part.size()) = part;
  }
  return result;
}

void print_parameters(const FitOutcome& outcome, const Eigen::VectorXd& truth) {
  const Model& model = outcome.model();
  std::cout << "\nparameters  " << free_count(outcome) << " free of " << model.parameters.size()
            << ", beside the truth in the same coordinates\n";
  TextTable table{{{"name", Align::left},
                   {"value", Align::right},
                   {"standard deviation", Align::right},
                   {"truth", Align::right},
                   {"error / deviation", Align::right}},
                  {}};
  const std::vector<std::string> names = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    const bool known = is_free(outcome, k) && model.standard_deviations.size() > 0;
    const double deviation = known ? model.standard_deviations[k] : 0.0;
    table.rows.push_back({names[static_cast<std::size_t>(k)], number(model.parameters[k], 7),
                          known ? number(deviation, 3) : "held", number(truth[k], 7),
                          known ? fixed_number((model.parameters[k] - truth[k]) / deviation, 2) : "-"});
  }
  print(std::cout, table);
}

void print_noise(const FitOutcome& outcome, double noise) {
  std::cout << "  noise in the data " << with_unit(number(noise), outcome.output_unit)
            << "; test RMSE / noise = " << fixed_number(outcome.test->total.rmse / noise, 4) << '\n';
}

nlohmann::ordered_json json_of(const FitOutcome& outcome, const FitJudgement& tests, const Eigen::VectorXd& truth,
                               double noise) {
  nlohmann::ordered_json result = fit_json(outcome, tests);
  for (Index k = 0; k < truth.size(); ++k) {
    result["parameter_table"][static_cast<std::size_t>(k)]["truth"] = finite_or_null(truth[k]);
  }
  result["true_noise_standard_deviation"] = noise;
  return result;
}

}  // namespace

int run_demo(const DemoCommand& command) {
  const fs::path folder = command.output_dir;
  make_folder(folder);
  const std::string model_file = (folder / "model.json").string();
  const std::string json_file = (folder / "result.json").string();
  const std::string report_file = (folder / "report.html").string();
  check_outputs({model_file, json_file, report_file});
  announce_missing_gnuplot(std::cerr);

  problems::SyntheticWienerHammersteinOptions synthetic;
  synthetic.seed = command.run.seed;
  const problems::Problem problem = problems::synthetic_wiener_hammerstein(synthetic);
  const SplitData data{problem.train, problem.test, {{0, synthetic.train_samples}}, {{0, synthetic.test_samples}}, {}};
  const PredictionOptions prediction{InitialState::zero, problem.warmup, 1};
  if (!command.run.quiet) {
    std::cout << "synthetic problem: " << problem.description << '\n'
              << "truth  " << blockid::to_text(problem.truth->chain) << '\n'
              << std::flush;
  }

  FitOptions options;
  options.refit.prediction = prediction;
  options.seed = command.run.seed;
  options.threads = thread_count(command.run);
  const InterruptGuard guard;
  FitResult fit = [&] {
    ProgressDisplay display(progress_style(command.run.quiet), std::cerr, problem.unit, kSecondsBetweenLines);
    options.progress = [&display](const Progress& progress) { return display(progress); };
    return blockid::fit(parse(kChain), data.train, initialiser_by_name("split"), options);
  }();

  FitOutcome outcome = make_outcome(std::move(fit), data, prediction, {});
  outcome.source = problem.name;
  outcome.requested_model = kChain;
  outcome.init = "split";
  outcome.seed = command.run.seed;
  outcome.threads = options.threads;
  const Eigen::VectorXd truth = comparable_truth(*problem.truth, outcome.model());
  if (!command.run.quiet) {
    print_task(std::cout, outcome);
    print_candidates(std::cout, outcome);
    print_metrics(std::cout, outcome);
    print_noise(outcome, problem.noise_std);
    print_parameters(outcome, truth);
    for (const std::string& warning : outcome.warnings) std::cout << "warning: " << warning << '\n';
    std::cout.flush();
  }
  const FitJudgement tests = judge_fit(outcome);
  write_output(model_file, to_json(outcome.model()));
  write_output(json_file, json_text(json_of(outcome, tests, truth, problem.noise_std)));
  write_output(report_file, fit_report(outcome, tests));
  if (!command.run.quiet) {
    std::cout << "\nwritten: " << model_file << ", " << json_file << ", " << report_file << '\n';
  }
  return exit_code(outcome);
}

}  // namespace blockid::cli
