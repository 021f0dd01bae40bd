#include "blockid/data/data_set.hpp"

#include <algorithm>
#include <charconv>

#include "blockid/data/error.hpp"

namespace blockid {
namespace {

std::string expectation(std::string_view text) {
  return compose("range '", text, "': expected A:B, A: or :B with whole numbers 0 <= A < B");
}

Eigen::Index parse_bound(std::string_view bound, std::string_view text, Eigen::Index when_open) {
  if (bound.empty()) return when_open;
  Eigen::Index value = 0;
  const char* const end = bound.data() + bound.size();
  const auto result = std::from_chars(bound.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end || value < 0) fail(expectation(text), ", came '", bound, "'");
  return value;
}

}  // namespace

Range parse_range(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) fail(expectation(text), "; there is no colon");
  const Range range{parse_bound(text.substr(0, colon), text, 0), parse_bound(text.substr(colon + 1), text, kToEnd)};
  if (range.begin >= range.end) fail(expectation(text), "; this one is empty");
  return range;
}

std::string to_text(const Range& range) {
  return range.end == kToEnd ? compose(range.begin, ":") : compose(range.begin, ":", range.end);
}

Range resolve(const Range& range, Eigen::Index length) {
  const Range closed{range.begin, range.end == kToEnd ? length : range.end};
  if (closed.begin < 0 || closed.begin >= closed.end || closed.end > length) {
    fail("range ", to_text(range), " is empty or outside 0:", length);
  }
  return closed;
}

Eigen::Index total_samples(const DataSet& data) {
  Eigen::Index total = 0;
  for (const Record& record : data.records) total += sample_count(record);
  return total;
}

Eigen::Index present_count(const DataSet& data) {
  Eigen::Index total = 0;
  for (const Record& record : data.records) total += present_count(record);
  return total;
}

void check(const DataSet& data) {
  if (data.records.empty()) fail("data set: no records, expected at least one");
  for (std::size_t i = 0; i < data.records.size(); ++i) {
    try {
      check(data.records[i]);
    } catch (const Error& error) {
      if (data.records.size() == 1) throw;
      fail("data set, position ", i, ": ", error.what());
    }
    if (data.records[i].sample_time_s != data.records[0].sample_time_s) {
      fail("data set, position ", i, ": ", describe(data.records[i]), ": sample time is ",
           data.records[i].sample_time_s, " s, expected ", data.records[0].sample_time_s, " s as in position 0");
    }
  }
}

void check_excitation(const DataSet& data) {
  if (data.records.size() == 1) return check_excitation(data.records[0]);
  const auto is_constant = [](const Record& record) {
    return record.u.size() == 0 || (record.u.array() == record.u[0]).all();
  };
  if (std::all_of(data.records.begin(), data.records.end(), is_constant)) {
    fail("data set: constant input in each of the ", data.records.size(), " records excites no dynamics");
  }
}

void check_sample_count(const DataSet& data, Eigen::Index parameter_count) {
  if (data.records.size() == 1) return check_sample_count(data.records[0], parameter_count);
  const Eigen::Index present = present_count(data);
  if (present < parameter_count) {
    fail("data set: fewer samples than parameters: ", present, " output samples in ", data.records.size(),
         " records for ", parameter_count, " parameters");
  }
}

Record slice(const Record& record, const Range& range) {
  const Eigen::Index end = range.end == kToEnd ? sample_count(record) : range.end;
  return slice(record, range.begin, end);
}

DataSet slices(const Record& record, const std::vector<Range>& ranges) {
  if (ranges.empty()) fail(describe(record), ": no ranges, expected at least one");
  DataSet data;
  data.records.reserve(ranges.size());
  for (const Range& range : ranges) data.records.push_back(slice(record, range));
  return data;
}

}  // namespace blockid
