#include "blockid/data/csv_lines.hpp"

#include <fast_float/fast_float.h>

#include <algorithm>

#include "blockid/data/error.hpp"

namespace blockid::csv {
namespace {

constexpr std::string_view kBlanks = " \t";

/// Tabs are no blanks where they separate.
std::string_view blanks_beside(char separator) { return separator == '\t' ? kBlanks.substr(0, 1) : kBlanks; }

std::string_view trim(std::string_view text, std::string_view blanks) {
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

/// Cuts one line at a time into cells, left to right.
class Splitter {
 public:
  Splitter(const Line& line, char separator, std::string_view source)
      : text_(line.text), line_(line.number), separator_(separator), source_(source) {}

  void run(std::vector<Cell>& cells) {
    skip(blanks_beside(separator_));
    do {
      column_ = cells.size() + 1;
      cells.push_back(at_quote() ? quoted_cell() : plain_cell());
    } while (pass_separator());
  }

 private:
  [[nodiscard]] bool at_quote() const { return at_ < text_.size() && text_[at_] == '"'; }

  void skip(std::string_view blanks) { at_ = std::min(text_.find_first_not_of(blanks, at_), text_.size()); }

  Cell plain_cell() {
    const std::size_t begin = at_;
    at_ = separator_ == kWhiteSpace ? text_.find_first_of(kBlanks, at_) : text_.find(separator_, at_);
    at_ = std::min(at_, text_.size());
    return {trim(text_.substr(begin, at_ - begin), blanks_beside(separator_)), false};
  }

  Cell quoted_cell() {
    const std::size_t begin = ++at_;
    for (;; at_ += 2) {
      at_ = text_.find('"', at_);
      if (at_ == std::string_view::npos) fail(position(source_, line_, column_), ": quote without an end");
      if (at_ + 1 >= text_.size() || text_[at_ + 1] != '"') break;
    }
    const Cell cell{text_.substr(begin, at_ - begin), true};
    ++at_;
    return cell;
  }

  bool pass_separator() {
    const std::size_t cell_end = at_;
    skip(blanks_beside(separator_));
    if (at_ == text_.size()) return false;
    if (separator_ == kWhiteSpace && at_ > cell_end) return true;
    if (text_[at_] != separator_) fail(position(source_, line_, column_), ": text after the closing quote");
    ++at_;
    skip(blanks_beside(separator_));
    return true;
  }

  std::string_view text_;
  std::size_t line_;
  char separator_;
  std::string_view source_;
  std::size_t at_ = 0;
  std::size_t column_ = 1;
};

bool holds_only_numbers(const Line& line, std::string_view source) {
  std::vector<Cell> cells;
  split(line, kWhiteSpace, source, cells);
  return std::all_of(cells.begin(), cells.end(), [](const Cell& cell) { return parse_number(cell.text).has_value(); });
}

bool tabs_are_white_space(const Line& line, std::string_view source) {
  const bool mixed = line.text.back() == '\t' || line.text.find(' ') != std::string_view::npos;
  return mixed && line.text.find('"') == std::string_view::npos && holds_only_numbers(line, source);
}

bool occurs_outside_quotes(char wanted, std::string_view text) {
  bool inside = false;
  for (const char c : text) {
    if (c == '"') inside = !inside;
    if (c == wanted && !inside) return true;
  }
  return false;
}

}  // namespace

std::string position(std::string_view source, std::size_t line, std::size_t column) {
  return compose(source, ":", line, ": column ", column);
}

std::optional<Line> LineReader::next() {
  while (!rest_.empty()) {
    const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    const Line line{rest_.substr(0, end), ++number_};
    const bool crlf = rest_.substr(end, 2) == "\r\n";
    rest_.remove_prefix(std::min(end + (crlf ? 2 : 1), rest_.size()));
    const std::size_t first = line.text.find_first_not_of(kBlanks);
    if (first != std::string_view::npos && line.text[first] != '#' && line.text[first] != '%') return line;
  }
  return std::nullopt;
}

void split(const Line& line, char separator, std::string_view source, std::vector<Cell>& cells) {
  cells.clear();
  Splitter(line, separator, source).run(cells);
}

std::optional<double> parse_number(std::string_view text) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (text.empty() || text.front() == '-' || text.front() == '+') return std::nullopt;
  }
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto result = fast_float::from_chars(text.data(), end, value);
  const bool is_number = result.ec == std::errc() || result.ec == std::errc::result_out_of_range;
  if (!is_number || result.ptr != end) return std::nullopt;
  return value;
}

std::string name_of(const Cell& cell) {
  std::string name(cell.text);
  if (!cell.quoted) return name;
  for (std::size_t at = name.find("\"\""); at != std::string::npos; at = name.find("\"\"", at + 1)) name.erase(at, 1);
  return name;
}

char guess_separator(std::string_view text, std::string_view source) {
  LineReader reader(text);
  std::optional<Line> line = reader.next();
  if (!line) return kWhiteSpace;
  // The second line is data whether or not the first holds names, which may contain any character.
  if (const std::optional<Line> second = reader.next()) line = second;
  for (const char candidate : {';', ','}) {
    if (occurs_outside_quotes(candidate, line->text)) return candidate;
  }
  if (!occurs_outside_quotes('\t', line->text) || tabs_are_white_space(*line, source)) return kWhiteSpace;
  return '\t';
}

}  // namespace blockid::csv
