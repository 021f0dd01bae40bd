// Numbers and tables as text.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace blockid::cli {

/// Shortest of fixed and scientific with so many significant digits; "nan", "inf".
std::string number(double value, int digits = 6);

/// With so many digits behind the point.
std::string fixed_number(double value, int decimals);

/// "0.5 V", or "0.5" when there is no unit.
std::string with_unit(const std::string& text, const std::string& unit);

/// "a, b, c"
std::string joined(const std::vector<std::string>& words);

/// Rows of cells under headers; columns as wide as they need to be.
struct TextTable {
  enum class Align { left, right };
  struct Column {
    std::string header;
    Align align = Align::right;
  };
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;
};
using Align = TextTable::Align;

/// Headers, then rows, each line indented by two blanks and without blanks at its end.
void print(std::ostream& stream, const TextTable& table);

}  // namespace blockid::cli
