// The experiments of `blockid closed-loop`: from files, ranges and noise bounds to loop records.
#pragma once

#include <blockid/cli/options.hpp>
#include <blockid/data/data_set.hpp>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// Input, output and reference (empty when there is none) of a part of the data, less the operating point.
struct LoopRecord {
  Eigen::VectorXd u;
  Eigen::VectorXd y;
  Eigen::VectorXd r;
};

struct LoopExperiment {
  std::string source;
  std::string range;
  double sample_time_s = 1.0;
  LoopRecord record;
  /// A run without reference, for the noise bound; none unless asked for.
  std::optional<LoopRecord> quiet = std::nullopt;
  std::string quiet_range = {};
  std::optional<double> gamma = std::nullopt;
  std::vector<std::string> warnings = {};
};

/// One experiment a file, or, of one file, one a range; a single range, quiet run or noise bound stands for all.
/// Throws Error for counts that fit neither, for what load() refuses, for sample times that differ, ranges outside the
/// record, missing samples, and a reference of another length.
std::vector<LoopExperiment> loop_experiments(const ClosedLoopCommand& command, std::optional<double> sample_time_s);

}  // namespace blockid::cli
