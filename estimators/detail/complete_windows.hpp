// Where a stretch of outputs is complete.
#pragma once

#include <blockid/data/record.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid::detail {

/// (N,) true at t when none of the outputs y_{t-past} .. y_t is missing; outputs before the record are none's miss.
inline std::vector<bool> complete_windows(const Record& record, Eigen::Index past) {
  std::vector<bool> complete(static_cast<std::size_t>(record.u.size()));
  Eigen::Index last_missing = -1 - past;
  for (Eigen::Index t = 0; t < record.u.size(); ++t) {
    if (is_missing(record, t)) last_missing = t;
    complete[static_cast<std::size_t>(t)] = t - last_missing > past;
  }
  return complete;
}

}  // namespace blockid::detail
