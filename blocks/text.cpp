#include <blockid/blocks/text.hpp>

#include <blockid/blocks/detail/children.hpp>
#include <blockid/blocks/detail/names.hpp>
#include <blockid/blocks/detail/placed_error.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/series.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

namespace blockid {
namespace {

using detail::fail_at;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool is_printable(char c) { return c >= ' ' && c <= '~'; }

bool starts_number(char c) { return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.'; }
bool continues_number(char c) { return starts_number(c) || detail::starts_name(c); }

/// The bytes in a form fit for messages: no control characters, no broken UTF-8.
std::string printable(std::string_view bytes) {
  std::string shown(bytes);
  for (char& c : shown) {
    if (!is_printable(c)) c = c == '\t' ? ' ' : '?';
  }
  return shown;
}

/// message, line and column, and the line with the place marked.
std::string marked(std::string_view text, std::size_t position, std::string_view message) {
  constexpr std::size_t kShown = 100;
  constexpr std::size_t kBefore = 60;
  position = std::min(position, text.size());
  const std::size_t newline = text.substr(0, position).rfind('\n');
  const std::size_t start = newline == std::string_view::npos ? 0 : newline + 1;
  const std::size_t end = std::min(text.find('\n', position), text.size());
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(position), '\n');
  const std::size_t column = position - start;

  const std::size_t first = column > kBefore ? column - kBefore : 0;
  const std::string_view window = text.substr(start, end - start).substr(first, kShown);
  const std::string before = first > 0 ? "  ..." : "  ";
  const std::string after = start + first + window.size() < end ? "..." : "";
  const bool one_line = text.find('\n') == std::string_view::npos;
  return compose("chain text, ", one_line ? "" : compose("line ", line, ", "), "column ", column + 1, ": ", message,
                 "\n", before, printable(window), after, "\n", std::string(before.size() + column - first, ' '), "^");
}

/// Recursive descent over the grammar in text.hpp; blocks are made as soon as their arguments are read.
class Parser {
 public:
  Parser(std::string_view text, const Registry& registry) : text_(text), registry_(registry) {}

  Series whole() {
    Series chain = row();
    skip_blanks();
    if (position_ < text_.size()) fail_expected("'|' and another block, or the end of the text");
    return chain;
  }

 private:
  class Level {
   public:
    explicit Level(Parser& parser) : parser_(parser) {
      if (++parser_.depth_ > kMaxChainDepth) {
        fail_at(parser_.position_, "brackets nest deeper than ", kMaxChainDepth, " levels");
      }
    }
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;
    ~Level() { --parser_.depth_; }

   private:
    Parser& parser_;
  };

  struct Item {
    std::size_t position;
    LabelledBlock labelled;
  };

  void skip_blanks() {
    while (position_ < text_.size() && is_blank(text_[position_])) ++position_;
  }

  /// Next character after blanks, '\0' at the end.
  char peek() {
    skip_blanks();
    return position_ < text_.size() ? text_[position_] : '\0';
  }

  bool accept(char c) {
    if (peek() != c || position_ >= text_.size()) return false;
    ++position_;
    return true;
  }

  [[noreturn]] void fail_expected(std::string_view expected) {
    if (peek() == '\0' && position_ >= text_.size()) {
      fail_at(position_, "expected ", expected, ", got the end of the text");
    }
    std::size_t end = position_ + 1;
    if (continues_number(text_[position_])) {
      while (end < text_.size() && end < position_ + 40 && continues_number(text_[end])) ++end;
    }
    fail_at(position_, "expected ", expected, ", got '", printable(text_.substr(position_, end - position_)), "'");
  }

  std::string name(std::string_view what) {
    if (!detail::starts_name(peek())) fail_expected(what);
    const std::size_t start = position_;
    while (position_ < text_.size() && detail::continues_name(text_[position_])) ++position_;
    return std::string(text_.substr(start, position_ - start));
  }

  double number() {
    if (!starts_number(peek())) fail_expected("a number");
    const std::size_t start = position_;
    while (position_ < text_.size() && continues_number(text_[position_])) ++position_;
    const std::string_view token = text_.substr(start, position_ - start);
    const std::string_view digits = token.front() == '+' ? token.substr(1) : token;
    double value = 0.0;
    const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (status == std::errc::result_out_of_range) {
      fail_at(start, "the number '", token.substr(0, 40), "' is beyond what a double can hold");
    }
    if (status != std::errc() || end != digits.data() + digits.size() || digits.starts_with('+') ||
        (token.front() == '+' && digits.starts_with('-')) || !std::isfinite(value)) {
      fail_at(start, "expected a finite number, got '", token.substr(0, 40), "'");
    }
    return value;
  }

  /// After the opening bracket.
  std::vector<double> list() {
    std::vector<double> values;
    std::size_t colon = std::string_view::npos;
    if (accept(']')) return values;
    for (;;) {
      values.push_back(number());
      if (accept(']')) break;
      if (peek() == ':') {
        colon = position_++;
      } else if (!accept(',') && !starts_number(peek())) {
        fail_expected("',' and another number, or ']'");
      }
    }
    if (colon != std::string_view::npos && values.size() != 2) {
      fail_at(colon, "a colon stands between the two numbers of a range [lower:upper]; separate lists by commas");
    }
    return values;
  }

  BlockArguments::Value value() {
    const char next = peek();
    if (accept('[')) return list();
    if (detail::starts_name(next)) return name("a word");
    if (starts_number(next)) return number();
    fail_expected("a value: a number, a word or a list [...]");
  }

  BlockArguments::Argument argument() {
    const std::size_t start = (skip_blanks(), position_);
    if (detail::starts_name(peek())) {
      std::string key = name("a key");
      if (accept('=')) {
        const std::size_t place = (skip_blanks(), position_);
        // An unknown key is marked itself, any other mistake is one of the value.
        const bool known = takes(key);
        // No key but the label of the first block of a nested row.
        const bool is_label = !known && takes("") && (detail::starts_name(peek()) || peek() == '(');
        if (!is_label) return {std::move(key), value(), known ? place : start};
      }
      position_ = start;
    } else if (peek() != '[' && peek() != '(') {
      fail_expected("an argument key=value or a nested block");
    }
    return {"", nested(), start};
  }

  /// A row of several blocks, or of one with a label, as a Series; a single block as it is.
  AnyBlock nested() {
    std::vector<Item> row = items();
    if (row.size() == 1 && row.front().labelled.label.empty()) return row.front().labelled.block;
    return Series(distinct(std::move(row)));
  }

  bool takes(std::string_view key) const {
    const std::vector<ArgumentKey>& keys = kind_->keys;
    return std::any_of(keys.begin(), keys.end(), [&](const ArgumentKey& one) { return one.key == key; });
  }

  AnyBlock named_block() {
    const std::size_t start = position_;
    std::string kind = name("a kind of block");
    const Registry::Kind* outer = kind_;
    kind_ = &known_kind(kind, start);
    std::vector<BlockArguments::Argument> arguments;
    if (accept('(') && !accept(')')) {
      const Level level(*this);
      do {
        arguments.push_back(argument());
      } while (accept(','));
      if (!accept(')')) fail_expected("',' and another argument, or ')'");
    }
    kind_ = outer;
    try {
      return registry_.make(BlockArguments(std::move(kind), std::move(arguments), start));
    } catch (const detail::PlacedError&) {
      throw;
    } catch (const Error& error) {
      throw detail::PlacedError(start, error.what());
    }
  }

  const Registry::Kind& known_kind(std::string_view kind, std::size_t start) const {
    try {
      return registry_.at(kind);
    } catch (const Error& error) {
      throw detail::PlacedError(start, error.what());
    }
  }

  AnyBlock primary() {
    skip_blanks();
    if (++blocks_ > kMaxChainBlocks) fail_at(position_, "more than ", kMaxChainBlocks, " blocks");
    const std::size_t start = position_;
    if (accept('[')) {
      const Level level(*this);
      return sum(start);
    }
    if (accept('(')) {
      const Level level(*this);
      Series chain = row();
      if (!accept(')')) fail_expected("'|' and another block, or ')'");
      return chain;
    }
    if (!detail::starts_name(peek())) fail_expected("a block: a kind, '[' or '('");
    return named_block();
  }

  Item item() {
    const std::size_t start = (skip_blanks(), position_);
    std::string label;
    if (detail::starts_name(peek())) {
      label = name("a label");
      if (!accept('=')) {
        label.clear();
        position_ = start;
      }
    }
    return {start, {std::move(label), primary()}};
  }

  std::vector<Item> items() {
    std::vector<Item> all = {item()};
    while (accept('|')) all.push_back(item());
    return all;
  }

  /// The blocks without their places, after a look at their names.
  static std::vector<LabelledBlock> distinct(std::vector<Item> items) {
    std::vector<LabelledBlock> blocks;
    blocks.reserve(items.size());
    for (Item& item : items) blocks.push_back(std::move(item.labelled));
    std::set<std::string> names;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const std::string name = detail::child_name(blocks, k);
      if (!names.insert(name).second) {
        fail_at(items[k].position, "the label '", name, "' comes twice; labels within one row or sum must differ");
      }
    }
    return blocks;
  }

  Series row() { return Series(distinct(items())); }

  /// After the opening bracket at `start`.
  AnyBlock sum(std::size_t start) {
    std::vector<Item> branches;
    do {
      const std::size_t place = (skip_blanks(), position_);
      std::vector<Item> branch = items();
      if (branch.size() == 1) {
        branches.push_back(std::move(branch.front()));
      } else {
        branches.push_back({place, {"", Series(distinct(std::move(branch)))}});
      }
    } while (accept('+'));
    if (!accept(']')) fail_expected("'|' and another block, '+' and another branch, or ']'");
    try {
      return Parallel(distinct(std::move(branches)));
    } catch (const detail::PlacedError&) {
      throw;
    } catch (const Error& error) {
      throw detail::PlacedError(start, error.what());
    }
  }

  std::string_view text_;
  const Registry& registry_;
  const Registry::Kind* kind_ = nullptr;
  std::size_t position_ = 0;
  int depth_ = 0;
  int blocks_ = 0;
};

/// Writes blocks within the limits that the parser keeps.
class Writer {
 public:
  std::string row(const std::vector<LabelledBlock>& items) {
    std::string text;
    for (const LabelledBlock& one : items) text += (text.empty() ? "" : " | ") + item(one);
    return text;
  }

  std::string primary(const AnyBlock& block) {
    if (++blocks_ > kMaxChainBlocks) fail("text form: the chain has more than ", kMaxChainBlocks, " blocks");
    const auto* series = block.target<Series>();
    const auto* parallel = block.target<Parallel>();
    if (series == nullptr && parallel == nullptr) return named(block);
    if (++depth_ > kMaxChainDepth) fail("text form: the chain nests deeper than ", kMaxChainDepth, " levels");
    std::string text = series != nullptr ? "(" + row(series->children()) + ")" : "[" + sum(parallel->children()) + "]";
    --depth_;
    return text;
  }

 private:
  std::string item(const LabelledBlock& item) {
    if (item.label.empty()) return primary(item.block);
    if (!detail::is_name(item.label)) {
      fail("text form: a label must be a name of letters, digits and _ that starts with no digit, got '",
           printable(item.label), "'");
    }
    return item.label + "=" + primary(item.block);
  }

  std::string sum(const std::vector<LabelledBlock>& branches) {
    std::string text;
    for (const LabelledBlock& branch : branches) {
      const auto* series = branch.label.empty() ? branch.block.target<Series>() : nullptr;
      const bool open = series != nullptr && series->children().size() > 1;
      text += (text.empty() ? "" : " + ") + (open ? row(series->children()) : item(branch));
    }
    return text;
  }

  static std::string named(const AnyBlock& block) {
    std::string arguments;
    for (const auto& [key, value] : block.arguments()) {
      if (!arguments.empty()) arguments += ',';
      arguments += key.empty() ? value : key + "=" + value;
    }
    return arguments.empty() ? block.kind() : block.kind() + "(" + arguments + ")";
  }

  int depth_ = 0;
  int blocks_ = 0;
};

}  // namespace

AnyBlock parse(std::string_view text, const Registry& registry) {
  if (text.size() > kMaxChainText) {
    fail("chain text: expected at most ", kMaxChainText, " bytes, got ", text.size());
  }
  try {
    return Parser(text, registry).whole();
  } catch (const detail::PlacedError& error) {
    throw Error(marked(text, error.position(), error.what()));
  }
}

std::string to_text(const AnyBlock& block) {
  const auto* series = block.target<Series>();
  return series != nullptr ? Writer().row(series->children()) : Writer().primary(block);
}

std::string to_nested_text(const AnyBlock& block) { return Writer().primary(block); }

}  // namespace blockid
