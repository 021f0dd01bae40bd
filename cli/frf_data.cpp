#include <blockid/cli/frf_data.hpp>

#include <blockid/cli/load_data.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/input_period.hpp>
#include <blockid/data/load_response.hpp>
#include <blockid/estimators/excited_band.hpp>
#include <blockid/init/nonparametric_bla.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace blockid::cli {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;

/// An option that was given although it says nothing about this kind of data.
[[noreturn]] void fail_misplaced(const std::string& option, const char* kind) {
  fail(option, ": does not belong to ", kind, "; leave it out");
}

/// The first option that belongs to records only.
std::string record_option(const FrfCommand& command) {
  const std::vector<std::pair<const char*, bool>> options = {
      {"--input", !command.data.input.empty()},
      {"--output", command.data.output.has_value()},
      {"--rate-from", command.data.rate_from.has_value()},
      {"--sample-time-from", command.data.sample_time_from.has_value()},
      {"--time", command.data.time_from.has_value()},
      {"--allow-missing", command.data.allow_missing},
      {"--period", command.data.period > 0},
      {"--transient-periods", command.transient_periods > 0},
      {"--train", !command.ranges.train.empty()}};
  for (const auto& [name, given] : options) {
    if (given) return name;
  }
  return {};
}

ResponseSpec response_spec(const FrfCommand& command) {
  const ResponseColumns& columns = command.columns;
  if (columns.magnitude && columns.magnitude_db) fail("--magnitude, --magnitude-db: expected one of them");
  ResponseSpec spec;
  spec.path = command.data.file;
  spec.frequency = columns.frequency;
  spec.frequency_unit = columns.frequency_unit == "hz" ? FrequencyUnit::hertz : FrequencyUnit::radians_per_second;
  spec.response = columns.response;
  spec.real = columns.real;
  spec.imaginary = columns.imaginary;
  spec.magnitude = columns.magnitude_db ? columns.magnitude_db : columns.magnitude;
  spec.magnitude_unit = columns.magnitude_db ? MagnitudeUnit::decibels : MagnitudeUnit::ratio;
  spec.phase = columns.phase;
  spec.phase_unit = columns.phase_unit == "deg" ? AngleUnit::degrees : AngleUnit::radians;
  spec.deviation = columns.deviation;
  return spec;
}

/// A model file needs a sample time, and it serves for nothing else.
std::optional<double> table_sample_time(const FrfCommand& command) {
  const DataOptions& data = command.data;
  if (data.rate_hz && data.sample_time_s) fail("--rate, --sample-time: expected one of them");
  const bool given = data.rate_hz || data.sample_time_s;
  if (given && command.outputs.model.empty()) {
    fail_misplaced(data.rate_hz ? "--rate" : "--sample-time", "a table without -o MODEL");
  }
  if (!given && !command.outputs.model.empty()) {
    fail("-o ", command.outputs.model, ": a model simulates samples; expected --rate HZ or --sample-time S");
  }
  if (!given) return std::nullopt;
  const double sample_time_s = data.rate_hz ? 1.0 / *data.rate_hz : *data.sample_time_s;
  if (!std::isfinite(sample_time_s) || !(sample_time_s > 0.0)) {
    fail(data.rate_hz ? "--rate" : "--sample-time", ": expected a positive number");
  }
  return sample_time_s;
}

FrfData from_table(const FrfCommand& command) {
  if (const std::string option = record_option(command); !option.empty()) fail_misplaced(option, "a table");
  FrfData data;
  data.sample_time_s = table_sample_time(command);
  data.response = load_frequency_response(response_spec(command));
  data.weighty_deviations = command.columns.deviation.has_value();
  data.origin = "table of " + std::to_string(data.response.response.size()) + " tones";
  return data;
}

NonparametricBla measured(const FrfCommand& command, const DataSet& data) {
  if (command.data.period < 1) return local_polynomial_bla(data);
  PeriodicBlaOptions options;
  options.transient_periods = command.transient_periods;
  return periodic_bla(data, options);
}

std::string origin_of(const NonparametricBla& lines) {
  const std::string count = std::to_string(lines.response.response.size()) + " lines, " +
                            std::to_string(lines.realisations) +
                            (lines.realisations == 1 ? " realisation" : " realisations");
  if (lines.periods == 0) return "record, local polynomial method, " + count;
  return "periodic record, averaged over " + std::to_string(lines.periods) +
         (lines.periods == 1 ? " period, " : " periods, ") + count;
}

void check_record_hold(Hold hold) {
  if (hold == Hold::zero_order || hold == Hold::first_order || hold == Hold::band_limited) return;
  fail("--hold ", blockid::to_text(hold), ": a record is read with zoh, foh or band_limited");
}

/// Leakage and noise go down with a period that is told.
void warn_of_period(const FrfCommand& command, const DataSet& data, std::vector<std::string>& warnings) {
  if (command.data.period > 0) return;
  for (const Record& record : data.records) {
    const Index period = record.period > 0 ? record.period : input_period(record.u);
    if (period == 0) continue;
    const std::string text = std::to_string(period);
    warnings.push_back("the input repeats itself every " + text + " samples: with --period " + text +
                       " the response is averaged over its periods, which leaves no leakage and tells deviations");
    return;
  }
}

FrfData from_record(const FrfCommand& command, Hold hold) {
  if (!command.data.output) fail("--output: expected the name of the output beside --input");
  if (command.transient_periods > 0 && command.data.period < 1) {
    fail("--transient-periods: expected --period N with the samples in one period of the input");
  }
  check_record_hold(hold);
  const LoadedRecord loaded = load(command.data);
  const Record& record = loaded.record;
  const SplitData parts = split(loaded, command.ranges);
  const NonparametricBla lines = measured(command, parts.train);
  FrfData data;
  data.sample_time_s = record.sample_time_s;
  data.origin = origin_of(lines);
  constexpr Index kEnough = 2;
  data.weighty_deviations = (lines.total_variance.size() > 0 ? lines.total_dof : lines.noise_dof) >= kEnough;
  data.warnings = parts.warnings;
  data.excited = excited_band(parts.train);
  data.excitation = excitation(parts.train);
  warn_of_period(command, parts.train, data.warnings);
  data.records = parts.train;
  data.ranges = parts.train_ranges;
  const VectorXcd held = hold_response(hold, lines.response.omega_rad_s, record.sample_time_s);
  data.response.omega_rad_s = lines.response.omega_rad_s;
  data.response.response = lines.response.response.cwiseQuotient(held);
  if (lines.response.standard_deviation.size() > 0) {
    data.response.standard_deviation = lines.response.standard_deviation.cwiseQuotient(held.cwiseAbs());
  }
  return data;
}

FrequencyResponse within(const FrequencyResponse& g, const FrequencyRange& band) {
  std::vector<Index> kept;
  for (Index k = 0; k < g.omega_rad_s.size(); ++k) {
    if (g.omega_rad_s[k] >= band.low && g.omega_rad_s[k] <= band.high) kept.push_back(k);
  }
  FrequencyResponse result;
  result.omega_rad_s = g.omega_rad_s(kept);
  result.response = g.response(kept);
  if (g.standard_deviation.size() > 0) result.standard_deviation = g.standard_deviation(kept);
  return result;
}

}  // namespace

FrfData load_frf(const FrfCommand& command, Hold hold) {
  const bool table = !command.columns.frequency.empty();
  if (!table && command.data.input.empty()) {
    fail(
        "expected --frequency NAME for a table of a frequency response, or --input NAME and --output NAME for a "
        "record");
  }
  FrfData data = table ? from_table(command) : from_record(command, hold);
  if (command.band.empty()) return data;
  const FrequencyRange band = parse_frequency_range("--band", command.band);
  const FrequencyRange all = band_of(data.response);
  data.response = within(data.response, band);
  if (data.response.omega_rad_s.size() == 0) {
    fail("--band ", command.band, ": no tone lies within; the data run from ", number(all.low), " to ",
         number(all.high), " rad/s");
  }
  return data;
}

FrequencyRange break_point_band(const FrfData& data) {
  const FrequencyRange tones = band_of(data.response);
  if (!data.excited) return tones;
  const FrequencyRange both{std::max(tones.low, data.excited->low), std::min(tones.high, data.excited->high)};
  return both.low < both.high ? both : tones;
}

FrequencyRange band_of(const FrequencyResponse& g) {
  const Index count = g.omega_rad_s.size();
  const double high = count > 0 ? g.omega_rad_s[count - 1] : 0.0;
  if (!(high > 0.0)) fail("frequency response: expected a frequency above zero");
  return {g.omega_rad_s[0] > 0.0 ? g.omega_rad_s[0] : g.omega_rad_s[1], high};
}

VectorXcd hold_response(Hold hold, const VectorXd& omega_rad_s, double sample_time_s) {
  if (hold != Hold::zero_order && hold != Hold::first_order) return VectorXcd::Ones(omega_rad_s.size());
  return omega_rad_s.unaryExpr([&](double omega) {
    const double x = 0.5 * omega * sample_time_s;
    const double sinc = x == 0.0 ? 1.0 : std::sin(x) / x;
    return hold == Hold::zero_order ? std::polar(sinc, -x) : std::complex<double>(sinc * sinc);
  });
}

}  // namespace blockid::cli
