#include <blockid/cli/closed_loop_outcome.hpp>

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/cli/transfer_function.hpp>

#include <algorithm>
#include <ostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;
using Align = TextTable::Align;

std::vector<Verdict> verdicts(const ClosedLoopOutcome& outcome) {
  std::vector<Verdict> all;
  if (outcome.whole) all.push_back(outcome.whole->verdict);
  for (const WindowedVerdict& window : outcome.windows) {
    all.push_back(window.window.verdict);
    if (window.record) all.push_back(window.record->verdict);
  }
  return all;
}

int count(const ClosedLoopOutcome& outcome, Verdict verdict) {
  return static_cast<int>(std::count_if(outcome.windows.begin(), outcome.windows.end(),
                                        [&](const WindowedVerdict& w) { return w.window.verdict == verdict; }));
}

/// Records up to a window's end that contradict the model.
int records_invalidated(const ClosedLoopOutcome& outcome) {
  return static_cast<int>(std::count_if(outcome.windows.begin(), outcome.windows.end(), [](const WindowedVerdict& w) {
    return w.record && w.record->verdict == Verdict::invalidated;
  }));
}

void print_windows(std::ostream& stream, const ClosedLoopOutcome& outcome) {
  if (outcome.windows.empty()) return;
  TextTable table{{{"from sample"},
                   {"past"},
                   {"window", Align::left},
                   {"noise needed"},
                   {"noise proven"},
                   {"record to its end", Align::left}},
                  {}};
  for (const WindowedVerdict& w : outcome.windows) {
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

void print_bands(std::ostream& stream, const ClosedLoopOutcome& outcome) {
  if (outcome.bands.empty()) return;
  TextTable table{{{"rad/sample"}, {"|Delta| at least"}, {"mean of the band"}, {"spread"}, {"|V| at least"}}, {}};
  for (const BandBound& band : outcome.bands) {
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

}  // namespace

Verdict ClosedLoopOutcome::verdict() const {
  const std::vector<Verdict> all = verdicts(*this);
  for (const Verdict verdict : {Verdict::invalidated, Verdict::undecided}) {
    if (std::find(all.begin(), all.end(), verdict) != all.end()) return verdict;
  }
  return Verdict::not_invalidated;
}

std::string evidence_text(const ClosedLoopOutcome& outcome) {
  if (outcome.whole) return outcome.whole->evidence;
  return std::to_string(count(outcome, Verdict::invalidated)) + " of " + std::to_string(outcome.windows.size()) +
         " windows invalidated, " + std::to_string(count(outcome, Verdict::undecided)) + " undecided; " +
         std::to_string(records_invalidated(outcome)) + " records from the start to a window's end invalidated";
}

void print_closed_loop(std::ostream& stream, const ClosedLoopOutcome& outcome) {
  stream << outcome.source << ", samples " << outcome.range << ", sampled every " << number(outcome.sample_time_s)
         << " s\n"
         << "plant       " << to_text(outcome.plant) << '\n'
         << "controller  " << to_text(outcome.controller) << '\n'
         << "weight      " << to_text(outcome.weight) << '\n'
         << "v, w        largest " << number(outcome.signals.v.cwiseAbs().maxCoeff(), 4) << " and "
         << number(outcome.signals.w.cwiseAbs().maxCoeff(), 4) << "; memory " << outcome.memory << " samples\n"
         << "noise       " << number(outcome.noise_bound, 4) << ", " << outcome.noise_source << '\n';
  if (outcome.reference) {
    stream << "u = r - C y to within " << number(outcome.reference->error, 3) << " of a largest |u| of "
           << number(outcome.reference->largest, 4) << '\n';
  }
  stream << "verdict     " << to_text(outcome.verdict()) << '\n' << evidence_text(outcome) << '\n';
  print_windows(stream, outcome);
  if (outcome.curve) print_curve(stream, *outcome.curve);
  print_bands(stream, outcome);
}

nlohmann::ordered_json closed_loop_json(const ClosedLoopOutcome& outcome) {
  Json result = {{"format", "blockid-closed-loop"},
                 {"version", BLOCKID_VERSION},
                 {"data", outcome.source},
                 {"range", outcome.range},
                 {"sample_time_s", outcome.sample_time_s},
                 {"plant", to_text(outcome.plant)},
                 {"controller", to_text(outcome.controller)},
                 {"weight", to_text(outcome.weight)},
                 {"verdict", to_text(outcome.verdict())},
                 {"evidence", evidence_text(outcome)},
                 {"noise_bound", finite_or_null(outcome.noise_bound)},
                 {"noise_source", outcome.noise_source},
                 {"memory", outcome.memory},
                 {"largest_v", finite_or_null(outcome.signals.v.cwiseAbs().maxCoeff())},
                 {"largest_w", finite_or_null(outcome.signals.w.cwiseAbs().maxCoeff())}};
  if (outcome.reference) {
    result["reference_check"] = {{"error", finite_or_null(outcome.reference->error)},
                                 {"largest_input", finite_or_null(outcome.reference->largest)}};
  }
  if (outcome.whole) result["whole"] = json_of(*outcome.whole);
  if (!outcome.windows.empty()) {
    Json windows = Json::array();
    for (const WindowedVerdict& w : outcome.windows) {
      Json entry = {{"first", w.first}, {"past", w.past}, {"window", json_of(w.window)}};
      entry["record"] = w.record ? json_of(*w.record) : Json(nullptr);
      windows.push_back(entry);
    }
    result["windows"] = windows;
  }
  if (outcome.curve) result["curve"] = json_of(*outcome.curve);
  if (!outcome.bands.empty()) {
    Json bands = Json::array();
    for (const BandBound& band : outcome.bands) {
      bands.push_back({{"omega", band.omega},
                       {"gain", finite_or_null(band.gain)},
                       {"mean_omega", finite_or_null(band.mean_omega)},
                       {"spread_omega", finite_or_null(band.spread_omega)},
                       {"weight_needed", finite_or_null(band.gain * magnitude(outcome.weight, band.mean_omega))}});
    }
    result["bands"] = bands;
  }
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace blockid::cli
