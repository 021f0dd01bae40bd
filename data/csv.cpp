#include "blockid/data/csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "blockid/data/atomic_file.hpp"
#include "blockid/data/csv_lines.hpp"
#include "blockid/data/error.hpp"

namespace blockid {
namespace {

using csv::Cell;
using csv::Line;
using csv::LineReader;
using csv::position;

struct CellCounts {
  std::size_t numbers = 0;
  std::size_t names = 0;
  std::size_t quoted_numbers = 0;
};

CellCounts count_kinds(const std::vector<Cell>& cells) {
  CellCounts counts;
  for (const Cell& cell : cells) {
    const bool is_number = csv::parse_number(cell.text).has_value();
    if (is_number) {
      ++(cell.quoted ? counts.quoted_numbers : counts.numbers);
    } else if (!cell.text.empty() || cell.quoted) {
      ++counts.names;
    }
  }
  return counts;
}

/// Builds a table line by line.
class Parser {
 public:
  Parser(std::string_view text, std::string_view source, const CsvOptions& options)
      : source_(source), options_(options), reader_(text) {
    separator_ = options.separator ? *options.separator : csv::guess_separator(text, source);
  }

  Table run() {
    std::optional<Line> line = reader_.next();
    if (!line) fail(source_, ": empty, expected lines of numbers");
    csv::split(*line, separator_, source_, cells_);
    first_line_ = line->number;
    table_.source = source_;
    table_.has_header = options_.header ? *options_.header : looks_like_header();
    if (table_.has_header) {
      read_header(*line);
      line = reader_.next();
      if (!line) fail(source_, ":", first_line_, ": no data after the line of column names");
    } else {
      for (std::size_t i = 1; i <= cells_.size(); ++i) table_.names.push_back(std::to_string(i));
    }
    for (; line; line = reader_.next()) read_row(*line);
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    table_.values = Eigen::Map<const RowMajor>(values_.data(), static_cast<Eigen::Index>(rows_),
                                               static_cast<Eigen::Index>(table_.names.size()));
    return std::move(table_);
  }

 private:
  [[nodiscard]] bool looks_like_header() const {
    const CellCounts counts = count_kinds(cells_);
    if (counts.names > 0) return counts.numbers == 0;
    if (counts.numbers == 0 && counts.quoted_numbers > 0) {
      fail(source_, ":", first_line_, ": quoted numbers may be names or samples; say whether there is a header");
    }
    return false;
  }

  void read_header(const Line& line) {
    if (is_one_name_of_several_words()) {
      const std::size_t begin = line.text.find_first_not_of(" \t");
      const std::size_t end = line.text.find_last_not_of(" \t");
      table_.names.emplace_back(line.text.substr(begin, end - begin + 1));
      return;
    }
    for (const Cell& cell : cells_) table_.names.push_back(csv::name_of(cell));
  }

  /// Nothing separates the words of an unquoted name from those of the next when white space
  /// separates columns.
  [[nodiscard]] bool is_one_name_of_several_words() const {
    if (options_.separator || separator_ != csv::kWhiteSpace || cells_.size() == 1) return false;
    LineReader ahead = reader_;
    const std::optional<Line> next = ahead.next();
    if (!next) return false;
    std::vector<Cell> cells;
    csv::split(*next, separator_, source_, cells);
    return cells.size() == 1;
  }

  void read_row(const Line& line) {
    csv::split(line, separator_, source_, cells_);
    if (cells_.size() != table_.names.size()) {
      fail(source_, ":", line.number, ": ragged row: expected ", table_.names.size(), " cells as in line ", first_line_,
           ", came ", cells_.size());
    }
    for (std::size_t i = 0; i < cells_.size(); ++i) values_.push_back(read_sample(line, i));
    ++rows_;
  }

  [[nodiscard]] double read_sample(const Line& line, std::size_t i) const {
    const std::string_view text = cells_[i].text;
    if (text.empty()) {
      if (options_.allow_missing) return std::nan("");
      fail(where(line, i), ": empty cell, expected a number");
    }
    const std::optional<double> value = csv::parse_number(text);
    if (!value) fail(where(line, i), ": '", text, "' is not a number", advice(line, text));
    const bool accepted = std::isfinite(*value) || (std::isnan(*value) && options_.allow_missing);
    if (!accepted) fail(where(line, i), ": non-finite sample '", text, "' at sample index ", rows_);
    return *value;
  }

  [[nodiscard]] std::string where(const Line& line, std::size_t i) const {
    const std::string place = position(source_, line.number, i + 1);
    return table_.has_header ? compose(place, " ('", table_.names[i], "')") : place;
  }

  [[nodiscard]] std::string advice(const Line& line, std::string_view text) const {
    if (text.find(',') != std::string_view::npos) return " (decimals need a point, not a comma)";
    if (line.number == first_line_) return " (the line has numbers and names; say whether it is a header)";
    return {};
  }

  std::string source_;
  CsvOptions options_;
  LineReader reader_;
  char separator_ = csv::kWhiteSpace;
  std::vector<Cell> cells_;
  std::vector<double> values_;
  std::size_t rows_ = 0;
  std::size_t first_line_ = 0;
  Table table_;
};

void check_separator(const CsvOptions& options, std::string_view source) {
  if (!options.separator) return;
  const char c = *options.separator;
  const bool is_part_of_a_number = (c >= '0' && c <= '9') || c == '.' || c == '+' || c == '-';
  if (is_part_of_a_number || c == '"' || c == '\n' || c == '\r' || c == '\0') {
    fail(source, ": '", c, "' cannot separate columns");
  }
}

std::string list_columns(const Table& table) {
  constexpr std::size_t kMostNames = 20;
  const std::size_t count = table.names.size();
  if (!table.has_header) return compose("columns are numbered 1 to ", count);
  std::string list = "columns are";
  for (std::size_t i = 0; i < std::min(count, kMostNames); ++i)
    list += compose(i == 0 ? " '" : ", '", table.names[i], "'");
  return list + compose(count > kMostNames ? ", ..." : "", ", or numbers 1 to ", count);
}

}  // namespace

Table parse_csv(std::string_view text, std::string_view source_name, const CsvOptions& options) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  check_separator(options, source_name);
  if (text.substr(0, kByteOrderMark.size()) == kByteOrderMark) text.remove_prefix(kByteOrderMark.size());
  const std::size_t zero = text.find('\0');
  if (zero != std::string_view::npos) fail(source_name, ": not a text file (zero byte at offset ", zero, ")");
  return Parser(text, source_name, options).run();
}

Table read_csv(const std::filesystem::path& path, const CsvOptions& options) {
  return parse_csv(read_file(path), path.string(), options);
}

Eigen::Index column_index(const Table& table, std::string_view name_or_number) {
  const auto first = std::find(table.names.begin(), table.names.end(), name_or_number);
  if (first != table.names.end()) {
    const auto again = std::find(first + 1, table.names.end(), name_or_number);
    if (again != table.names.end()) {
      fail(table.source, ": column name '", name_or_number, "' occurs twice, in columns ",
           first - table.names.begin() + 1, " and ", again - table.names.begin() + 1, "; use the number");
    }
    return first - table.names.begin();
  }
  Eigen::Index number = 0;
  const char* const end = name_or_number.data() + name_or_number.size();
  const auto result = std::from_chars(name_or_number.data(), end, number);
  if (result.ec != std::errc() || result.ptr != end || number < 1 || number > table.values.cols()) {
    fail(table.source, ": no column '", name_or_number, "'; ", list_columns(table));
  }
  return number - 1;
}

Eigen::VectorXd column(const Table& table, std::string_view name_or_number) {
  return table.values.col(column_index(table, name_or_number));
}

}  // namespace blockid
