#include <blockid/cli/closed_loop_outcome.hpp>
#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report_fit.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/transfer_function.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/load.hpp>
#include <blockid/validation/noise_estimate.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <sstream>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

/// Share of max|u| by which u = r - C y may fail before the user is told.
constexpr double kConsistent = 1e-3;

Range range_of(const char* option, const std::string& text, Index length) {
  try {
    return resolve(text.empty() ? Range{} : parse_range(text), length);
  } catch (const Error& error) {
    fail(option, " ", text, ": ", error.what());
  }
}

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

/// Input, output and reference (empty when there is none) of a part of the data, less the operating point.
struct LoopRecord {
  VectorXd u;
  VectorXd y;
  VectorXd r;
};

/// NAME, or GAIN*NAME.
VectorXd reference_of(const ClosedLoopCommand& command) {
  const std::string& text = *command.reference;
  const std::size_t star = text.find('*');
  double gain = 1.0;
  if (star != std::string::npos) {
    std::istringstream stream(text.substr(0, star));
    stream.imbue(std::locale::classic());
    if (!(stream >> gain) || !(stream >> std::ws).eof()) {
      fail("--reference ", text, ": expected NAME or GAIN*NAME with a number for GAIN");
    }
  }
  const std::string name = star == std::string::npos ? text : text.substr(star + 1);
  return gain * thinned(load_column(command.data.file, name), command.data.every);
}

VectorXd less_rest(const VectorXd& x, Index rest) {
  if (rest == 0 || x.size() == 0) return x;
  return x.array() - x.head(std::min(rest, x.size())).mean();
}

LoopRecord cut(const Record& whole, const VectorXd& reference, const Range& range, Index rest) {
  const Record part = slice(whole, range);
  if (!part.y.allFinite() || (part.weights.size() > 0 && !(part.weights.array() > 0.0).all())) {
    fail("closed-loop: expected an output without missing samples, since v needs them all");
  }
  LoopRecord record{less_rest(part.u, rest), less_rest(part.y, rest), {}};
  if (reference.size() > 0) {
    if (reference.size() != whole.u.size()) {
      fail("--reference: expected ", whole.u.size(), " samples as in the input, got ", reference.size());
    }
    record.r = less_rest(reference.segment(range.begin, range.end - range.begin), rest);
  }
  return record;
}

void set_noise(ClosedLoopOutcome& outcome, const ClosedLoopCommand& command, const UncertainLoop& loop,
               const Record& whole) {
  if (command.gamma) {
    outcome.noise_bound = *command.gamma;
    outcome.noise_source = "as given";
    return;
  }
  if (command.quiet_run.empty()) {
    outcome.noise_source = "none was given: w is taken as exact up to rounding";
    return;
  }
  const LoopRecord quiet =
      cut(whole, {}, range_of("--quiet-run", command.quiet_run, sample_count(whole)), command.rest);
  const NoiseEstimate noise = noise_from_quiet_run(loop, quiet.u, quiet.y, command.safety);
  outcome.noise_bound = noise.gamma;
  outcome.noise_source = number(command.safety) + " times the largest of the quiet run, samples " + command.quiet_run;
}

void check_reference(ClosedLoopOutcome& outcome, const LoopRecord& record) {
  if (record.r.size() == 0) return;
  outcome.reference =
      ReferenceCheck{reference_error(outcome.controller, record.u, record.y, record.r), record.u.cwiseAbs().maxCoeff()};
  if (outcome.reference->error <= kConsistent * outcome.reference->largest) return;
  outcome.warnings.push_back("u differs from r - C y by up to " +
                             number(100.0 * outcome.reference->error / outcome.reference->largest, 3) +
                             " % of the largest |u|: a saturation, another controller, a state at the start or another "
                             "sampling was at work, and the verdict takes it for the plant's");
}

void warn_of_notes(ClosedLoopOutcome& outcome) {
  const auto add = [&](const UncertaintyVerdict& verdict) {
    for (const VerdictNote& note : verdict.notes) {
      if (std::find(outcome.warnings.begin(), outcome.warnings.end(), note.text) == outcome.warnings.end()) {
        outcome.warnings.push_back(note.text);
      }
    }
  };
  if (outcome.whole) add(*outcome.whole);
  for (const WindowedVerdict& window : outcome.windows) add(window.window);
}

void run_tests(ClosedLoopOutcome& outcome, const ClosedLoopCommand& command) {
  const UncertaintySignals& signals = outcome.signals;
  const Index samples = signals.v.size();
  VerdictOptions options;
  options.memory = outcome.memory;
  options.programme.max_iterations = command.max_iterations;
  if (command.window > 0) {
    WindowPlan plan;
    plan.count = command.window;
    plan.step = command.step > 0 ? command.step : std::max<Index>(1, command.window / 2);
    plan.past = command.past;
    plan.longest = command.longest;
    outcome.windows = windowed_test(signals.v, signals.w, outcome.noise_bound, plan, options);
  } else {
    if (samples > command.longest) {
      fail("closed-loop: ", samples, " samples are more than --longest ", command.longest,
           " in one test; cut them with --range, judge them by --window N, or raise --longest");
    }
    outcome.whole = judge_uncertainty(cut_window(signals.v, signals.w, 0, samples, 0), outcome.noise_bound, options);
  }
  const Index first_part = std::min<Index>(samples, command.longest);
  if (command.curve) {
    outcome.curve = trade_off_curve(uncertainty_programme(cut_window(signals.v, signals.w, 0, first_part, 0)));
  }
}

void add_bands(ClosedLoopOutcome& outcome, const ClosedLoopCommand& command) {
  if (command.bands < 1) return;
  // Two decades up to a little below the Nyquist frequency, as far down as the record resolves.
  const Index samples = std::min<Index>(outcome.signals.v.size(), command.longest);
  const Index length = std::max<Index>(1, samples / 5);
  const double highest = 0.95 * std::numbers::pi;
  const double lowest = std::max(0.01 * highest, 2.0 * std::numbers::pi / static_cast<double>(length));
  const VectorXd omegas = VectorXd::LinSpaced(command.bands, std::log(lowest), std::log(highest)).array().exp();
  outcome.bands = band_bounds(outcome.signals.v.head(samples), outcome.signals.w.head(samples), omegas, length,
                              outcome.noise_bound);
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
  const LoadedRecord loaded = load(command.data, systems.sample_time_s);
  const Record& whole = loaded.record;
  const VectorXd reference = command.reference ? reference_of(command) : VectorXd();
  const Range range = range_of("--range", command.range, sample_count(whole));
  const LoopRecord record = cut(whole, reference, range, command.rest);

  ClosedLoopOutcome outcome{.source = command.data.file,
                            .range = blockid::to_text(range),
                            .sample_time_s = whole.sample_time_s,
                            .plant = systems.plant,
                            .controller = systems.controller,
                            .weight = systems.weight};
  outcome.warnings = loaded.warnings;
  outcome.signals = uncertainty_signals(loop, record.u, record.y);
  outcome.memory = command.memory >= 0 ? command.memory : uncertainty_memory(loop);
  check_reference(outcome, record);
  set_noise(outcome, command, loop, whole);
  run_tests(outcome, command);
  add_bands(outcome, command);
  warn_of_notes(outcome);

  for (const std::string& warning : outcome.warnings) std::cerr << "blockid: " << warning << '\n';
  if (!command.quiet) print_closed_loop(std::cout, outcome);
  if (!command.json.empty()) write_output(command.json, json_text(closed_loop_json(outcome)));
  if (!command.report.empty()) write_output(command.report, closed_loop_report(outcome));
  return exit_code(outcome.verdict());
}

}  // namespace blockid::cli
