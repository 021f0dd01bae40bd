// Throws mutated JSON at the reader of models: only Error may come out, and what is accepted is sound and reads back.
//
// As a libFuzzer target: clang++ -std=c++20 -fsanitize=fuzzer,address -DBLOCKID_LIBFUZZER json_fuzz.cpp ...
// As a test: a fixed number of inputs mutated from a small corpus with a fixed seed.

#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace {

int accepted = 0;

void require(bool promise, const char* what) {
  if (!promise) throw std::logic_error(what);
}

const blockid::Registry& registry() {
  static const blockid::Registry kRegistry = blockid::standard_registry();
  return kRegistry;
}

std::optional<blockid::Model> read(std::string_view text) {
  try {
    return blockid::model_from_json(text, registry());
  } catch (const blockid::Error&) {
    return std::nullopt;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::optional<blockid::Model> model = read({reinterpret_cast<const char*>(data), size});
  if (!model) return 0;
  ++accepted;
  blockid::check(*model);
  const std::string text = blockid::to_json(*model);
  const std::optional<blockid::Model> again = read(text);
  require(again.has_value(), "the JSON reads back");
  require(blockid::to_json(*again) == text, "same JSON after a round trip");
  require(again->parameters == model->parameters, "same parameters after a round trip");
  require(again->initial_state == model->initial_state, "same state after a round trip");
  return 0;
}

#ifndef BLOCKID_LIBFUZZER

#include "mutation.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

std::string complete_model() {
  blockid::Model model =
      blockid::make_model(blockid::parse("G=rational(nb=1,na=1) | f=polynomial(degree=1,range=[-1,1])"), 0.1);
  model.parameters << 0.5, -0.0, 5e-324, 1e308, 0.1 + 0.2;
  model.standard_deviations = Eigen::VectorXd::Constant(5, 1e-3);
  model.initial_state = Eigen::VectorXd::Constant(1, -2.5);
  model.output_unit = "\xC2\xB5V";
  return blockid::to_json(model);
}

/// Quotes in place of apostrophes.
std::string in_quotes(std::string text) {
  std::replace(text.begin(), text.end(), '\'', '"');
  return text;
}

TEST(JsonFuzz, OnlyErrorsEscapeAndAcceptedModelsReadBack) {
  constexpr int kInputs = 20000;
  blockid::testing::Mutator mutator(
      {
          complete_model(),
          blockid::to_json(blockid::make_model(blockid::parse("spline(knots=4)"))),
          in_quotes("{'format':'blockid-model','version':1,'chain':'gain','sample_time_s':2,"
                    "'parameters':[{'name':'gain1.k','value':3}]}"),
          in_quotes("{'format':'blockid-model','version':1,'chain':'delay(samples=1)','sample_time_s':1,"
                    "'parameters':[],'initial_state':[0.5],'input':{'name':'\\u00b5\\n'}}"),
      },
      {"{",
       "}",
       "[",
       "]",
       ",",
       ":",
       "\"",
       "\\",
       "null",
       "true",
       "1e999",
       "-1e308",
       "-0",
       "0.1",
       "1e-400",
       "[[[[[[[[[[",
       "{\"a\":",
       "\"name\":",
       "\"value\":1,",
       "\xff",
       "\\ud800",
       "\\u0000",
       "gain",
       "12345678901234567890123"},
      20240302);
  for (int i = 0; i < kInputs; ++i) {
    const std::string input = mutator.next();
    ASSERT_NO_THROW(LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size()))
        << ::testing::PrintToString(input);
  }
  EXPECT_GT(accepted, kInputs / 100) << "the mutations leave too little to check";
}

}  // namespace

#endif
