#include <blockid/cli/continuous_options.hpp>

#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/rational_basis.hpp>

#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>

namespace blockid::cli {
namespace {

std::vector<std::string> split_at_colons(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ':');) parts.push_back(part);
  return parts;
}

std::optional<double> positive_number(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool complete = error == std::errc{} && end == text.data() + text.size();
  if (!complete || !std::isfinite(value) || !(value > 0.0)) return std::nullopt;
  return value;
}

FrequencyRange range_of(const std::string& option, const std::string& text, const std::vector<std::string>& parts) {
  const std::optional<double> low = positive_number(parts[0]);
  const std::optional<double> high = positive_number(parts[1]);
  if (!low || !high || *low > *high) {
    fail(option, " ", text, ": expected two frequencies in rad/s, 0 < LO <= HI, such as 0.1:1000");
  }
  return {*low, *high};
}

}  // namespace

Degrees parse_degrees(const std::vector<int>& orders) {
  constexpr std::size_t kBoth = 2;
  if (orders.size() != kBoth || orders[0] < 0 || orders[1] < 1 || orders[0] > orders[1]) {
    fail("--orders: expected NB,NA with 0 <= NB <= NA and NA >= 1");
  }
  return {orders[0], orders[1]};
}

MissingCoefficients parse_without(const std::vector<std::string>& names, const Degrees& degrees) {
  std::vector<std::pair<std::string, Index>> left;
  for (Index power = degrees.denominator - 1; power >= 0; --power)
    left.emplace_back("a" + std::to_string(power), power);
  for (Index power = degrees.numerator; power >= 0; --power) left.emplace_back("b" + std::to_string(power), power);
  MissingCoefficients missing;
  for (const std::string& name : names) {
    const auto found = std::find_if(left.begin(), left.end(), [&](const auto& one) { return one.first == name; });
    if (found == left.end()) {
      std::string known;
      for (const auto& [other, power] : left) known += (known.empty() ? "" : ", ") + other;
      fail("--without ", name, ": expected one of ", known);
    }
    (name.front() == 'b' ? missing.numerator : missing.denominator).push_back(found->second);
    left.erase(found);
  }
  if (std::ssize(missing.numerator) == degrees.numerator + 1) {
    fail("--without: expected at least one coefficient of the numerator to remain");
  }
  return missing;
}

FrequencyRange parse_frequency_range(const std::string& option, const std::string& text) {
  const std::vector<std::string> parts = split_at_colons(text);
  if (parts.size() != 2) fail(option, " ", text, ": expected LO:HI in rad/s, such as 0.1:1000");
  return range_of(option, text, parts);
}

Eigen::VectorXd parse_break_points(const std::string& text, Index count, const FrequencyRange& band) {
  constexpr std::size_t kWithCount = 3;
  const std::vector<std::string> parts = split_at_colons(text);
  if (parts.size() != 2 && parts.size() != kWithCount) {
    fail("--break-points ", text, ": expected LO:HI or LO:HI:COUNT in rad/s, such as 0.1:1000");
  }
  const FrequencyRange range = range_of("--break-points", text, parts);
  if (parts.size() == kWithCount && parts[2] != std::to_string(count)) {
    fail("--break-points ", text, ": a denominator of degree ", count, " has ", count, " break points, got ", parts[2]);
  }
  if (range.low > band.high || range.high < band.low) {
    fail("--break-points ", text, ": outside the band of the data, ", number(band.low), " to ", number(band.high),
         " rad/s");
  }
  return break_points(range.low, range.high, count);
}

Hold parse_hold(const std::string& word) {
  if (const std::optional<Hold> hold = hold_from_text(word)) return *hold;
  std::string known;
  for (const Hold hold : holds()) known += (known.empty() ? "" : ", ") + blockid::to_text(hold);
  fail("--hold ", word, ": expected one of ", known);
}

}  // namespace blockid::cli
