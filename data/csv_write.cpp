#include <algorithm>
#include <array>
#include <charconv>

#include "blockid/data/atomic_file.hpp"
#include "blockid/data/csv.hpp"
#include "blockid/data/csv_lines.hpp"
#include "blockid/data/error.hpp"

namespace blockid {
namespace {

void append_number(std::string& text, double value) {
  constexpr std::size_t kLongestShortest = 32;  // "-2.2250738585072014e-308" has 24
  std::array<char, kLongestShortest> digits{};
  const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), result.ptr);
}

bool needs_quotes(std::string_view name) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  return name.empty() || name.find_first_not_of(kPlain) != std::string_view::npos ||
         csv::parse_number(name).has_value();
}

void append_name(std::string& text, const std::string& name, const std::string& source) {
  if (name.find_first_of(std::string_view("\r\n\0", 3)) != std::string::npos) {
    fail(source, ": column name '", name, "' contains a line break or zero byte");
  }
  if (!needs_quotes(name)) {
    text += name;
    return;
  }
  text += '"';
  for (const char c : name) {
    if (c == '"') text += '"';
    text += c;
  }
  text += '"';
}

}  // namespace

std::string to_csv(const Table& table) {
  const Eigen::Index columns = table.values.cols();
  if (table.has_header && static_cast<Eigen::Index>(table.names.size()) != columns) {
    fail(table.source, ": ", table.names.size(), " column names for ", columns, " columns");
  }
  std::string text;
  for (Eigen::Index j = 0; table.has_header && j < columns; ++j) {
    if (j > 0) text += ',';
    append_name(text, table.names[static_cast<std::size_t>(j)], table.source);
  }
  if (table.has_header) text += '\n';
  for (Eigen::Index i = 0; i < table.values.rows(); ++i) {
    for (Eigen::Index j = 0; j < columns; ++j) {
      if (j > 0) text += ',';
      append_number(text, table.values(i, j));
    }
    text += '\n';
  }
  return text;
}

void write_csv(const std::filesystem::path& path, const Table& table) { write_file_atomically(path, to_csv(table)); }

}  // namespace blockid
