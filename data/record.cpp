#include "blockid/data/record.hpp"

#include <cmath>

#include "blockid/data/error.hpp"

namespace blockid {
namespace {

void check_lengths(const Record& record) {
  const std::string where = describe(record);
  if (record.u.size() == 0 && record.y.size() == 0) fail(where, ": empty, expected at least one sample");
  if (record.u.size() != record.y.size()) {
    fail(where, ": unequal lengths: input '", record.input_name, "' has ", record.u.size(), " samples, output '",
         record.output_name, "' has ", record.y.size());
  }
  if (record.weights.size() != 0 && record.weights.size() != record.u.size()) {
    fail(where, ": unequal lengths: expected no weights or ", record.u.size(), ", came ", record.weights.size());
  }
}

void check_weights(const Record& record) {
  for (Eigen::Index t = 0; t < record.weights.size(); ++t) {
    if (!(std::isfinite(record.weights[t]) && record.weights[t] >= 0)) {
      fail(describe(record), ": weight at sample index ", t, " is ", record.weights[t], ", expected finite and >= 0");
    }
  }
}

void check_samples(const Record& record) {
  for (Eigen::Index t = 0; t < record.u.size(); ++t) {
    if (!std::isfinite(record.u[t])) {
      fail(describe(record), ": non-finite input '", record.input_name, "' at sample index ", t, ": ", record.u[t]);
    }
    if (!std::isfinite(record.y[t]) && !is_missing(record, t)) {
      fail(describe(record), ": non-finite output '", record.output_name, "' at sample index ", t, ": ", record.y[t],
           " (give a missing sample weight 0)");
    }
  }
}

}  // namespace

Eigen::Index sample_count(const Record& record) { return record.u.size(); }

double weight(const Record& record, Eigen::Index t) { return record.weights.size() == 0 ? 1.0 : record.weights[t]; }

bool is_missing(const Record& record, Eigen::Index t) { return weight(record, t) == 0.0; }

Eigen::Index present_count(const Record& record) {
  return record.weights.size() == 0 ? record.y.size() : (record.weights.array() > 0).count();
}

std::string describe(const Record& record) {
  return record.name.empty() ? std::string("record") : compose("record '", record.name, "'");
}

void check(const Record& record) {
  check_lengths(record);
  check_weights(record);
  check_samples(record);
  if (!(std::isfinite(record.sample_time_s) && record.sample_time_s > 0)) {
    fail(describe(record), ": sample time is ", record.sample_time_s, " s, expected positive and finite");
  }
  if (record.period < 0 || record.period > record.u.size()) {
    fail(describe(record), ": period is ", record.period, " samples, expected 0 (aperiodic) to ", record.u.size(),
         " (the length of the record)");
  }
}

Record slice(const Record& record, Eigen::Index begin, Eigen::Index end) {
  check_lengths(record);
  const Eigen::Index length = record.u.size();
  if (begin < 0 || begin >= end || end > length) {
    fail(describe(record), ": slice ", begin, ":", end, " is empty or outside 0:", length);
  }
  Record part = record;
  const Eigen::Index count = end - begin;
  part.u = record.u.segment(begin, count);
  part.y = record.y.segment(begin, count);
  if (record.weights.size() != 0) part.weights = record.weights.segment(begin, count);
  if (part.period > count) part.period = 0;
  if (!part.name.empty()) part.name += compose("[", begin, ":", end, ")");
  return part;
}

void check_excitation(const Record& record) {
  if (record.u.size() == 0) fail(describe(record), ": empty, expected at least one sample");
  if ((record.u.array() == record.u[0]).all()) {
    fail(describe(record), ": constant input '", record.input_name, "' (", record.u[0],
         " at every sample) excites no dynamics");
  }
}

void check_sample_count(const Record& record, Eigen::Index parameter_count) {
  const Eigen::Index present = present_count(record);
  if (present < parameter_count) {
    fail(describe(record), ": fewer samples than parameters: ", present, " output samples for ", parameter_count,
         " parameters");
  }
}

}  // namespace blockid
