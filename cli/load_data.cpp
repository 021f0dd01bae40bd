#include <blockid/cli/load_data.hpp>

#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/load.hpp>

#include <algorithm>
#include <cmath>
#include <thread>

namespace blockid::cli {
namespace {

/// Largest relative difference of sample times that are taken for the same.
constexpr double kSameSampleTime = 1e-6;

int sample_times_given(const DataOptions& options) {
  return int{options.rate_hz.has_value()} + int{options.sample_time_s.has_value()} +
         int{options.rate_from.has_value()} + int{options.sample_time_from.has_value()};
}

std::vector<Range> parsed(const std::vector<std::string>& texts, const char* option, Index length) {
  std::vector<Range> ranges;
  for (const std::string& text : texts) ranges.push_back(parsed_range(option, text, length));
  return ranges;
}

void thin(Record& record, std::int64_t every) {
  record.u = thinned(record.u, every);
  record.y = thinned(record.y, every);
  if (record.weights.size() > 0) record.weights = thinned(record.weights, every);
}

bool overlap(const Range& a, const Range& b) { return a.begin < b.end && b.begin < a.end; }

}  // namespace

Range parsed_range(const char* option, const std::string& text, Index length) {
  try {
    return resolve(text.empty() ? Range{} : parse_range(text), length);
  } catch (const Error& error) {
    fail(option, " ", text, ": ", error.what());
  }
}

Eigen::VectorXd thinned(const Eigen::VectorXd& x, std::int64_t every) { return x(Eigen::seq(0, x.size() - 1, every)); }

LoadedRecord load(const DataOptions& options, std::optional<double> sample_time_s) {
  LoadSpec spec;
  spec.path = options.file;
  spec.input = options.input;
  spec.output = options.output;
  spec.rate_hz = options.rate_hz;
  spec.sample_time_s = options.sample_time_s;
  spec.rate_from = options.rate_from;
  spec.sample_time_from = options.sample_time_from;
  spec.time_from = options.time_from;
  spec.allow_missing = options.allow_missing;
  const int given = sample_times_given(options);
  if (given > 1 || (given == 0 && !sample_time_s && !options.time_from)) {
    fail("the sample time is given in ", given,
         " ways; expected exactly one of --rate HZ, --sample-time S, --rate-from NAME, --sample-time-from NAME, or "
         "--time NAME");
  }
  const auto every = static_cast<double>(options.every);
  if (given == 0 && sample_time_s) spec.sample_time_s = *sample_time_s / every;
  LoadedRecord loaded;
  Record& record = loaded.record;
  record = load_record(spec, &loaded.warnings);
  if (options.every > 1) thin(record, options.every);
  record.sample_time_s *= every;
  if (sample_time_s && std::abs(record.sample_time_s - *sample_time_s) > kSameSampleTime * *sample_time_s) {
    fail(options.file, ": sampled every ", record.sample_time_s, " s, but the model every ", *sample_time_s, " s");
  }
  record.input_unit = options.input_unit;
  record.output_unit = options.output_unit;
  record.period = options.period;
  check(record);
  return loaded;
}

SplitData split(const LoadedRecord& loaded, const RangeOptions& options) {
  const Record& record = loaded.record;
  SplitData result;
  result.warnings = loaded.warnings;
  const Index length = sample_count(record);
  result.train_ranges = parsed(options.train, "--train", length);
  result.test_ranges = parsed(options.test, "--test", length);
  if (result.train_ranges.empty()) result.train_ranges.push_back({0, length});
  result.train = slices(record, result.train_ranges);
  if (!result.test_ranges.empty()) result.test = slices(record, result.test_ranges);
  for (const Range& train : result.train_ranges) {
    for (const Range& test : result.test_ranges) {
      if (!overlap(train, test)) continue;
      result.warnings.push_back("the training range " + blockid::to_text(train) + " and the test range " +
                                blockid::to_text(test) + " overlap: the test figures are not independent");
    }
  }
  return result;
}

PredictionOptions prediction_options(const ScoringOptions& scoring, std::int64_t period) {
  PredictionOptions options;
  options.warmup = scoring.warmup;
  if (scoring.initial_state == "periodic") {
    if (period < 1) fail("--initial-state periodic: expected --period N with the samples in one period of the input");
    options.initial_state = InitialState::periodic;
  } else if (scoring.initial_state != "zero") {
    options.initial_state = InitialState::estimated;
  }
  return options;
}

std::string to_text(const std::vector<Range>& ranges) {
  std::string text;
  for (const Range& range : ranges) text += (text.empty() ? "" : ", ") + blockid::to_text(range);
  return text;
}

int thread_count(const RunOptions& run) {
  if (run.threads > 0) return run.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace blockid::cli
