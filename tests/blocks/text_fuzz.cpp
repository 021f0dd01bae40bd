// Throws mutated texts at the parser of chains: only Error may come out, and what is accepted reads back the same.
//
// As a libFuzzer target: clang++ -std=c++20 -fsanitize=fuzzer,address -DBLOCKID_LIBFUZZER text_fuzz.cpp ...
// As a test: a fixed number of inputs mutated from a small corpus with a fixed seed.

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

std::optional<blockid::AnyBlock> parsed(std::string_view text) {
  try {
    return blockid::parse(text, registry());
  } catch (const blockid::Error&) {
    return std::nullopt;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::optional<blockid::AnyBlock> block = parsed({reinterpret_cast<const char*>(data), size});
  if (!block) return 0;
  ++accepted;
  const std::string text = blockid::to_text(*block);
  const std::optional<blockid::AnyBlock> again = parsed(text);
  require(again.has_value(), "the text form reads back");
  require(blockid::to_text(*again) == text, "same text after a round trip");
  require(again->parameter_names() == block->parameter_names(), "same parameters after a round trip");
  require(again->state_count() == block->state_count(), "same state after a round trip");
  require(again->initial_parameters() == block->initial_parameters(), "same start after a round trip");
  return 0;
}

#ifndef BLOCKID_LIBFUZZER

#include "mutation.hpp"

#include <gtest/gtest.h>

namespace {

TEST(TextFuzz, OnlyErrorsEscapeAndAcceptedTextsReadBack) {
  constexpr int kInputs = 20000;
  blockid::testing::Mutator mutator(
      {
          "G1=rational(nb=3,na=3) | f=spline(knots=20) | G2=rational(nb=3,na=3)",
          "[a=rational(nb=1,na=1) + f=polynomial(degree=3,range=[-1,1]) | fir(nb=4,nk=1)] | offset",
          "(gain | delay(samples=2)) | [saturation | gain + dead_zone]",
          "f = piecewise_linear( knots = [-1, 0.5 2.25e0] )\n| tanh_network(units=3,range=[0:2])",
          "spline(knots=5,placement=quantile)|spline(knots=5,range=[-1e300,1e300])",
          "[[[gain]]]",
          "biquads(sections=2,stable=true)",
          "continuous_rational(nb=1,na=2,sample_time=0.1,hold=foh,break_points=[1,2])",
          "gain|svf(order=2,pole=3,sample_time=1)",
      },
      {"[",
       "]",
       "(",
       ")",
       "|",
       "+",
       "=",
       ",",
       ":",
       " ",
       "\n",
       "-",
       "1e999",
       "1e308",
       "-0",
       "nan",
       "inf",
       "5e-324",
       "1000000000",
       "true",
       "x",
       "gain",
       "knots=",
       "range=[",
       "[[[[[[[[[[[[[[[[",
       "((((((((((((((((",
       "\xff",
       "0.5"},
      20240301);
  for (int i = 0; i < kInputs; ++i) {
    const std::string input = mutator.next();
    ASSERT_NO_THROW(LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size()))
        << ::testing::PrintToString(input);
  }
  EXPECT_GT(accepted, kInputs / 100) << "the mutations leave too little to check";
}

}  // namespace

#endif
