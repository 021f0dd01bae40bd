#include <blockid/cli/metrics_table.hpp>

namespace blockid::cli {

TextTable metrics_table(const std::string& unit) {
  const std::string in_unit = unit.empty() ? "" : " [" + unit + "]";
  return {{{"", Align::left},
           {"RMSE" + in_unit, Align::right},
           {"NRMSE", Align::right},
           {"fit %", Align::right},
           {"R2", Align::right},
           {"VAF %", Align::right},
           {"MAE" + in_unit, Align::right},
           {"samples", Align::right}},
          {}};
}

std::vector<std::string> metrics_row(const std::string& name, const Metrics& metrics) {
  return {name,
          number(metrics.rmse),
          number(metrics.nrmse),
          number(metrics.fit_percent),
          number(metrics.r2),
          number(metrics.vaf),
          number(metrics.mae),
          std::to_string(metrics.samples)};
}

std::vector<std::string> short_metrics_row(const std::string& name, const Metrics& metrics) {
  return {name,
          number(metrics.rmse),
          number(metrics.nrmse),
          number(metrics.fit_percent),
          number(metrics.r2),
          std::to_string(metrics.samples)};
}

std::vector<std::string> with_warmup(std::vector<std::string> row, const Metrics& metrics) {
  row.push_back(std::to_string(metrics.warmup));
  return row;
}

}  // namespace blockid::cli
