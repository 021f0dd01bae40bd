// All that `blockid closed-loop` has found.
#pragma once

#include <blockid/validation/band_bound.hpp>
#include <blockid/validation/coprime_factors.hpp>
#include <blockid/validation/trade_off.hpp>
#include <blockid/validation/verdict.hpp>
#include <blockid/validation/windowed_test.hpp>

#include <nlohmann/json.hpp>

#include <iosfwd>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// Whether u = r - C y holds in the record.
struct ReferenceCheck {
  double error = 0.0;    ///< max |C y + u - r|
  double largest = 0.0;  ///< max |u|
  /// Samples at the start for which C needs y from before the record, and the error behind them.
  Eigen::Index start = 0;
  double error_behind_start = 0.0;
};

/// One record of the loop.
struct ClosedLoopExperiment {
  std::string source = {};
  std::string range = {};
  UncertaintySignals signals = {};
  std::optional<ReferenceCheck> reference = std::nullopt;
  double noise_bound = 0.0;
  /// Where the noise bound came from, in words.
  std::string noise_source = {};
  /// max |w - Delta v| of the Delta that was found for all experiments; NaN when they were judged window by window.
  double noise_left = std::numeric_limits<double>::quiet_NaN();
  std::vector<WindowedVerdict> windows = {};
  std::vector<BandBound> bands = {};
};

struct ClosedLoopOutcome {
  double sample_time_s = 1.0;
  DiscreteTransferFunction plant = {};
  DiscreteTransferFunction controller = {};
  DiscreteTransferFunction weight = {};
  Eigen::Index memory = 0;
  std::vector<ClosedLoopExperiment> experiments = {};
  /// Of all records, each as a whole, with one Delta; none when they were judged window by window.
  std::optional<UncertaintyVerdict> whole = std::nullopt;
  /// Over the largest of the noise bounds, the others in proportion.
  std::optional<TradeOffCurve> curve = std::nullopt;
  std::vector<std::string> warnings = {};

  /// The largest of the experiments'.
  double noise_bound() const;
  /// Invalidated when one of the tests says so; otherwise undecided when one is.
  Verdict verdict() const;
};

/// "the first sample", "the first 3 samples".
std::string start_text(const ReferenceCheck& check);

/// The verdict and its evidence; of windows, how many say what.
std::string evidence_text(const ClosedLoopOutcome& outcome);

void print_closed_loop(std::ostream& stream, const ClosedLoopOutcome& outcome);
nlohmann::ordered_json closed_loop_json(const ClosedLoopOutcome& outcome);
/// The report as one HTML file.
std::string closed_loop_report(const ClosedLoopOutcome& outcome);

}  // namespace blockid::cli
