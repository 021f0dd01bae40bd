#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "blockid/data/record.hpp"

namespace blockid {

/// End of a range that runs to the last sample of whatever record it is applied to.
inline constexpr Eigen::Index kToEnd = std::numeric_limits<Eigen::Index>::max();

/// Samples begin..end-1: zero-based, half-open.
struct Range {
  Eigen::Index begin = 0;
  Eigen::Index end = kToEnd;
  friend bool operator==(const Range&, const Range&) = default;
};

/// Reads "A:B", "A:", ":B" or ":" with A, B non-negative integers and A < B.
/// @throws Error quoting the text.
[[nodiscard]] Range parse_range(std::string_view text);

/// "A:B", or "A:" for an open end: the inverse of parse_range.
[[nodiscard]] std::string to_text(const Range& range);

/// The same range with an open end replaced by length.
/// @throws Error unless 0 <= begin < end <= length.
[[nodiscard]] Range resolve(const Range& range, Eigen::Index length);

/// Several records of the same system, sampled alike. Each starts anew: no state is carried from
/// one to the next.
struct DataSet {
  std::vector<Record> records;

  DataSet() = default;
  DataSet(Record record) { records.push_back(std::move(record)); }  // NOLINT(google-explicit-constructor)
  DataSet(std::vector<Record> list) : records(std::move(list)) {}   // NOLINT(google-explicit-constructor)
};

/// Sum of the record lengths.
[[nodiscard]] Eigen::Index total_samples(const DataSet& data);

/// Sum over records of the output samples that are not missing.
[[nodiscard]] Eigen::Index present_count(const DataSet& data);

/// Verifies every record and that all have the same sample time.
/// @throws Error naming the record by name and position; also for a set without records.
void check(const DataSet& data);

/// Verifies that at least one record has a varying input.
/// @throws Error when the input of every record is constant.
void check_excitation(const DataSet& data);

/// Verifies that the present output samples of all records together are at least as many as the
/// parameters.
/// @throws Error "fewer samples than parameters" with both numbers.
void check_sample_count(const DataSet& data, Eigen::Index parameter_count);

/// slice(record, begin, end) with an open end resolved.
[[nodiscard]] Record slice(const Record& record, const Range& range);

/// One record for each range, in the order given; ranges may overlap.
/// @throws Error for an empty list or a range outside the record.
[[nodiscard]] DataSet slices(const Record& record, const std::vector<Range>& ranges);

}  // namespace blockid
