#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "blockid/data/csv.hpp"
#include "blockid/data/record.hpp"

namespace blockid {

enum class FileKind { csv, mat };

/// Decides by content: MAT v5/v7 and HDF5 signatures, or zero bytes under the name *.mat (v4), are
/// mat; the rest is csv.
/// @throws Error naming the path when it cannot be read.
[[nodiscard]] FileKind detect_file_kind(const std::filesystem::path& path);

/// One signal (N,): a CSV column name or 1-based number, or a MAT name as in MatFile::vector.
/// @throws Error as column and MatFile::vector do.
[[nodiscard]] Eigen::VectorXd load_column(const std::filesystem::path& path, std::string_view name,
                                          const CsvOptions& csv = {});

/// One number: a MAT variable of one element, or a CSV column that repeats one value.
/// @throws Error otherwise.
[[nodiscard]] double load_scalar(const std::filesystem::path& path, std::string_view name, const CsvOptions& csv = {});

/// Where a record comes from. Exactly one of sample_time_s, rate_hz, rate_from and sample_time_from must be set; with
/// time_from at most one.
struct LoadSpec {
  std::filesystem::path path = {};
  std::string input = {};                            ///< name as in load_column
  std::optional<std::string> output = {};            ///< not set: every output sample is missing (NaN, weight 0)
  std::optional<double> sample_time_s = {};          ///< in seconds
  std::optional<double> rate_hz = {};                ///< sampling frequency, sample time = 1 / rate_hz
  std::optional<std::string> rate_from = {};         ///< name of a variable that holds the sampling frequency in Hz
  std::optional<std::string> sample_time_from = {};  ///< name of a variable that holds the sample time in seconds
  /// Name of the column or variable that holds time stamps in seconds. They must be uniform; the sample time is theirs
  /// when none of the four above is set, otherwise they must agree with it, see uniform_times.hpp.
  std::optional<std::string> time_from = {};
  bool allow_missing = false;  ///< an output sample that is NaN or an empty cell gets weight 0
  CsvOptions csv = {};         ///< allow_missing above holds for the file, whatever is set here
};

/// Reads the file once and returns a checked record named after the file (without folder and
/// extension).
/// @param warnings when not null, gets a line for each column of a CSV file that is named like a time (t, time, t_s,
///   time_s, timestamp, "time [s]", "time (s)", in either case), is not time_from, and is not uniform
/// @throws Error naming the path for a missing file, unknown names, no or several ways to give the
/// sample time, time stamps that are not uniform, and for
///   what check(Record) refuses.
[[nodiscard]] Record load_record(const LoadSpec& spec, std::vector<std::string>* warnings = nullptr);

/// One column or variable; the statistics are over its finite entries with std = sqrt(sum (x -
/// mean)^2 / n), NaN when there are none or it holds no real numbers.
struct ColumnInfo {
  std::string name;
  Eigen::Index rows = 0;
  Eigen::Index cols = 0;
  std::string type;  ///< MatVariable::type, "double" in CSV files
  double min = 0.0;
  double max = 0.0;
  double mean = 0.0;
  double std = 0.0;
  Eigen::Index non_finite = 0;  ///< entries that are NaN or infinite
};

struct FileInfo {
  std::filesystem::path path;
  FileKind kind = FileKind::csv;
  std::vector<ColumnInfo> columns;
};

/// What a data file holds. Empty cells and NaN of CSV files are counted as non-finite.
/// @throws Error when the file cannot be read.
[[nodiscard]] FileInfo describe_file(const std::filesystem::path& path, const CsvOptions& csv = {});

}  // namespace blockid
