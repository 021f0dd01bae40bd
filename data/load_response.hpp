#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "blockid/data/csv.hpp"
#include "blockid/data/frequency_response.hpp"

namespace blockid {

enum class FrequencyUnit { hertz, radians_per_second };
enum class AngleUnit { degrees, radians };
enum class MagnitudeUnit { ratio, decibels };

/// Where a measured frequency response comes from. Names as in load_column. Exactly one of three forms:
/// `response`; `real` and `imaginary`; `magnitude` and `phase`.
struct ResponseSpec {
  std::filesystem::path path = {};
  std::string frequency = {};
  FrequencyUnit frequency_unit = FrequencyUnit::hertz;
  std::optional<std::string> response = {};  ///< a complex variable of a MAT file
  std::optional<std::string> real = {};
  std::optional<std::string> imaginary = {};
  std::optional<std::string> magnitude = {};
  MagnitudeUnit magnitude_unit = MagnitudeUnit::ratio;
  std::optional<std::string> phase = {};
  AngleUnit phase_unit = AngleUnit::degrees;
  std::optional<std::string> deviation = {};  ///< standard deviation of |G - E G|, as a ratio
  CsvOptions csv = {};
};

/// Reads a continuous frequency response (sample time 0) and checks it.
/// @throws Error naming the path for a missing file, unknown names, none or several forms, half a form, a complex
///   variable of a CSV file, negative magnitudes, and for what check(FrequencyResponse) refuses.
[[nodiscard]] FrequencyResponse load_frequency_response(const ResponseSpec& spec);

}  // namespace blockid
