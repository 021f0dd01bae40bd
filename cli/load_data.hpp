// From options to records.
#pragma once

#include <blockid/cli/options.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/data/record.hpp>
#include <blockid/estimators/predictor.hpp>

#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// A record and what its user should know of it.
struct LoadedRecord {
  Record record;
  std::vector<std::string> warnings = {};
};

/// The whole record with period and units. sample_time_s: taken when the options give none, and compared with what they
/// give otherwise; without it one of the options must say the sample time.
/// --every thins the samples; a sample time from the options is that of the file, one from a model that after thinning.
/// Throws Error for what load_record() refuses and sample times that differ.
LoadedRecord load(const DataOptions& options, std::optional<double> sample_time_s = std::nullopt);

/// Samples 0, every, 2 every, ... of x (N,).
Eigen::VectorXd thinned(const Eigen::VectorXd& x, std::int64_t every);

/// "A:B" resolved in a record of `length` samples; "" for all. Throws Error with the option and the text in front.
Range parsed_range(const char* option, const std::string& text, Index length);

/// Training and test records with the ranges that cut them out, open ends resolved.
struct SplitData {
  DataSet train;
  DataSet test;
  std::vector<Range> train_ranges;
  std::vector<Range> test_ranges;
  /// Those of the record, and e.g. ranges that overlap.
  std::vector<std::string> warnings;
};

/// Throws Error for ranges that do not parse or lie outside the record.
SplitData split(const LoadedRecord& loaded, const RangeOptions& options);

/// Throws Error for a periodic state without a period.
PredictionOptions prediction_options(const ScoringOptions& scoring, std::int64_t period);

/// "5200:105200, 110000:120000"
std::string to_text(const std::vector<Range>& ranges);

/// Number of threads to use: the given one, or all processors.
int thread_count(const RunOptions& run);

}  // namespace blockid::cli
