#include <blockid/blocks/text.hpp>

#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// The message with which parse() refuses the text.
std::string refusal(std::string_view text, const Registry& registry = standard_registry()) {
  try {
    parse(text, registry);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

std::vector<std::string> names(std::string_view text) { return parse(text).parameter_names(); }

Eigen::VectorXd output(const AnyBlock& block, const Eigen::VectorXd& theta) {
  Eigen::VectorXd u(40);
  for (Index t = 0; t < u.size(); ++t) u[t] = std::sin(0.3 * static_cast<double>(t * t));
  Eigen::VectorXd x = Eigen::VectorXd::Constant(block.state_count(), 0.1);
  Eigen::VectorXd y(u.size());
  const auto size = [](Index n) { return static_cast<std::size_t>(n); };
  block.apply(std::span<const double>(theta.data(), size(theta.size())), std::span<double>(x.data(), size(x.size())),
              std::span<const double>(u.data(), size(u.size())), std::span<double>(y.data(), size(y.size())));
  return y;
}

TEST(Text, RowKeepsLabelsAndOrder) {
  const AnyBlock chain = parse("G1=rational(nb=1,na=2) | f=polynomial(degree=2) | rational(nb=0,na=1,nk=3)");
  const auto* series = chain.target<Series>();
  ASSERT_NE(series, nullptr);
  ASSERT_EQ(series->children().size(), 3U);
  EXPECT_EQ(series->children()[0].label, "G1");
  EXPECT_EQ(series->children()[2].label, "");
  const auto* last = series->children()[2].block.target<Rational>();
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(last->nk(), 3);
  EXPECT_THAT(chain.parameter_names(),
              ElementsAre("G1.b0", "G1.b1", "G1.a1", "G1.a2", "f.c0", "f.c1", "f.c2", "rational3.b0", "rational3.a1"));
}

TEST(Text, OneItemIsASeriesSoThatItsLabelIsKept) {
  EXPECT_THAT(names("G=rational(nb=0,na=1)"), ElementsAre("G.b0", "G.a1"));
  EXPECT_EQ(to_text(parse("G=rational(nb=0,na=1)")), "G=rational(nb=0,na=1)");
}

TEST(Text, BranchesAreSummed) {
  const AnyBlock chain = parse("[a=rational(nb=0,na=1) + f=polynomial(degree=1) | b=rational(nb=1,na=0)]");
  const auto* sum = chain.target<Series>()->children()[0].block.target<Parallel>();
  ASSERT_NE(sum, nullptr);
  ASSERT_EQ(sum->children().size(), 2U);
  EXPECT_EQ(sum->children()[0].label, "a");
  EXPECT_NE(sum->children()[0].block.target<Rational>(), nullptr);
  EXPECT_EQ(sum->children()[1].label, "");
  EXPECT_NE(sum->children()[1].block.target<Series>(), nullptr);
  EXPECT_THAT(chain.parameter_names(),
              ElementsAre("parallel1.a.b0", "parallel1.a.a1", "parallel1.series2.f.c0", "parallel1.series2.f.c1",
                          "parallel1.series2.b.b0", "parallel1.series2.b.b1"));
}

TEST(Text, BlanksAndLineBreaksMeanNothing) {
  EXPECT_EQ(to_text(parse(" G1 =rational( nb= 3 ,\n\tna=3 )|f = polynomial(degree=5,range=[ -1\n2 ])\r\n")),
            "G1=rational(nb=3,na=3) | f=polynomial(degree=5,range=[-1,2])");
}

TEST(Text, ListsTakeCommasBlanksAndOneColon) {
  for (const char* list : {"[-1,1]", "[-1 1]", "[-1:1]", "[ -1 , +1 ]", "[-1 : 1]", "[-1.0 10e-1]"}) {
    EXPECT_EQ(to_text(parse("polynomial(degree=1,range=" + std::string(list) + ")")),
              "polynomial(degree=1,range=[-1,1])")
        << list;
  }
}

TEST(Text, IntegersMayBeWrittenAsAnyWholeNumber) {
  EXPECT_EQ(to_text(parse("rational(nb=3.0,na=2e0)")), "rational(nb=3,na=2)");
}

TEST(Text, RoundTripKeepsTextAndBehaviour) {
  const std::vector<std::string> texts = {
      "rational(nb=3,na=3)",
      "G1=rational(nb=3,na=3) | f=polynomial(degree=5) | G2=rational(nb=3,na=3,nk=1)",
      "[a=rational(nb=1,na=1) + b=rational(nb=2,na=0)]",
      "G=rational(nb=1,na=1) | S=[rational(nb=0,na=1) | f=polynomial(degree=3) + rational(nb=0,na=0)]",
      "(rational(nb=1,na=1) | polynomial(degree=2)) | rational(nb=1,na=0)",
      "[F=(a=rational(nb=0,na=1) | b=polynomial(degree=2)) + (c=polynomial(degree=1))]",
      "[[rational(nb=0,na=0)]]",
      "((rational(nb=0,na=0)))",
      "polynomial(degree=3,range=[-0.1,0.30000000000000004])",
      "gain | offset | delay(samples=3) | fir(nb=4) | fir(nb=0,nk=2)",
      "biquads(sections=2) | biquads(sections=1,stable=true)",
      "fractional(poles=[0.9,0,0.5,0.25],zeros=[-1.5,0],n=20,n1=18,nk=1) | fractional(n=0)",
      "tied((G=rational(nb=1,na=1) | f=polynomial(degree=2)),to=[0,1,1,2,3,4],scale=[1,1,-0.5,1,1,1])",
      "piecewise_linear(knots=5) | piecewise_linear(knots=4,placement=uniform) | piecewise_linear(knots=[-1,0,2.5])",
      "spline(knots=20) | spline(knots=6,placement=quantile) | spline(knots=[-1,0.1,0.30000000000000004,7])",
      "saturation | dead_zone | tanh_network(units=3) | tanh_network(units=1,range=[0,2])",
      "polynomial(degree=3,range=[-5e-324,1.7976931348623157e+308])",
  };
  std::mt19937 generator(7);
  std::normal_distribution<double> normal(0.0, 0.3);
  for (const std::string& text : texts) {
    const AnyBlock block = parse(text);
    EXPECT_EQ(to_text(block), text);
    const AnyBlock again = parse(to_text(block));
    EXPECT_EQ(again.parameter_names(), block.parameter_names());
    Eigen::VectorXd theta(block.parameter_count());
    for (double& value : theta) value = normal(generator);
    EXPECT_EQ(output(again, theta), output(block, theta)) << text;
  }
}

TEST(Text, BlockThatIsNoSeriesComesBackInASeriesOfOne) {
  const AnyBlock block = Rational(1, 1);
  EXPECT_EQ(to_text(block), "rational(nb=1,na=1)");
  EXPECT_NE(parse(to_text(block)).target<Series>(), nullptr);
  EXPECT_EQ(to_nested_text(parse("rational(nb=1,na=1)")), "(rational(nb=1,na=1))");
}

TEST(Text, NumbersReadBackBitForBit) {
  std::mt19937_64 generator(11);
  for (int k = 0; k < 2000; ++k) {
    double lower = std::bit_cast<double>(generator());
    double upper = std::bit_cast<double>(generator());
    if (!std::isfinite(lower) || !std::isfinite(upper) || lower == upper) continue;
    if (lower > upper) std::swap(lower, upper);
    const AnyBlock again = parse(to_text(Polynomial(1, {lower, upper})));
    const auto* polynomial = again.target<Series>()->children()[0].block.target<Polynomial>();
    EXPECT_EQ(std::bit_cast<std::uint64_t>(polynomial->range().lower), std::bit_cast<std::uint64_t>(lower));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(polynomial->range().upper), std::bit_cast<std::uint64_t>(upper));
  }
}

TEST(Text, KnotsOverARangeAreWrittenOut) {
  EXPECT_EQ(to_text(parse("spline(knots=3,range=[-1:1])")), "spline(knots=[-1,0,1])");
  EXPECT_EQ(to_text(parse("piecewise_linear(knots=[0:2])")), "piecewise_linear(knots=[0,2])");
}

TEST(TextErrors, KnotsAndTheirPlacementExcludeEachOther) {
  EXPECT_THAT(refusal("spline(knots=[0,1],placement=uniform)"), HasSubstr("the key 'placement' has no effect"));
  EXPECT_THAT(refusal("spline(knots=[0,1],range=[0,1])"), HasSubstr("the key 'range' has no effect"));
  EXPECT_THAT(refusal("spline(knots=9,range=[0,1],placement=uniform)"), HasSubstr("'placement' has no effect"));
  EXPECT_THAT(refusal("spline(knots=9,placement=even)"), HasSubstr("one of mixed, uniform, quantile, got the word"));
  EXPECT_THAT(refusal("gain | spline(knots=[1,0])"), AllOf(HasSubstr("column 8"), HasSubstr("knots must increase")));
  EXPECT_THAT(refusal("spline(knots=1e9)"), HasSubstr("knots must be a whole number in 2..1000"));
}

TEST(TextErrors, MarkThePlace) {
  EXPECT_EQ(refusal("G=rational(nb=1,na=1) | !"),
            "chain text, column 25: expected a block: a kind, '[' or '(', got '!'\n"
            "  G=rational(nb=1,na=1) | !\n"
            "                          ^");
}

TEST(TextErrors, ShowTheLineOfALongText) {
  EXPECT_EQ(refusal("rational(nb=1,na=1) |\n  rational(nb=1;na=1)"),
            "chain text, line 2, column 16: expected ',' and another argument, or ')', got ';'\n"
            "    rational(nb=1;na=1)\n"
            "                 ^");
}

TEST(TextErrors, CutVeryLongLines) {
  const std::string text = "rational(nb=1,na=" + std::string(200, ' ') + "x)" + std::string(200, ' ');
  const std::string message = refusal(text);
  EXPECT_LT(message.size(), 400U);
  const std::size_t caret = message.rfind('^') - message.rfind('\n');
  const std::string before = message.substr(0, message.rfind('\n'));
  EXPECT_EQ(before[before.rfind('\n') + caret], 'x') << message;
}

TEST(TextErrors, UnknownKindListsTheKnown) {
  EXPECT_THAT(refusal("G=ratonal(nb=1,na=1)"),
              AllOf(HasSubstr("column 3"), HasSubstr("unknown kind of block 'ratonal'"), HasSubstr("polynomial"),
                    HasSubstr("rational")));
}

TEST(TextErrors, UnknownKeyListsTheAllowed) {
  EXPECT_THAT(refusal("rational(nb=1,na=1,ns=2)"), AllOf(HasSubstr("column 20"), HasSubstr("rational has no key 'ns'"),
                                                         HasSubstr("nb (degree of the num"), HasSubstr("nk")));
}

TEST(TextErrors, MissingKey) {
  EXPECT_THAT(refusal("rational(nb=1)"), AllOf(HasSubstr("column 1:"), HasSubstr("the key 'na' is required")));
  EXPECT_THAT(refusal("rational"), HasSubstr("the key 'nb' is required"));
}

TEST(TextErrors, KeyTwice) { EXPECT_THAT(refusal("rational(nb=1,na=1,nb=1)"), HasSubstr("the key 'nb' comes twice")); }

TEST(TextErrors, WrongType) {
  EXPECT_THAT(refusal("rational(nb=true,na=1)"),
              AllOf(HasSubstr("column 13"), HasSubstr("nb must be a whole number"), HasSubstr("got the word 'true'")));
  EXPECT_THAT(refusal("rational(nb=1.5,na=1)"), HasSubstr("got the number 1.5"));
  EXPECT_THAT(refusal("rational(nb=[1],na=1)"), HasSubstr("got the list [1]"));
  EXPECT_THAT(refusal("polynomial(degree=3,range=2)"), HasSubstr("two numbers [lower,upper]"));
  EXPECT_THAT(refusal("polynomial(degree=3,range=[1,1])"), HasSubstr("lower < upper"));
  EXPECT_THAT(refusal("polynomial(degree=3,range=[0,1,2])"), HasSubstr("got the list [0,1,2]"));
}

TEST(TextErrors, OutsideLimits) {
  EXPECT_THAT(refusal("rational(nb=1e9,na=1)"), HasSubstr("nb must be a whole number in 0..1000"));
  EXPECT_THAT(refusal("rational(nb=-1,na=1)"), HasSubstr("got the number -1"));
  EXPECT_THAT(refusal("polynomial(degree=61)"), HasSubstr("0..60"));
  EXPECT_THAT(refusal("rational(nb=1e300,na=1)"), HasSubstr("nb must be"));
}

TEST(TextErrors, NumbersThatAreNone) {
  EXPECT_THAT(refusal("polynomial(degree=1,range=[0,1e999])"), HasSubstr("'1e999' is beyond what a double can hold"));
  for (const char* number : {"1.2.3", "-", "+", "+-1", "++1", "-inf", "-nan", "0x10", "1e", "3abc", "1-2"}) {
    EXPECT_THAT(refusal("rational(nb=" + std::string(number) + ",na=1)"), HasSubstr("expected a finite number"))
        << number;
  }
  EXPECT_THAT(refusal("rational(nb=nan,na=1)"), HasSubstr("got the word 'nan'"));
  EXPECT_THAT(refusal("polynomial(degree=1,range=[nan,1])"), HasSubstr("expected a number"));
}

TEST(TextErrors, Lists) {
  EXPECT_THAT(refusal("polynomial(degree=1,range=[0:1:5])"), HasSubstr("a colon stands between the two numbers"));
  EXPECT_THAT(refusal("polynomial(degree=1,range=[0,,1])"), HasSubstr("expected a number, got ','"));
  EXPECT_THAT(refusal("polynomial(degree=1,range=[0,1)"), HasSubstr("or ']'"));
  EXPECT_THAT(refusal("polynomial(degree=1,range=["), HasSubstr("got the end of the text"));
  EXPECT_THAT(refusal("polynomial(degree=1,range=[])"), HasSubstr("got the list []"));
}

TEST(TextErrors, LabelsMustDiffer) {
  EXPECT_THAT(refusal("G=rational(nb=1,na=1) | G=rational(nb=1,na=1)"),
              AllOf(HasSubstr("column 25"), HasSubstr("the label 'G' comes twice")));
  EXPECT_THAT(refusal("[G=rational(nb=1,na=1) + G=rational(nb=1,na=1)]"), HasSubstr("'G' comes twice"));
  EXPECT_THAT(refusal("rational2=rational(nb=1,na=1) | rational(nb=1,na=1)"), HasSubstr("'rational2' comes twice"));
  EXPECT_EQ(refusal("G=rational(nb=1,na=1) | [G=rational(nb=1,na=1)]"), "accepted");
}

TEST(TextErrors, Syntax) {
  EXPECT_THAT(refusal(""), HasSubstr("expected a block: a kind, '[' or '(', got the end of the text"));
  EXPECT_THAT(refusal("  \n "), HasSubstr("got the end of the text"));
  EXPECT_THAT(refusal("|"), HasSubstr("got '|'"));
  EXPECT_THAT(refusal("rational(nb=1,na=1) |"), HasSubstr("got the end of the text"));
  EXPECT_THAT(refusal("rational(nb=1,na=1) rational"), HasSubstr("expected '|' and another block, or the end"));
  EXPECT_THAT(refusal("rational(nb=1,na=1)]"), HasSubstr("got ']'"));
  EXPECT_THAT(refusal("[rational(nb=1,na=1)"), HasSubstr("expected '|' and another block, '+' and another branch"));
  EXPECT_THAT(refusal("(rational(nb=1,na=1)"), HasSubstr("or ')'"));
  EXPECT_THAT(refusal("[]"), HasSubstr("got ']'"));
  EXPECT_THAT(refusal("[rational(nb=1,na=1) + ]"), HasSubstr("got ']'"));
  EXPECT_THAT(refusal("rational(nb=1,na=1"), HasSubstr("expected ',' and another argument, or ')'"));
  EXPECT_THAT(refusal("rational(nb=,na=1)"), HasSubstr("expected a value"));
  EXPECT_THAT(refusal("rational(3,3)"), HasSubstr("expected an argument key=value or a nested block, got '3'"));
  EXPECT_THAT(refusal("1=rational(nb=1,na=1)"), HasSubstr("got '1'"));
  EXPECT_THAT(refusal("A=B=rational(nb=1,na=1)"), HasSubstr("unknown kind"));
  EXPECT_THAT(refusal(std::string_view("rational\0(nb=1,na=1)", 20)), HasSubstr("required"));
}

TEST(TextErrors, ShowNoControlCharacters) {
  const std::string message = refusal("rational(nb=\x01\xE2\x80\x93\x1b[31m,na=1)");
  for (const char c : message) EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~'));
}

TEST(TextErrors, NestedBlocksWhereNoneBelong) {
  EXPECT_THAT(refusal("rational(polynomial(degree=1),nb=1,na=1)"), HasSubstr("rational takes no nested block"));
}

TEST(TextErrors, DepthIsLimited) {
  const auto nested = [](int depth) {
    return std::string(static_cast<std::size_t>(depth), '[') + "rational(nb=0,na=0)" +
           std::string(static_cast<std::size_t>(depth), ']');
  };
  EXPECT_EQ(to_text(parse(nested(kMaxChainDepth - 1))), nested(kMaxChainDepth - 1));
  EXPECT_THAT(refusal(nested(kMaxChainDepth + 1)), HasSubstr("nest deeper than 32 levels"));
  EXPECT_THAT(refusal(std::string(900'000, '[')), HasSubstr("nest deeper"));
  EXPECT_THAT(refusal(std::string(900'000, '(')), HasSubstr("nest deeper"));
  std::string arguments;
  for (int k = 0; k < 200'000; ++k) arguments += "gain(";
  EXPECT_NE(refusal(arguments.substr(0, kMaxChainText)), "accepted");
}

TEST(TextErrors, SizeIsLimited) {
  EXPECT_THAT(refusal(std::string(kMaxChainText + 1, ' ')), HasSubstr("at most 1048576 bytes"));
  std::string row = "rational(nb=0,na=0)";
  for (int k = 0; k < kMaxChainBlocks; ++k) row += "|rational(nb=0,na=0)";
  EXPECT_THAT(refusal(row), HasSubstr("more than 1000 blocks"));
}

TEST(ToText, RefusesLabelsThatAreNoNames) { EXPECT_THROW(to_text(Series({{"G 1", Rational(1, 1)}})), Error); }

TEST(ToText, RefusesWhatCouldNotBeReadBack) {
  AnyBlock deep = Rational(0, 0);
  for (int k = 0; k <= kMaxChainDepth + 1; ++k) deep = Series({{"", deep}});
  EXPECT_THROW(to_text(deep), Error);
  EXPECT_THROW(to_text(Series(std::vector<LabelledBlock>(static_cast<std::size_t>(kMaxChainBlocks) + 1,
                                                         LabelledBlock{"", Rational(0, 0)}))),
               Error);
}

struct Cubic {
  Index terms = 1;
  std::string kind() const { return "cubic"; }
  Arguments arguments() const { return {{"terms", std::to_string(terms)}}; }
  Index parameter_count() const { return terms; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = u[t] + theta[0] * u[t] * u[t] * u[t];
  }
};

/// A block around another, for nested arguments.
struct Around {
  AnyBlock inner;
  Index factor = 1;
  std::string kind() const { return "around"; }
  Arguments arguments() const { return {{"", to_nested_text(inner)}, {"factor", std::to_string(factor)}}; }
  Index parameter_count() const { return inner.parameter_count(); }
  Index state_count() const { return inner.state_count(); }
  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    inner.apply(theta, x, u, y);
  }
};

Registry extended_registry() {
  Registry registry = standard_registry();
  registry.add("cubic", {{"terms", "how many"}, {"mode", "unused"}, {"on", "a flag"}, {"list", "numbers"}},
               [](const BlockArguments& a) { return Cubic{a.integer_or("terms", 1)}; });
  registry.add("around", {{"", "the block inside"}, {"factor", "a number"}}, [](const BlockArguments& a) {
    return Around{a.block(), a.integer_or("factor", 1)};
  });
  return registry;
}

TEST(Registry, TakesKindsOfOnesOwn) {
  const Registry registry = extended_registry();
  const AnyBlock chain = parse("G=rational(nb=1,na=1) | f=cubic(terms=2)", registry);
  EXPECT_EQ(to_text(chain), "G=rational(nb=1,na=1) | f=cubic(terms=2)");
  EXPECT_THAT(chain.parameter_names(), ElementsAre("G.b0", "G.b1", "G.a1", "f.theta1", "f.theta2"));
  EXPECT_THAT(refusal("cubic"), HasSubstr("unknown kind of block 'cubic'"));
}

TEST(Registry, NestedBlocksAreArguments) {
  const Registry registry = extended_registry();
  for (const char* text :
       {"around(cubic(terms=1),factor=4)", "around((G=rational(nb=1,na=1) | cubic(terms=1)),factor=2)",
        "around([rational(nb=1,na=1) + cubic(terms=1)],factor=1)",
        "around(around(cubic(terms=3),factor=2),factor=3)"}) {
    EXPECT_EQ(to_text(parse(text, registry)), text);
  }
  EXPECT_THAT(refusal("around(factor=4)", registry), HasSubstr("exactly one nested block, got 0"));
  EXPECT_THAT(refusal("around(cubic,cubic)", registry), HasSubstr("exactly one nested block, got 2"));
  EXPECT_THAT(refusal("around(cubic(terms=0.5))", registry), AllOf(HasSubstr("column 20"), HasSubstr("terms must be")));
}

TEST(Registry, NothingGivenIsIgnored) {
  EXPECT_THAT(refusal("cubic(mode=fast)", extended_registry()), HasSubstr("the key 'mode' has no effect"));
}

TEST(Registry, IsAValue) {
  Registry one = standard_registry();
  const Registry two = one;
  one.add("cubic", {}, [](const BlockArguments&) { return Cubic{}; });
  EXPECT_TRUE(one.contains("cubic"));
  EXPECT_FALSE(two.contains("cubic"));
  EXPECT_EQ(one.kinds().size(), two.kinds().size() + 1);
}

TEST(Registry, EveryStandardKindExplainsItself) {
  for (const Registry::Kind& kind : standard_registry().kinds()) {
    EXPECT_FALSE(kind.description.empty()) << kind.kind;
    for (const ArgumentKey& key : kind.keys) EXPECT_FALSE(key.description.empty()) << kind.kind << " " << key.key;
  }
}

TEST(Registry, RefusesBadKinds) {
  Registry registry = standard_registry();
  const Registry::Factory factory = [](const BlockArguments&) { return Cubic{}; };
  EXPECT_THROW(registry.add("rational", {}, factory), Error);
  EXPECT_THROW(registry.add("series", {}, factory), Error);
  EXPECT_THROW(registry.add("a b", {}, factory), Error);
  EXPECT_THROW(registry.add("", {}, factory), Error);
  EXPECT_THROW(registry.add("x", {{"a", ""}, {"a", ""}}, factory), Error);
  EXPECT_THROW(registry.add("x", {{"1", ""}}, factory), Error);
  EXPECT_THROW(registry.add("x", {}, nullptr), Error);
}

TEST(BlockArguments, ReadByType) {
  const BlockArguments a("k", {{"n", 3.0},
                               {"x", 2.5},
                               {"on", std::string("true")},
                               {"w", std::string("uniform")},
                               {"l", std::vector<double>{3.0, 1.0}},
                               {"", AnyBlock(Rational(0, 0))}});
  EXPECT_EQ(a.integer("n"), 3);
  EXPECT_EQ(a.integer_or("m", 7), 7);
  EXPECT_EQ(a.number("x"), 2.5);
  EXPECT_EQ(a.number_or("z", 1.5), 1.5);
  EXPECT_TRUE(a.flag("on"));
  EXPECT_FALSE(a.flag_or("off", false));
  EXPECT_EQ(a.word("w", {"uniform", "density"}), "uniform");
  EXPECT_EQ(a.word_or("v", "density", {"uniform", "density"}), "density");
  EXPECT_THAT(a.list("l"), ElementsAre(3.0, 1.0));
  EXPECT_TRUE(a.is_list("l"));
  EXPECT_FALSE(a.is_list("n"));
  EXPECT_EQ(a.block().kind(), "rational");
  EXPECT_TRUE(a.unread().empty());
  EXPECT_THROW(a.integer("x"), Error);
  EXPECT_THROW(a.integer("n", {4, 9}), Error);
  EXPECT_THROW(a.flag("w"), Error);
  EXPECT_THROW(a.word("w", {"a", "b"}), Error);
  EXPECT_THROW(a.range("l"), Error);
  EXPECT_THROW(a.number("missing"), Error);
}

}  // namespace
}  // namespace blockid
