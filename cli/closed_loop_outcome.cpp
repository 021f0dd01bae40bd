#include <blockid/cli/closed_loop_outcome.hpp>

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/transfer_function.hpp>

#include <algorithm>
#include <ostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

std::vector<WindowedVerdict> all_windows(const ClosedLoopOutcome& outcome) {
  std::vector<WindowedVerdict> all;
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    all.insert(all.end(), one.windows.begin(), one.windows.end());
  }
  return all;
}

std::vector<Verdict> verdicts(const ClosedLoopOutcome& outcome) {
  std::vector<Verdict> all;
  if (outcome.whole) all.push_back(outcome.whole->verdict);
  for (const WindowedVerdict& window : all_windows(outcome)) {
    all.push_back(window.window.verdict);
    if (window.record) all.push_back(window.record->verdict);
  }
  return all;
}

Index count(const std::vector<WindowedVerdict>& windows, Verdict verdict) {
  return std::count_if(windows.begin(), windows.end(),
                       [&](const WindowedVerdict& w) { return w.window.verdict == verdict; });
}

/// Records up to a window's end that contradict the model.
Index records_invalidated(const std::vector<WindowedVerdict>& windows) {
  return std::count_if(windows.begin(), windows.end(),
                       [](const WindowedVerdict& w) { return w.record && w.record->verdict == Verdict::invalidated; });
}

void print_windows(std::ostream& stream, const ClosedLoopExperiment& one) {
  if (one.windows.empty()) return;
  TextTable table{{{"from sample"},
                   {"past"},
                   {"window", Align::left},
                   {"noise needed"},
                   {"noise proven"},
                   {"record to its end", Align::left}},
                  {}};
  for (const WindowedVerdict& w : one.windows) {
    table.rows.push_back({std::to_string(w.first), std::to_string(w.past), to_text(w.window.verdict),
                          number(w.window.noise_needed, 4), number(w.window.noise_proven, 4),
                          w.record ? to_text(w.record->verdict) : "-"});
  }
  print(stream, table);
}

void print_curve(std::ostream& stream, const TradeOffCurve& curve) {
  TextTable table{{{"noise bound"}, {"uncertainty"}, {"slope"}}, {}};
  for (const TradeOffPoint& point : curve.points) {
    table.rows.push_back({number(point.gamma, 4), number(point.alpha, 5), number(point.slope, 4)});
  }
  print(stream, table);
  stream << "least noise bound that does not invalidate " << number(curve.least_noise, 5) << ", noise floor "
         << number(curve.noise_floor, 5);
  if (curve.elbow) stream << ", elbow at " << number(curve.elbow->gamma, 4);
  stream << '\n';
}

void print_bands(std::ostream& stream, const ClosedLoopOutcome& outcome, const ClosedLoopExperiment& one) {
  if (one.bands.empty()) return;
  TextTable table{{{"rad/sample"}, {"|Delta| at least"}, {"mean of the band"}, {"spread"}, {"|V| at least"}}, {}};
  for (const BandBound& band : one.bands) {
    table.rows.push_back({number(band.omega, 4), number(band.gain, 4), number(band.mean_omega, 4),
                          number(band.spread_omega, 3),
                          number(band.gain * magnitude(outcome.weight, band.mean_omega), 4)});
  }
  print(stream, table);
}

Json json_of(const UncertaintyVerdict& verdict) {
  Json notes = Json::array();
  for (const VerdictNote& note : verdict.notes) notes.push_back(note.text);
  return {{"verdict", to_text(verdict.verdict)},
          {"evidence", verdict.evidence},
          {"notes", notes},
          {"noise_bound", finite_or_null(verdict.noise_bound)},
          {"noise_needed", finite_or_null(verdict.noise_needed)},
          {"noise_proven", finite_or_null(verdict.noise_proven)},
          {"alpha_proven", finite_or_null(verdict.alpha_proven)}};
}

Json json_of(const TradeOffCurve& curve) {
  Json points = Json::array();
  for (const TradeOffPoint& point : curve.points) {
    points.push_back({{"gamma", finite_or_null(point.gamma)},
                      {"alpha", finite_or_null(point.alpha)},
                      {"alpha_proven", finite_or_null(point.alpha_proven)},
                      {"slope", finite_or_null(point.slope)}});
  }
  Json result = {{"points", points},
                 {"least_noise", finite_or_null(curve.least_noise)},
                 {"noise_floor", finite_or_null(curve.noise_floor)}};
  result["elbow"] = curve.elbow ? finite_or_null(curve.elbow->gamma) : Json(nullptr);
  return result;
}

void print_signals(std::ostream& stream, const ClosedLoopExperiment& one, Index memory) {
  stream << "v, w        largest " << number(one.signals.v.cwiseAbs().maxCoeff(), 4) << " and "
         << number(one.signals.w.cwiseAbs().maxCoeff(), 4) << "; memory " << memory << " samples\n"
         << "noise       " << number(one.noise_bound, 4) << ", " << one.noise_source << '\n';
  if (one.reference) {
    stream << "u = r - C y to within " << number(one.reference->error, 3) << " of a largest |u| of "
           << number(one.reference->largest, 4);
    if (one.reference->start > 0) {
      stream << ", behind " << start_text(*one.reference) << " to within "
             << number(one.reference->error_behind_start, 3);
    }
    stream << '\n';
  }
}

std::string sampling_text(const ClosedLoopOutcome& outcome) {
  return "sampled every " + number(outcome.sample_time_s) + " s";
}

std::string name_of(const ClosedLoopExperiment& one) { return one.source + ", samples " + one.range; }

Json reference_json(const ReferenceCheck& reference) {
  return {{"error", finite_or_null(reference.error)},
          {"largest_input", finite_or_null(reference.largest)},
          {"start_samples", reference.start},
          {"error_behind_start", finite_or_null(reference.error_behind_start)}};
}

Json json_of(const ClosedLoopExperiment& one) {
  Json result = {{"data", one.source},
                 {"range", one.range},
                 {"samples", one.signals.v.size()},
                 {"noise_bound", finite_or_null(one.noise_bound)},
                 {"noise_source", one.noise_source},
                 {"noise_left", finite_or_null(one.noise_left)},
                 {"largest_v", finite_or_null(one.signals.v.cwiseAbs().maxCoeff())},
                 {"largest_w", finite_or_null(one.signals.w.cwiseAbs().maxCoeff())}};
  if (one.reference) result["reference_check"] = reference_json(*one.reference);
  return result;
}

/// The values of all experiments between ", ", each once.
template <class F>
std::string each_once(const ClosedLoopOutcome& outcome, F&& text_of) {
  std::vector<std::string> all;
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    const std::string text = text_of(one);
    if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
  }
  return joined(all);
}

template <class F>
double largest(const ClosedLoopOutcome& outcome, F&& value_of) {
  double result = 0.0;
  for (const ClosedLoopExperiment& one : outcome.experiments) result = std::max(result, value_of(one));
  return result;
}

/// The one that is worst in units of its input; none without references.
const ReferenceCheck* worst_reference(const ClosedLoopOutcome& outcome) {
  const ReferenceCheck* worst = nullptr;
  for (const ClosedLoopExperiment& one : outcome.experiments) {
    if (!one.reference) continue;
    if (!worst || one.reference->error * worst->largest > worst->error * one.reference->largest) {
      worst = &*one.reference;
    }
  }
  return worst;
}

Json windows_json(const ClosedLoopOutcome& outcome) {
  Json windows = Json::array();
  for (std::size_t i = 0; i < outcome.experiments.size(); ++i) {
    for (const WindowedVerdict& w : outcome.experiments[i].windows) {
      Json entry = {{"experiment", i}, {"first", w.first}, {"past", w.past}, {"window", json_of(w.window)}};
      entry["record"] = w.record ? json_of(*w.record) : Json(nullptr);
      windows.push_back(entry);
    }
  }
  return windows;
}

Json bands_json(const ClosedLoopOutcome& outcome) {
  Json bands = Json::array();
  for (std::size_t i = 0; i < outcome.experiments.size(); ++i) {
    for (const BandBound& band : outcome.experiments[i].bands) {
      bands.push_back({{"experiment", i},
                       {"omega", band.omega},
                       {"gain", finite_or_null(band.gain)},
                       {"mean_omega", finite_or_null(band.mean_omega)},
                       {"spread_omega", finite_or_null(band.spread_omega)},
                       {"weight_needed", finite_or_null(band.gain * magnitude(outcome.weight, band.mean_omega))}});
    }
  }
  return bands;
}

}  // namespace

double ClosedLoopOutcome::noise_bound() const {
  return largest(*this, [](const ClosedLoopExperiment& one) { return one.noise_bound; });
}

Verdict ClosedLoopOutcome::verdict() const {
  const std::vector<Verdict> all = verdicts(*this);
  for (const Verdict verdict : {Verdict::invalidated, Verdict::undecided}) {
    if (std::find(all.begin(), all.end(), verdict) != all.end()) return verdict;
  }
  return Verdict::not_invalidated;
}

std::string start_text(const ReferenceCheck& check) {
  return check.start == 1 ? "the first sample" : "the first " + std::to_string(check.start) + " samples";
}

std::string evidence_text(const ClosedLoopOutcome& outcome) {
  if (outcome.whole) {
    const bool alike = std::all_of(outcome.experiments.begin(), outcome.experiments.end(),
                                   [&](const auto& one) { return one.noise_bound == outcome.noise_bound(); });
    return outcome.whole->evidence +
           (alike ? "" : " Where an experiment has a smaller noise bound, the noise is less in proportion.");
  }
  const std::vector<WindowedVerdict> windows = all_windows(outcome);
  return std::to_string(count(windows, Verdict::invalidated)) + " of " + std::to_string(windows.size()) +
         " windows invalidated, " + std::to_string(count(windows, Verdict::undecided)) + " undecided; " +
         std::to_string(records_invalidated(windows)) + " records from the start to a window's end invalidated";
}

void print_closed_loop(std::ostream& stream, const ClosedLoopOutcome& outcome) {
  const bool one = outcome.experiments.size() == 1;
  const std::string title =
      one ? name_of(outcome.experiments.front()) : std::to_string(outcome.experiments.size()) + " experiments";
  stream << title << ", " << sampling_text(outcome) << '\n'
         << "plant       " << to_text(outcome.plant) << '\n'
         << "controller  " << to_text(outcome.controller) << '\n'
         << "weight      " << to_text(outcome.weight) << '\n';
  for (const ClosedLoopExperiment& experiment : outcome.experiments) {
    if (!one) stream << name_of(experiment) << '\n';
    print_signals(stream, experiment, outcome.memory);
    if (!one && outcome.whole) stream << "left        " << number(experiment.noise_left, 4) << '\n';
  }
  stream << "verdict     " << to_text(outcome.verdict()) << '\n' << evidence_text(outcome) << '\n';
  if (outcome.curve) print_curve(stream, *outcome.curve);
  for (const ClosedLoopExperiment& experiment : outcome.experiments) {
    if (!one && !(experiment.windows.empty() && experiment.bands.empty())) stream << name_of(experiment) << '\n';
    print_windows(stream, experiment);
    print_bands(stream, outcome, experiment);
  }
}

nlohmann::ordered_json closed_loop_json(const ClosedLoopOutcome& outcome) {
  Json experiments = Json::array();
  for (const ClosedLoopExperiment& one : outcome.experiments) experiments.push_back(json_of(one));
  Json result = {
      {"format", "blockid-closed-loop"},
      {"version", BLOCKID_VERSION},
      {"data", each_once(outcome, [](const ClosedLoopExperiment& one) { return one.source; })},
      {"range", each_once(outcome, [](const ClosedLoopExperiment& one) { return one.range; })},
      {"sample_time_s", outcome.sample_time_s},
      {"plant", to_text(outcome.plant)},
      {"controller", to_text(outcome.controller)},
      {"weight", to_text(outcome.weight)},
      {"verdict", to_text(outcome.verdict())},
      {"evidence", evidence_text(outcome)},
      {"noise_bound", finite_or_null(outcome.noise_bound())},
      {"noise_source", each_once(outcome, [](const ClosedLoopExperiment& one) { return one.noise_source; })},
      {"memory", outcome.memory},
      {"largest_v", finite_or_null(largest(
                        outcome, [](const ClosedLoopExperiment& one) { return one.signals.v.cwiseAbs().maxCoeff(); }))},
      {"largest_w", finite_or_null(largest(outcome, [](const ClosedLoopExperiment& one) {
         return one.signals.w.cwiseAbs().maxCoeff();
       }))}};
  if (const ReferenceCheck* reference = worst_reference(outcome))
    result["reference_check"] = reference_json(*reference);
  result["experiments"] = experiments;
  if (outcome.whole) result["whole"] = json_of(*outcome.whole);
  if (const Json windows = windows_json(outcome); !windows.empty()) result["windows"] = windows;
  if (outcome.curve) result["curve"] = json_of(*outcome.curve);
  if (const Json bands = bands_json(outcome); !bands.empty()) result["bands"] = bands;
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace blockid::cli
