// The best linear approximation line by line, as `blockid bla` measures and tells it.
#pragma once

#include <blockid/cli/report/figures.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/init/nonparametric_bla.hpp>

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

struct MeasuredBla {
  NonparametricBla lines;
  NonlinearityVerdict verdict;
  /// None when the total variance is unknown.
  std::optional<VanishingBla> vanishing;
};

/// By the robust method when the records are periodic, otherwise by the local polynomial method; each record is a
/// realisation. Nothing, with a warning more, when the data cannot give it.
std::optional<MeasuredBla> measure_bla(const DataSet& data, bool periodic, Index transient_periods,
                                       std::vector<std::string>& warnings);

/// "robust method, 3 realisations, 4 periods"
std::string method_text(const MeasuredBla& measured);

/// What the powers and the test say, a sentence each.
std::vector<std::string> verdict_texts(const MeasuredBla& measured);

nlohmann::ordered_json measured_json(const MeasuredBla& measured);

/// |G| at the lines, the model's, and the standard deviations of noise, of noise and distortion, and of distortion.
Figure lines_figure(const MeasuredBla& measured, const LeafBlock& model);

}  // namespace blockid::cli
