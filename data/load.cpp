#include "blockid/data/load.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <variant>

#include "blockid/data/error.hpp"
#include "blockid/data/mat.hpp"
#include "blockid/data/uniform_times.hpp"

namespace blockid {
namespace {

namespace fs = std::filesystem;

/// Either kind of file, parsed once and asked for several signals.
class DataFile {
 public:
  DataFile(const fs::path& path, const CsvOptions& csv) : source_(path.string()), content_(open(path, csv)) {}

  [[nodiscard]] Eigen::VectorXd signal(std::string_view name) const {
    if (const auto* const table = std::get_if<Table>(&content_)) return column(*table, name);
    return std::get<MatFile>(content_).vector(name);
  }

  /// Null for a MAT file.
  [[nodiscard]] const Table* table() const { return std::get_if<Table>(&content_); }

  [[nodiscard]] double number(std::string_view name) const {
    if (const auto* const file = std::get_if<MatFile>(&content_)) return file->scalar(name);
    const Eigen::VectorXd values = signal(name);
    if ((values.array() != values[0]).any()) {
      fail(source_, ": column '", name, "' varies from ", values.minCoeff(), " to ", values.maxCoeff(),
           ", expected one number");
    }
    return values[0];
  }

 private:
  using Content = std::variant<Table, MatFile>;

  static Content open(const fs::path& path, const CsvOptions& csv) {
    if (detect_file_kind(path) == FileKind::mat) return MatFile(path);
    return read_csv(path, csv);
  }

  std::string source_;
  Content content_;
};

std::string read_beginning(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) fail(path.string(), ": cannot read: no such file");
  if (fs::is_directory(status)) fail(path.string(), ": cannot read: is a folder");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(path.string(), ": cannot read: cannot be opened");
  constexpr std::size_t kEnough = 4096;
  std::string head(kEnough, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  return head;
}

/// HDF5 allows a user block, so its signature stands at byte 0, 512, 1024, 2048, ...
bool has_hdf5_signature(std::string_view head) {
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  if (head.substr(0, kSignature.size()) == kSignature) return true;
  constexpr std::size_t kFirstUserBlock = 512;
  for (std::size_t at = kFirstUserBlock; at + kSignature.size() <= head.size(); at *= 2) {
    if (head.substr(at, kSignature.size()) == kSignature) return true;
  }
  return false;
}

/// Bytes 124-127 of a v5 header: version 0x0100 and the letters MI, in the byte order of the
/// writer.
bool has_mat5_signature(std::string_view head) {
  constexpr std::size_t kVersionOffset = 124;
  if (head.size() < kVersionOffset + 4) return false;
  const std::string_view mark = head.substr(kVersionOffset, 4);
  return mark == std::string_view("\x00\x01IM", 4) || mark == std::string_view("\x01\x00MI", 4);
}

int sample_times_given(const LoadSpec& spec) {
  return int{spec.sample_time_s.has_value()} + int{spec.rate_hz.has_value()} + int{spec.rate_from.has_value()} +
         int{spec.sample_time_from.has_value()};
}

double given_sample_time(const LoadSpec& spec, const DataFile& file) {
  const auto positive = [&](double value, std::string_view what) {
    if (std::isfinite(value) && value > 0) return value;
    fail(spec.path.string(), ": ", what, " is ", value, ", expected positive and finite");
  };
  if (spec.sample_time_s) return positive(*spec.sample_time_s, "sample time");
  if (spec.rate_hz) return 1.0 / positive(*spec.rate_hz, "sampling rate");
  if (spec.rate_from) return 1.0 / positive(file.number(*spec.rate_from), "sampling rate '" + *spec.rate_from + "'");
  return positive(file.number(*spec.sample_time_from), "sample time '" + *spec.sample_time_from + "'");
}

/// The given sample time is exact where stamps are rounded, so it stands.
double stamped_sample_time(const LoadSpec& spec, const DataFile& file, const Record& record) {
  const Eigen::VectorXd stamps = file.signal(*spec.time_from);
  try {
    if (stamps.size() != record.u.size()) {
      fail("unequal lengths: input '", spec.input, "' has ", record.u.size(), " samples, time stamps '",
           *spec.time_from, "' has ", stamps.size());
    }
    const SampleTimes times = uniform_times(stamps, *spec.time_from);
    if (sample_times_given(spec) == 0) return times.sample_time_s;
    const double given = given_sample_time(spec, file);
    check_sample_time(times, stamps.size(), given, *spec.time_from);
    return given;
  } catch (const Error& error) {
    fail(spec.path.string(), ": ", error.what());
  }
}

void check_sample_times_given(const LoadSpec& spec) {
  const int given = sample_times_given(spec);
  if (given == 1 || (given == 0 && spec.time_from)) return;
  fail(spec.path.string(), ": the sample time is given in ", given,
       " ways, expected exactly one of sample time, rate, and variable that holds either",
       given == 0 ? ", or time stamps" : "");
}

bool named_like_time(std::string name) {
  constexpr std::array<std::string_view, 7> kNames = {"t",         "time",     "t_s",     "time_s",
                                                      "timestamp", "time [s]", "time (s)"};
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

/// Whoever gives a rate for a file with stamps wants to know that they contradict it.
std::vector<std::string> uneven_time_columns(const LoadSpec& spec, const DataFile& file) {
  std::vector<std::string> lines;
  const Table* const table = file.table();
  if (table == nullptr || !table->has_header) return lines;
  for (Eigen::Index j = 0; j < table->values.cols(); ++j) {
    const std::string& name = table->names[static_cast<std::size_t>(j)];
    const bool used = name == spec.input || name == spec.output || name == spec.time_from;
    if (used || !named_like_time(name)) continue;
    try {
      static_cast<void>(uniform_times(table->values.col(j), name));
    } catch (const Error& error) {
      lines.push_back("the column is not used, but " + std::string(error.what()));
    }
  }
  return lines;
}

/// Weights stay empty unless a sample is missing.
void mark_missing(Record& record) {
  const auto missing = record.y.array().isNaN();
  if (missing.any()) record.weights = missing.select(0.0, Eigen::ArrayXd::Ones(record.y.size()));
}

ColumnInfo statistics(ColumnInfo info, const Eigen::Ref<const Eigen::ArrayXd>& values) {
  Eigen::ArrayXd finite(values.size());
  Eigen::Index count = 0;
  for (const double value : values) {
    if (std::isfinite(value)) finite[count++] = value;
  }
  finite.conservativeResize(count);
  info.non_finite = values.size() - count;
  if (count == 0) return info;
  info.min = finite.minCoeff();
  info.max = finite.maxCoeff();
  info.mean = finite.mean();
  info.std = std::sqrt((finite - info.mean).square().mean());
  return info;
}

ColumnInfo without_statistics(const std::string& name, Eigen::Index rows, Eigen::Index cols, const std::string& type) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  return {name, rows, cols, type, kNone, kNone, kNone, kNone, 0};
}

std::vector<ColumnInfo> describe_table(const Table& table) {
  std::vector<ColumnInfo> columns;
  for (Eigen::Index j = 0; j < table.values.cols(); ++j) {
    const std::string& name = table.names[static_cast<std::size_t>(j)];
    columns.push_back(
        statistics(without_statistics(name, table.values.rows(), 1, "double"), table.values.col(j).array()));
  }
  return columns;
}

std::vector<ColumnInfo> describe_mat(const MatFile& file) {
  std::vector<ColumnInfo> columns;
  for (const MatVariable& variable : file.variables()) {
    const ColumnInfo info = without_statistics(variable.name, variable.rows, variable.cols, variable.type);
    const bool readable = variable.numeric && variable.rows > 0 && variable.cols > 0 && variable.rank == 2;
    columns.push_back(readable ? statistics(info, file.matrix(variable.name).reshaped().array()) : info);
  }
  return columns;
}

}  // namespace

FileKind detect_file_kind(const fs::path& path) {
  const std::string head = read_beginning(path);
  if (has_mat5_signature(head) || has_hdf5_signature(head)) return FileKind::mat;
  const bool binary = head.find('\0') != std::string::npos;
  return binary && path.extension() == ".mat" ? FileKind::mat : FileKind::csv;
}

Eigen::VectorXd load_column(const fs::path& path, std::string_view name, const CsvOptions& csv) {
  return DataFile(path, csv).signal(name);
}

double load_scalar(const fs::path& path, std::string_view name, const CsvOptions& csv) {
  return DataFile(path, csv).number(name);
}

Record load_record(const LoadSpec& spec, std::vector<std::string>* warnings) {
  CsvOptions csv = spec.csv;
  csv.allow_missing = spec.allow_missing;
  const DataFile file(spec.path, csv);
  Record record;
  record.name = spec.path.stem().string();
  record.input_name = spec.input;
  check_sample_times_given(spec);
  record.u = file.signal(spec.input);
  record.sample_time_s = spec.time_from ? stamped_sample_time(spec, file, record) : given_sample_time(spec, file);
  if (spec.output) {
    record.output_name = *spec.output;
    record.y = file.signal(*spec.output);
  } else {
    record.y = Eigen::VectorXd::Constant(record.u.size(), std::numeric_limits<double>::quiet_NaN());
  }
  if (spec.allow_missing || !spec.output) mark_missing(record);
  try {
    check(record);
  } catch (const Error& error) {
    fail(spec.path.string(), ": ", error.what());
  }
  if (warnings != nullptr) *warnings = uneven_time_columns(spec, file);
  return record;
}

FileInfo describe_file(const fs::path& path, const CsvOptions& csv) {
  const FileKind kind = detect_file_kind(path);
  if (kind == FileKind::mat) return {path, kind, describe_mat(MatFile(path))};
  CsvOptions lenient = csv;
  lenient.allow_missing = true;
  return {path, kind, describe_table(read_csv(path, lenient))};
}

}  // namespace blockid
