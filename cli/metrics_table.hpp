// Figures of merit as rows of a table.
#pragma once

#include <blockid/cli/text_table.hpp>
#include <blockid/data/metrics.hpp>

#include <string>
#include <vector>

namespace blockid::cli {

/// A table without rows, RMSE and MAE in the given unit.
TextTable metrics_table(const std::string& unit);

/// A row of it.
std::vector<std::string> metrics_row(const std::string& name, const Metrics& metrics);

/// The row without VAF and MAE.
std::vector<std::string> short_metrics_row(const std::string& name, const Metrics& metrics);

/// The row with the number of samples that were not scored at its end.
std::vector<std::string> with_warmup(std::vector<std::string> row, const Metrics& metrics);

}  // namespace blockid::cli
