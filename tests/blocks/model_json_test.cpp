#include <blockid/blocks/model_json.hpp>

#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/atomic_file.hpp>
#include <blockid/data/error.hpp>

#include "support/temp_dir.hpp"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Model example() {
  Model model = make_model(parse("G=rational(nb=1,na=1) | f=polynomial(degree=1,range=[-1,1])"), 0.1);
  model.parameters << 0.5, -0.25, -0.9, 0.1, 1.0 / 3.0;
  model.input_name = "u";
  model.input_unit = "V";
  model.output_name = "flow \"1\", \xC2\xB5l/s";
  return model;
}

std::string refusal(const std::string& text) {
  try {
    model_from_json(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

/// The example's JSON with one piece replaced.
std::string with(const std::string& piece, const std::string& replacement) {
  std::string text = to_json(example());
  const std::size_t at = text.find(piece);
  if (at == std::string::npos) throw std::logic_error("no " + piece + " in " + text);
  return text.replace(at, piece.size(), replacement);
}

std::vector<std::uint64_t> bits(const Eigen::VectorXd& v) {
  std::vector<std::uint64_t> result;
  for (const double value : v) result.push_back(std::bit_cast<std::uint64_t>(value));
  return result;
}

void expect_same(const Model& a, const Model& b) {
  EXPECT_EQ(to_text(a.chain), to_text(b.chain));
  EXPECT_EQ(bits(a.parameters), bits(b.parameters));
  EXPECT_EQ(bits(a.standard_deviations), bits(b.standard_deviations));
  EXPECT_EQ(bits(a.initial_state), bits(b.initial_state));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a.sample_time_s), std::bit_cast<std::uint64_t>(b.sample_time_s));
  EXPECT_EQ(a.input_name, b.input_name);
  EXPECT_EQ(a.input_unit, b.input_unit);
  EXPECT_EQ(a.output_name, b.output_name);
  EXPECT_EQ(a.output_unit, b.output_unit);
}

TEST(ModelJson, IsWhatTheDocumentationShows) {
  Model model = make_model(parse("G=rational(nb=0,na=1)"), 0.5);
  model.parameters << 1.5, -0.5;
  EXPECT_EQ(to_json(model),
            "{\n"
            "  \"format\": \"blockid-model\",\n"
            "  \"version\": 1,\n"
            "  \"chain\": \"G=rational(nb=0,na=1)\",\n"
            "  \"sample_time_s\": 0.5,\n"
            "  \"input\": {\"name\":\"u\",\"unit\":\"\"},\n"
            "  \"output\": {\"name\":\"y\",\"unit\":\"\"},\n"
            "  \"parameters\": [\n"
            "    {\"name\":\"G.b0\",\"value\":1.5},\n"
            "    {\"name\":\"G.a1\",\"value\":-0.5}\n"
            "  ],\n"
            "  \"initial_state\": []\n"
            "}\n");
}

TEST(ModelJson, RoundTrip) {
  Model model = example();
  expect_same(model_from_json(to_json(model)), model);
  model.standard_deviations = Eigen::VectorXd::LinSpaced(5, 0.0, 0.7);
  model.initial_state = Eigen::VectorXd::Constant(model.chain.state_count(), 0.1);
  expect_same(model_from_json(to_json(model)), model);
  EXPECT_EQ(to_json(model_from_json(to_json(model))), to_json(model));
}

TEST(ModelJson, NumbersReadBackBitForBit) {
  Model model = make_model(parse("fir(nb=9)"), 0.1 + 0.2);
  model.parameters << -0.0, 5e-324, -2.2250738585072009e-308, 1e308, std::numeric_limits<double>::max(), 0.1 + 0.2,
      1.0 / 3.0, 9007199254740993.0, 123456789012345678.0, -1e-300;
  model.initial_state = model.parameters.tail(model.chain.state_count()).reverse();
  model.standard_deviations = model.parameters.cwiseAbs();
  expect_same(model_from_json(to_json(model)), model);

  std::mt19937_64 generator(3);
  for (int trial = 0; trial < 300; ++trial) {
    for (double& value : model.parameters) {
      do {
        value = std::bit_cast<double>(generator());
      } while (!std::isfinite(value));
    }
    expect_same(model_from_json(to_json(model)), model);
  }
}

TEST(ModelJson, ChainThatIsNoSeries) {
  Model model = make_model(Rational(1, 1), 1.0);
  const Model again = model_from_json(to_json(model));
  EXPECT_NE(again.chain.target<Series>(), nullptr);
  EXPECT_EQ(bits(again.parameters), bits(model.parameters));
}

TEST(ModelJson, ChainWithoutParameters) {
  const Model model = make_model(parse("delay(samples=2)"), 1.0);
  expect_same(model_from_json(to_json(model)), model);
}

TEST(ModelJson, OptionalMembers) {
  const Model model = model_from_json(
      R"({"format":"blockid-model","version":1,"chain":"gain","sample_time_s":2,
          "parameters":[{"value":3,"name":"gain1.k"}],"input":{"name":"p"}})");
  EXPECT_EQ(model.parameters[0], 3.0);
  EXPECT_EQ(model.input_name, "p");
  EXPECT_EQ(model.output_name, "y");
  EXPECT_EQ(model.initial_state.size(), 0);
}

TEST(ModelJson, SimulatesAlike) {
  const Model model = example();
  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(50, -1.0, 1.0).array().sin();
  EXPECT_EQ(simulate(model_from_json(to_json(model)), u), simulate(model, u));
}

TEST(ModelJsonErrors, WritingRefuses) {
  Model model = example();
  model.parameters[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(to_json(model), Error);
  model = example();
  model.parameters[2] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(to_json(model), Error);
  model = example();
  model.initial_state = Eigen::VectorXd::Constant(1, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW(to_json(model), Error);
  model = example();
  model.standard_deviations = Eigen::VectorXd::Ones(4);
  EXPECT_THROW(to_json(model), Error);
  model = example();
  model.standard_deviations = Eigen::VectorXd::Constant(5, -1.0);
  EXPECT_THROW(to_json(model), Error);
  model = example();
  model.sample_time_s = 0.0;
  EXPECT_THROW(to_json(model), Error);
  model = example();
  model.output_unit = "\xB5l";
  EXPECT_THROW(to_json(model), Error);
}

struct Nameless {
  Index parameter_count() const { return 0; }
  template <class T>
  void apply(std::span<const T>, std::span<T>, std::span<const T> u, std::span<T> y) const {
    std::copy(u.begin(), u.end(), y.begin());
  }
};

TEST(ModelJsonErrors, BlockWithoutKindCannotBeSaved) {
  EXPECT_THROW(to_json(make_model(Nameless{})), Error);
  EXPECT_THROW(to_json(make_model(Series({{"a", Series({{"b", Nameless{}}})}}))), Error);
}

TEST(ModelJsonErrors, NameThePlace) {
  EXPECT_EQ(refusal(with("\"G.b1\"", "\"G.b2\"")), "model JSON: /parameters/1/name: expected \"G.b1\", got \"G.b2\"");
  EXPECT_EQ(refusal(with("-0.25", "\"abc\"")), "model JSON: /parameters/1/value: expected a number, got \"abc\"");
  EXPECT_EQ(refusal(with("-0.25", "null")), "model JSON: /parameters/1/value: expected a number, got null");
  EXPECT_EQ(refusal(with("-0.25", "[1]")), "model JSON: /parameters/1/value: expected a number, got an array");
  EXPECT_EQ(refusal(with("\"blockid-model\"", "\"other\"")),
            "model JSON: /format: expected \"blockid-model\", got \"other\"");
  EXPECT_EQ(refusal(with("\"version\": 1", "\"version\": 2")), "model JSON: /version: expected 1, got 2");
  EXPECT_EQ(refusal(with("0.1,", "-1,")), "model JSON: /sample_time_s: expected a positive number, got -1");
  EXPECT_THAT(refusal(with("na=1", "nc=1")),
              AllOf(StartsWith("model JSON: /chain: chain text, column 17"), HasSubstr("rational has no key 'nc'")));
}

TEST(ModelJsonErrors, CountsMustFit) {
  EXPECT_EQ(refusal(with(",\n    {\"name\":\"G.b1\",\"value\":-0.25}", "")),
            "model JSON: /parameters: the chain has 5 parameters, got 4");
  EXPECT_EQ(refusal(with("\"initial_state\": []", "\"initial_state\": [1,2]")),
            "model JSON: /initial_state: the chain has 1 states, expected as many numbers or none, got 2");
  EXPECT_THAT(refusal(with("-0.25", "-0.25,\"standard_deviation\":1")),
              HasSubstr("/parameters/1: expected a standard deviation with every parameter or with none"));
  EXPECT_THAT(refusal(with("0.5}", "0.5,\"standard_deviation\":-1}")), HasSubstr("expected a number >= 0, got -1"));
}

TEST(ModelJsonErrors, Members) {
  EXPECT_EQ(refusal(with("  \"chain\"", "  \"extra\": 1, \"chain\"")),
            "model JSON: /: unknown member 'extra'; expected format, version, chain, sample_time_s, parameters, "
            "initial_state, input, output");
  EXPECT_THAT(refusal(with("\"value\":-0.25", "\"valu\":-0.25")), HasSubstr("the member 'value' is missing"));
  EXPECT_EQ(refusal("{}"), "model JSON: /: the member 'format' is missing, expected \"blockid-model\"");
  EXPECT_EQ(refusal("[]"), "model JSON: /: expected an object, got an array");
  EXPECT_EQ(refusal(R"({"format":"blockid-model"})"), "model JSON: /: the member 'version' is missing, expected 1");
  EXPECT_THAT(refusal(with("-0.25", "-0.25,\"value\":-0.25")),
              HasSubstr("/parameters/1/value: the member comes twice"));
  EXPECT_THAT(refusal(with("  \"version\"", "  \"format\": \"x\", \"version\"")),
              HasSubstr("/format: the member comes twice"));
}

TEST(ModelJsonErrors, NoJson) {
  EXPECT_THAT(refusal(""), AllOf(StartsWith("model JSON: expected JSON: "), HasSubstr("line 1, column 1")));
  EXPECT_THAT(refusal("{"), HasSubstr("expected JSON"));
  EXPECT_THAT(refusal(to_json(example()) + "x"), HasSubstr("expected JSON"));
  EXPECT_THAT(refusal("\xff\xfe"), HasSubstr("expected JSON"));
  EXPECT_THAT(refusal(with("-0.25", "NaN")), HasSubstr("expected JSON"));
  EXPECT_THAT(refusal(with("-0.25", "1e999")), HasSubstr("1e999"));
}

TEST(ModelJsonErrors, DeepNestingIsRefused) {
  for (const char* open : {"[", "{\"a\":"}) {
    std::string text;
    for (int k = 0; k < 300'000; ++k) text += open;
    EXPECT_THAT(refusal(text), AllOf(HasSubstr("at most 8 nested levels"), ::testing::SizeIs(::testing::Lt(200U))));
  }
}

TEST(ModelFile, RoundTripAndErrorsNameTheFile) {
  const testing::TempDir folder;
  const auto path = folder / "model.json";
  save_model(path, example());
  expect_same(load_model(path), example());

  write_file_atomically(path, with("-0.25", "true"));
  try {
    load_model(path);
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()), path.string() + ": /parameters/1/value: expected a number, got true");
  }
  EXPECT_THROW(load_model(folder / "missing.json"), Error);
  EXPECT_THROW(save_model(folder / "no" / "such" / "folder.json", example()), Error);
}

TEST(ModelFile, RefusedModelLeavesTheOldFile) {
  const testing::TempDir folder;
  const auto path = folder / "model.json";
  save_model(path, example());
  Model broken = example();
  broken.parameters[0] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(save_model(path, broken), Error);
  expect_same(load_model(path), example());
}

}  // namespace
}  // namespace blockid
