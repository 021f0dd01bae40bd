#include <blockid/cli/text_table.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <ostream>

namespace blockid::cli {
namespace {

std::string formatted(double value, std::chars_format format, int precision) {
  if (std::isnan(value)) return "nan";
  std::array<char, 400> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format, precision);
  return {buffer.data(), result.ptr};
}

/// Characters, not bytes: continuation bytes of UTF-8 take no room.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

}  // namespace

std::string number(double value, int digits) { return formatted(value, std::chars_format::general, digits); }

std::string fixed_number(double value, int decimals) { return formatted(value, std::chars_format::fixed, decimals); }

std::string with_unit(const std::string& text, const std::string& unit) {
  return unit.empty() ? text : text + " " + unit;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

void print(std::ostream& stream, const TextTable& table) {
  std::vector<std::size_t> widths;
  std::vector<std::string> headers;
  for (const TextTable::Column& column : table.columns) {
    headers.push_back(column.header);
    widths.push_back(width_of(column.header));
  }
  for (const std::vector<std::string>& row : table.rows) {
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], width_of(row[k]));
  }
  const auto print_row = [&](const std::vector<std::string>& row) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const std::string padding(widths[k] - width_of(row[k]), ' ');
      line += "  ";
      line += table.columns[k].align == TextTable::Align::right ? padding + row[k] : row[k] + padding;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    stream << line << '\n';
  };
  print_row(headers);
  for (const std::vector<std::string>& row : table.rows) print_row(row);
}

}  // namespace blockid::cli
