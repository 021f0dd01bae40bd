#include <blockid/estimators/continuous_delay.hpp>

#include <blockid/data/error.hpp>

#include <algorithm>
#include <utility>

namespace blockid {
DataSet with_late_input(const DataSet& data, Index delay, Index first) {
  if (delay < 0 || first < delay) {
    fail("delay: expected one from 0 to the first output that counts, ", first, ", got ", delay);
  }
  if (first == 0) return data;
  DataSet result;
  for (const Record& record : data.records) {
    const Index count = record.u.size() - first;
    if (count < 1)
      fail("delay ", first, ": expected less than the ", record.u.size(), " samples of ", describe(record));
    Record late = slice(record, first, record.u.size());
    late.u = record.u.segment(first - delay, count);
    result.records.push_back(std::move(late));
  }
  return result;
}

std::vector<DelayTrial> delay_table(const DataSet& data, const RationalBasis& basis,
                                    const ContinuousFitOptions& options, Index longest) {
  if (longest < 0) fail("delay: expected a longest one of at least 0, got ", longest);
  std::vector<DelayTrial> table;
  for (Index delay = 0; delay <= longest; ++delay) {
    const DataSet late = with_late_input(data, delay, longest);
    DelayTrial trial{.delay = delay, .fit = fit_continuous(late, basis, options)};
    const SimulationErrors errors = simulation_errors(trial.fit.model, late, options);
    trial.squared_error = errors.squared;
    trial.absolute_error = errors.absolute;
    table.push_back(std::move(trial));
  }
  return table;
}

const DelayTrial& best_delay(const std::vector<DelayTrial>& table) {
  if (table.empty()) fail("delay: an empty table has no best one");
  return *std::min_element(table.begin(), table.end(),
                           [](const DelayTrial& a, const DelayTrial& b) { return a.squared_error < b.squared_error; });
}

}  // namespace blockid
