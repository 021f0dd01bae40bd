#include <blockid/cli/closed_loop_outcome.hpp>
#include <blockid/cli/closed_loop_records.hpp>
#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report_fit.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/transfer_function.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/noise_estimate.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

/// Share of max|u| by which u = r - C y may fail before the user is told.
constexpr double kConsistent = 1e-3;

/// The systems with the sample time of those that come from files.
struct Systems {
  DiscreteTransferFunction plant;
  DiscreteTransferFunction controller;
  DiscreteTransferFunction weight;
  std::optional<double> sample_time_s;
};

Systems systems_of(const ClosedLoopCommand& command) {
  const NamedTransferFunction plant = transfer_function("--plant", command.plant);
  const NamedTransferFunction controller = transfer_function("--controller", command.controller);
  const NamedTransferFunction weight = transfer_function("--weight", command.weight);
  Systems result{plant.system, controller.system, weight.system, std::nullopt};
  for (const NamedTransferFunction* one : {&plant, &controller, &weight}) {
    if (!one->sample_time_s) continue;
    constexpr double kSame = 1e-6;
    if (result.sample_time_s && std::abs(*one->sample_time_s / *result.sample_time_s - 1.0) > kSame) {
      fail("closed-loop: the model files are sampled every ", *result.sample_time_s, " s and every ",
           *one->sample_time_s, " s; expected one sample time");
    }
    result.sample_time_s = one->sample_time_s;
  }
  return result;
}

void set_noise(ClosedLoopExperiment& one, const LoopExperiment& given, const ClosedLoopCommand& command,
               const UncertainLoop& loop) {
  if (given.gamma) {
    one.noise_bound = *given.gamma;
    one.noise_source = "as given";
    return;
  }
  if (!given.quiet) {
    one.noise_source = "none was given: w is taken as exact up to rounding";
    return;
  }
  one.noise_bound = noise_from_quiet_run(loop, given.quiet->u, given.quiet->y, command.safety).gamma;
  one.noise_source = number(command.safety) + " times the largest of the quiet run, samples " + given.quiet_range;
}

/// In front of a message about one experiment of several.
std::string prefix(const ClosedLoopOutcome& outcome, const ClosedLoopExperiment& one) {
  return outcome.experiments.size() < 2 ? "" : one.source + ", samples " + one.range + ": ";
}

std::string percent(double part, double whole) { return number(100.0 * part / whole, 3) + " %"; }

void check_reference(ClosedLoopOutcome& outcome, ClosedLoopExperiment& one, const LoopRecord& record) {
  if (record.r.size() == 0) return;
  const DiscreteTransferFunction& c = outcome.controller;
  ReferenceCheck check;
  check.error = reference_error(c, record.u, record.y, record.r);
  check.largest = record.u.cwiseAbs().maxCoeff();
  check.start = std::max(c.numerator.size(), c.denominator.size()) - 1;
  check.error_behind_start = reference_error(c, record.u, record.y, record.r, check.start);
  one.reference = check;
  if (check.error <= kConsistent * check.largest) return;
  std::string behind;
  if (check.start > 0) {
    behind = ", and by up to " + percent(check.error_behind_start, check.largest) + " behind " + start_text(check) +
             ", for which C needs the output before the record";
  }
  outcome.warnings.push_back(prefix(outcome, one) + "u differs from r - C y by up to " +
                             percent(check.error, check.largest) + " of the largest |u|" + behind +
                             ": a saturation, another controller, a state at the start or another sampling was at "
                             "work, and the verdict takes it for the plant's");
}

void warn_once(ClosedLoopOutcome& outcome, const std::string& text) {
  if (std::find(outcome.warnings.begin(), outcome.warnings.end(), text) == outcome.warnings.end()) {
    outcome.warnings.push_back(text);
  }
}

void warn_of_notes(ClosedLoopOutcome& outcome) {
  if (outcome.whole) {
    for (const VerdictNote& note : outcome.whole->notes) warn_once(outcome, note.text);
  }
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    for (const WindowedVerdict& window : one.windows) {
      for (const VerdictNote& note : window.window.notes) warn_once(outcome, prefix(outcome, one) + note.text);
    }
  }
}

/// The first samples of each experiment, with its noise bound in units of the largest.
std::vector<UncertaintyWindow> windows_of(const ClosedLoopOutcome& outcome, Index longest) {
  std::vector<UncertaintyWindow> windows;
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    const Index samples = std::min<Index>(one.signals.v.size(), longest);
    VectorXd shape;
    if (outcome.noise_bound() > 0.0) {
      shape = VectorXd::Constant(one.signals.v.size(), one.noise_bound / outcome.noise_bound());
    }
    windows.push_back(cut_window(one.signals.v, one.signals.w, 0, samples, 0, shape));
  }
  return windows;
}

/// max |w - h * v| of each experiment, h of the Delta that was found for all of them.
void set_remainders(ClosedLoopOutcome& outcome) {
  const VectorXd& h = outcome.whole->h;
  for (ClosedLoopExperiment& one : outcome.experiments) {
    const DiscreteTransferFunction fir{h, VectorXd::Ones(1)};
    one.noise_left = (one.signals.w - filter(fir, one.signals.v)).cwiseAbs().maxCoeff();
  }
}

void judge_whole(ClosedLoopOutcome& outcome, const ClosedLoopCommand& command, const VerdictOptions& options) {
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    const Index samples = one.signals.v.size();
    if (samples <= command.longest) continue;
    fail(prefix(outcome, one), "closed-loop: ", samples, " samples are more than --longest ", command.longest,
         " in one test; cut them with --range, judge them by --window N, or raise --longest");
  }
  outcome.whole = judge_uncertainty(windows_of(outcome, command.longest), outcome.noise_bound(), options);
  set_remainders(outcome);
}

void judge_windows(ClosedLoopOutcome& outcome, const ClosedLoopCommand& command, const VerdictOptions& options) {
  WindowPlan plan;
  plan.count = command.window;
  plan.step = command.step > 0 ? command.step : std::max<Index>(1, command.window / 2);
  plan.past = command.past;
  plan.longest = command.longest;
  for (ClosedLoopExperiment& one : outcome.experiments) {
    one.windows = windowed_test(one.signals.v, one.signals.w, one.noise_bound, plan, options);
  }
}

void run_tests(ClosedLoopOutcome& outcome, const ClosedLoopCommand& command) {
  VerdictOptions options;
  options.memory = outcome.memory;
  options.programme.max_iterations = command.max_iterations;
  if (command.window > 0) {
    judge_windows(outcome, command, options);
  } else {
    judge_whole(outcome, command, options);
  }
  if (command.curve) outcome.curve = trade_off_curve(uncertainty_programme(windows_of(outcome, command.longest)));
}

void add_bands(ClosedLoopExperiment& one, const ClosedLoopCommand& command) {
  if (command.bands < 1) return;
  // Two decades up to a little below the Nyquist frequency, as far down as the record resolves.
  const Index samples = std::min<Index>(one.signals.v.size(), command.longest);
  const Index length = std::max<Index>(1, samples / 5);
  const double highest = 0.95 * std::numbers::pi;
  const double lowest = std::max(0.01 * highest, 2.0 * std::numbers::pi / static_cast<double>(length));
  const VectorXd omegas = VectorXd::LinSpaced(command.bands, std::log(lowest), std::log(highest)).array().exp();
  one.bands = band_bounds(one.signals.v.head(samples), one.signals.w.head(samples), omegas, length, one.noise_bound);
}

/// One Delta for all, each with its own noise: none may be exact while another is not.
void check_noise(const ClosedLoopOutcome& outcome) {
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    if (one.noise_bound > 0.0 || outcome.noise_bound() == 0.0) continue;
    fail(prefix(outcome, one), "expected a noise bound above 0, as another experiment has, got 0");
  }
}

int exit_code(Verdict verdict) {
  switch (verdict) {
    case Verdict::not_invalidated:
      return kSuccess;
    case Verdict::invalidated:
      return kInvalidated;
    case Verdict::undecided:
      return kUndecided;
  }
  return kInternalError;
}

}  // namespace

int run_closed_loop(const ClosedLoopCommand& command) {
  const Systems systems = systems_of(command);
  const UncertainLoop loop{coprime_factors(systems.plant, command.factor_pole),
                           coprime_factors(systems.controller, command.factor_pole), systems.weight};
  check(loop);
  check_outputs({command.json, command.report});
  if (!command.report.empty()) announce_missing_gnuplot(std::cerr);
  const std::vector<LoopExperiment> given = loop_experiments(command, systems.sample_time_s);

  ClosedLoopOutcome outcome{.sample_time_s = given.front().sample_time_s,
                            .plant = systems.plant,
                            .controller = systems.controller,
                            .weight = systems.weight};
  outcome.memory = command.memory >= 0 ? command.memory : uncertainty_memory(loop);
  for (const LoopExperiment& one : given) outcome.experiments.push_back({.source = one.source, .range = one.range});
  for (std::size_t i = 0; i < given.size(); ++i) {
    ClosedLoopExperiment& one = outcome.experiments[i];
    for (const std::string& warning : given[i].warnings) warn_once(outcome, warning);
    one.signals = uncertainty_signals(loop, given[i].record.u, given[i].record.y);
    check_reference(outcome, one, given[i].record);
    set_noise(one, given[i], command, loop);
    add_bands(one, command);
  }
  check_noise(outcome);
  run_tests(outcome, command);
  warn_of_notes(outcome);

  for (const std::string& warning : outcome.warnings) std::cerr << "blockid: " << warning << '\n';
  if (!command.quiet) print_closed_loop(std::cout, outcome);
  if (!command.json.empty()) write_output(command.json, json_text(closed_loop_json(outcome)));
  if (!command.report.empty()) write_output(command.report, closed_loop_report(outcome));
  return exit_code(outcome.verdict());
}

}  // namespace blockid::cli
