// Where a measured input has its power.
#pragma once

#include <blockid/data/data_set.hpp>

namespace blockid {

/// A range of frequencies, rad/s.
struct FrequencyRange {
  double low = 0.0;
  double high = 0.0;
};

/// From one turn in the longest record to the Nyquist frequency: what the samples can show at all.
FrequencyRange sampled_band(const DataSet& data);

/// The band that leaves out 1 % of the power of the input, mean removed, at either end; of the longest record. At least
/// a factor of 4 wide, within sampled_band(), which it is for a constant input.
FrequencyRange excited_band(const DataSet& data);

}  // namespace blockid
