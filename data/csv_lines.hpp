#pragma once

// Internal to csv*.cpp: physical lines and their cells.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace blockid::csv {

inline constexpr char kWhiteSpace = ' ';

struct Line {
  std::string_view text;
  std::size_t number = 0;  ///< 1-based
};

struct Cell {
  std::string_view text;  ///< without surrounding blanks and quotes
  bool quoted = false;
};

/// Where messages point: "source:line: column c" with 1-based line and column.
[[nodiscard]] std::string position(std::string_view source, std::size_t line, std::size_t column);

/// Walks over the lines that hold cells: neither blank nor comment.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {}
  [[nodiscard]] std::optional<Line> next();

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

/// Replaces cells by those of the line.
void split(const Line& line, char separator, std::string_view source, std::vector<Cell>& cells);

/// The number a cell holds (a leading + is allowed), or nothing; out of range gives an infinity or
/// 0.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// The cell's text with doubled quotes undone.
[[nodiscard]] std::string name_of(const Cell& cell);

/// The separator that the first lines suggest; rules in parse_csv.
[[nodiscard]] char guess_separator(std::string_view text, std::string_view source);

}  // namespace blockid::csv
