// From the options of `frf` to a continuous frequency response.
#pragma once

#include <blockid/cli/continuous_options.hpp>
#include <blockid/cli/options.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/data/frequency_response.hpp>
#include <blockid/estimators/excitation.hpp>

#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

struct FrfData {
  FrequencyResponse response;
  /// "table of 36 tones"; or how the record was evaluated.
  std::string origin;
  /// The standard deviations are good enough for weights: given, or from two degrees of freedom or more.
  bool weighty_deviations = false;
  /// Of the record, or as given with a table; none when unknown.
  std::optional<double> sample_time_s;
  /// Of a record: where its input has its power, rad/s.
  std::optional<FrequencyRange> excited;
  /// The records of a record's ranges, none of a table.
  DataSet records;
  std::vector<Range> ranges;
  /// Of a record: how much its input excites.
  std::optional<Excitation> excitation;
  std::vector<std::string> warnings;
};

/// Reads the table, or measures the response of the record line by line, and keeps the tones within the band.
/// Throws Error for options that do not belong to the kind of data, and for whatever reading and measuring refuse.
FrfData load_frf(const FrfCommand& command, Hold hold);

/// Lowest positive and highest frequency.
FrequencyRange band_of(const FrequencyResponse& g);

/// Where break points go that are not told: the band of the tones, of a record that part of it which the input excites.
FrequencyRange break_point_band(const FrfData& data);

/// Response at omega of what makes a signal out of samples, (F,): samples times it = the signal's spectrum, aliases
/// left out. exp(-j w h / 2) sinc(w h / 2) for zero order, sinc^2 for first order, one for the band-limited signal and
/// for splines, which come near it.
Eigen::VectorXcd hold_response(Hold hold, const Eigen::VectorXd& omega_rad_s, double sample_time_s);

}  // namespace blockid::cli
