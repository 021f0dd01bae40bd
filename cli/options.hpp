// The command line as structs: one a command, filled by program.cpp.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// Where the samples come from.
struct DataOptions {
  std::string file;
  std::string input;
  std::optional<std::string> output;
  std::optional<double> rate_hz;
  std::optional<double> sample_time_s;
  std::optional<std::string> rate_from;
  std::optional<std::string> sample_time_from;
  /// Time stamps in seconds.
  std::optional<std::string> time_from;
  bool allow_missing = false;
  std::string input_unit;
  std::string output_unit;
  /// Samples in one period of the input; 0 when aperiodic.
  std::int64_t period = 0;
  /// Every so many samples of the file are taken.
  std::int64_t every = 1;
};

/// How predictions start and what is scored.
struct ScoringOptions {
  std::int64_t warmup = 0;
  /// zero, estimated, periodic; simulate knows `model` besides.
  std::string initial_state = "zero";
};

struct RangeOptions {
  std::vector<std::string> train;
  std::vector<std::string> test;
};

struct RunOptions {
  std::uint64_t seed = 1;
  /// 0: as many as the machine has processors.
  int threads = 0;
  /// No progress and no tables: errors only.
  bool quiet = false;
};

/// Result files; an empty name writes none.
struct OutputOptions {
  std::string model;
  std::string json;
  std::string report;
};

struct FitCommand {
  DataOptions data;
  ScoringOptions scoring;
  RangeOptions ranges;
  RunOptions run;
  OutputOptions outputs;
  std::string model;
  std::string init = "fractional";
  /// Starts that the initialiser tries; 0 for its own default.
  int starts = 0;
  int best = 0;
  int max_iterations = 300;
  /// given: as in the model text; auto: degrees and delay of the filters from the data.
  std::string orders = "given";
  std::vector<std::string> frozen;
  bool robust_covariance = false;
};

struct SimulateCommand {
  std::string model;
  DataOptions data;
  ScoringOptions scoring;
  std::string range;
  std::string csv;
  std::string json;
  bool quiet = false;
};

struct ValidateCommand {
  std::string model;
  DataOptions data;
  ScoringOptions scoring;
  /// Samples that the model was fitted to; empty: not known.
  std::vector<std::string> train;
  /// Samples to judge; empty: those of `train`, or all.
  std::vector<std::string> ranges;
  int lags = 25;
  double significance = 0.01;
  /// Standard deviation of the noise, when it is known.
  std::optional<double> noise;
  /// Where noise alone was recorded: a file, or samples of DATA; empty: nowhere.
  std::string noise_record;
  std::string json;
  std::string report;
  bool quiet = false;
};

struct ClosedLoopCommand {
  /// data.file is not used.
  DataOptions data;
  /// One experiment each.
  std::vector<std::string> files;
  /// Files or coefficients, see transfer_function.hpp.
  std::string plant;
  std::string controller;
  std::string weight;
  std::optional<std::string> reference;
  /// Samples of the experiments, which begin at rest: one for all files, one each, or several experiments of one file;
  /// empty: all.
  std::vector<std::string> ranges;
  /// Samples at the start whose mean is the operating point; 0: none.
  std::int64_t rest = 0;
  /// Where poles on or outside the unit circle are moved to in the coprime factors.
  double factor_pole = 0.9;
  /// One for all experiments, or one each.
  std::vector<double> gamma;
  /// Samples without a reference, for the noise bound, one for all experiments or one each; empty: none.
  std::vector<std::string> quiet_runs;
  double safety = 1.2;
  /// Samples of a window; 0: the record as a whole.
  std::int64_t window = 0;
  std::int64_t step = 0;
  std::int64_t past = -1;
  std::int64_t memory = -1;
  std::int64_t longest = 500;
  /// Most iterations of one programme.
  int max_iterations = 100;
  bool curve = false;
  int bands = 0;
  std::string json;
  std::string report;
  bool quiet = false;
};

struct BlaCommand {
  DataOptions data;
  ScoringOptions scoring;
  RangeOptions ranges;
  RunOptions run;
  std::string json;
  std::string report;
  int max_order = 6;
  int max_delay = 0;
  /// Periods at the start of each range that the frequency response leaves out.
  std::int64_t transient_periods = 0;
  /// NB,NA[,NK]; empty: chosen from the order table.
  std::vector<int> orders;
};

struct CtCommand {
  DataOptions data;
  RangeOptions ranges;
  /// initial_state is empty when it follows from the method.
  ScoringOptions scoring = {.initial_state = ""};
  std::string method = "srivc";
  /// NB,NA
  std::vector<int> orders;
  /// LO:HI[:COUNT] in rad/s; empty: the band of the input. Of flbf, svf and srivc, as all up to `max_iterations` but
  /// `refit`.
  std::string break_points;
  /// How the input runs between samples; empty: spline3, or zoh for trends.
  std::string hold;
  /// Instrumental variables after the least squares of flbf and svf.
  bool iv = false;
  /// Least squares of the simulation error at the end.
  bool refit = false;
  /// Break points of flbf and srivc stay where they are.
  bool no_relocate = false;
  /// Of srivc; 0: its own number.
  int max_iterations = 0;
  /// Coefficients that are zero, "a0", "b1".
  std::vector<std::string> without;
  int delay = 0;
  /// Longest delay of a search; 0: none.
  int max_delay = 0;
  OutputOptions outputs;
  bool quiet = false;
};

/// Columns or variables of a table that holds a frequency response; see ResponseSpec.
struct ResponseColumns {
  /// Empty when the data are a time record.
  std::string frequency;
  /// hz or rad/s
  std::string frequency_unit = "hz";
  std::optional<std::string> response;
  std::optional<std::string> real;
  std::optional<std::string> imaginary;
  std::optional<std::string> magnitude;
  std::optional<std::string> magnitude_db;
  std::optional<std::string> phase;
  /// deg or rad
  std::string phase_unit = "deg";
  std::optional<std::string> deviation;
};

struct FrfCommand {
  /// `input` is empty when the data are a table.
  DataOptions data;
  ResponseColumns columns;
  RangeOptions ranges;
  std::int64_t transient_periods = 0;
  /// LO:HI in rad/s; empty: all tones.
  std::string band;
  /// NB,NA
  std::vector<int> orders;
  std::string basis = "flbf";
  std::string method = "ml";
  /// Empty: deviation where the data have some that count, otherwise relative.
  std::string weighting;
  /// LO:HI[:COUNT] in rad/s; empty: the band of the data.
  std::string break_points;
  /// Of the other bases: a frequency, and for kautz a damping ratio; empty: from the band.
  std::vector<double> point;
  bool no_relocate = false;
  int max_iterations = 50;
  /// How the input runs between samples: of a time record, and of the model file.
  std::string hold = "band_limited";
  OutputOptions outputs;
  bool quiet = false;
};

struct LinearCommand {
  DataOptions data;
  RangeOptions ranges;
  ScoringOptions scoring = {.initial_state = "estimated"};
  /// arx, armax, oe or bj.
  std::string structure;
  /// "nb=2", "nf=2", ...
  std::vector<std::string> orders;
  /// Samples ahead of predictions that are scored besides one step and simulation; 0: none.
  int ahead = 0;
  int max_iterations = 300;
  /// The path from input to output.
  std::string model;
  std::string json;
  std::string report;
  bool quiet = false;
};

struct InfoCommand {
  std::string file;
  std::string json;
};

struct DemoCommand {
  std::string output_dir = ".";
  RunOptions run;
};

struct ReproduceCommand {
  std::string name;
  bool list = false;
  std::uint64_t seed = 1;
  /// For the pictures; empty: none.
  std::string folder;
  std::string json;
  bool quiet = false;
};

}  // namespace blockid::cli
