// Throws mutated texts at the CSV reader: only Error may come out, and what is accepted is a finite rectangle.
//
// As a libFuzzer target: clang++ -std=c++20 -fsanitize=fuzzer,address -DBLOCKID_LIBFUZZER csv_fuzz.cpp ...
// As a test: a fixed number of inputs mutated from a small corpus with a fixed seed.

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "blockid/data/csv.hpp"
#include "blockid/data/error.hpp"

namespace {

using blockid::CsvOptions;
using blockid::Table;

void require(bool promise, const char* what) {
  if (!promise) throw std::logic_error(what);
}

bool same(double a, double b) { return a == b ? std::signbit(a) == std::signbit(b) : std::isnan(a) && std::isnan(b); }

void require_promises(const Table& table, const CsvOptions& options) {
  require(table.values.rows() > 0 && table.values.cols() > 0, "not empty");
  require(static_cast<Eigen::Index>(table.names.size()) == table.values.cols(), "a name for each column");
  for (const double value : table.values.reshaped()) {
    require(std::isfinite(value) || (options.allow_missing && std::isnan(value)), "finite");
  }
}

void require_round_trip(const Table& table) {
  CsvOptions options;
  options.separator = ',';
  options.header = table.has_header;
  options.allow_missing = true;
  const Table again = blockid::parse_csv(blockid::to_csv(table), "again", options);
  require(again.values.rows() == table.values.rows() && again.values.cols() == table.values.cols(),
          "same size after a round trip");
  require(again.names == table.names, "same names after a round trip");
  for (Eigen::Index i = 0; i < table.values.size(); ++i) {
    require(same(again.values.reshaped()[i], table.values.reshaped()[i]), "same values after a round trip");
  }
}

CsvOptions options_from(std::uint8_t byte) {
  CsvOptions options;
  options.allow_missing = (byte & 1U) != 0;
  if ((byte & 2U) != 0) options.header = (byte & 4U) != 0;
  if ((byte & 8U) != 0) options.separator = ",; \t"[(byte >> 4U) & 3U];
  return options;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const CsvOptions options = options_from(data[0]);
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  Table table;
  try {
    table = blockid::parse_csv(text, "fuzz", options);
  } catch (const blockid::Error&) {
    return 0;
  }
  require_promises(table, options);
  require_round_trip(table);
  return 0;
}

#ifndef BLOCKID_LIBFUZZER

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

namespace {

const std::vector<std::string> kCorpus = {
    "u,y\n1,2\n3,4\n",
    "\xEF\xBB\xBF\"flow, l/s\";\"y\"\"z\"\r\n1.5;-2e-3\r\n+3;.4\r\n",
    "   5.3100000e-02\t  -3.1300000e-02\t\n   5.2600000e-02\t  -3.2800000e-02\t\n",
    "# comment\n% another\n\n0.00   9.000  129.320\n2.00   9.000  129.320\n",
    "a b c\n1\n2\n",
    "t\tu [V]\n1\t\n\tnan\n",
    "1\r2\r1e308\r-1e-320\r",
};

class Mutator {
 public:
  explicit Mutator(unsigned seed) : generator_(seed) {}

  std::string next() {
    std::string text = kCorpus[below(kCorpus.size())];
    for (std::size_t edits = below(6); edits > 0; --edits) mutate(text);
    return static_cast<char>(below(64)) + text;
  }

 private:
  std::size_t below(std::size_t limit) { return std::uniform_int_distribution<std::size_t>(0, limit - 1)(generator_); }

  std::string_view token() {
    static constexpr std::array<std::string_view, 20> kTokens = {",",    ";", "\t",    " ",   "\n",   "\r\n", "\"",
                                                                 "\"\"", "#", "%",     "nan", "inf",  "-",    "+",
                                                                 "e",    ".", "1e999", "0",   "\xff", "\r"};
    return kTokens[below(kTokens.size())];
  }

  void mutate(std::string& text) {
    const std::size_t at = below(text.size() + 1);
    switch (below(5)) {
      case 0:
        text.insert(at, token());
        break;
      case 1:
        text.erase(at, below(4));
        break;
      case 2:
        if (at < text.size()) text[at] = static_cast<char>(below(256));
        break;
      case 3:
        text.insert(at, text.substr(below(text.size() + 1), below(12)));
        break;
      default:
        text += kCorpus[below(kCorpus.size())].substr(0, below(20));
        break;
    }
  }

  std::mt19937 generator_;
};

TEST(CsvFuzz, OnlyErrorsEscapeAndAcceptedTablesAreFiniteRectangles) {
  constexpr int kInputs = 20000;
  Mutator mutator(20240229);
  for (int i = 0; i < kInputs; ++i) {
    const std::string input = mutator.next();
    ASSERT_NO_THROW(LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size()))
        << ::testing::PrintToString(input);
  }
}

}  // namespace

#endif
