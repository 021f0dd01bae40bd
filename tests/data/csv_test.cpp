#include "blockid/data/csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <locale>
#include <random>

#include "message.hpp"
#include "support/temp_dir.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Table parse(std::string_view text, const CsvOptions& options = {}) { return parse_csv(text, "data.csv", options); }

std::string message(std::string_view text, const CsvOptions& options = {}) {
  return BLOCKID_MESSAGE(parse(text, options));
}

const Eigen::Matrix2d kTwoByTwo = (Eigen::Matrix2d() << 1, -2.5, 3, 4e-3).finished();

TEST(CsvTest, FindsTheSeparator) {
  for (const char* text : {"1,-2.5\n3,4e-3\n", "1;-2.5\n3;4e-3\n", "1\t-2.5\n3\t4e-3\n", "1 -2.5\n3 4e-3\n",
                           "  1   -2.5  \n 3\t \t4e-3\n", "1 , -2.5\n3 ,4e-3\n"}) {
    EXPECT_EQ(parse(text).values, kTwoByTwo) << text;
    EXPECT_FALSE(parse(text).has_header) << text;
  }
}

TEST(CsvTest, SeparatorGivenOverridesTheGuess) {
  CsvOptions options;
  options.separator = '|';
  EXPECT_EQ(parse("1|-2.5\n3|4e-3", options).values, kTwoByTwo);
  options.separator = ';';
  EXPECT_EQ(parse("\"a,b\";c\n1;-2.5\n3;4e-3", options).names, (std::vector<std::string>{"a,b", "c"}));
  options.separator = '.';
  EXPECT_THAT(message("1.2", options), HasSubstr("'.' cannot separate"));
}

TEST(CsvTest, DaisyLinesWithLeadingBlanksAndTrailingTabs) {
  const Table table = parse("   1.0000000e+00\t  -2.5000000e+000\t\n   3.0e+00\t   4.0e-3\t\n");
  EXPECT_EQ(table.values, kTwoByTwo);
  EXPECT_THAT(table.names, ElementsAre("1", "2"));
}

TEST(CsvTest, TabSeparatedNamesMayContainBlanks) {
  const Table table = parse("time [s]\tu [V]\n1\t-2.5\n3\t4e-3\n");
  EXPECT_THAT(table.names, ElementsAre("time [s]", "u [V]"));
  EXPECT_EQ(table.values, kTwoByTwo);
}

TEST(CsvTest, OneColumnMayHaveANameOfSeveralWords) {
  const Table table = parse("input voltage [V]\n1\n2\n");
  EXPECT_THAT(table.names, ElementsAre("input voltage [V]"));
  EXPECT_EQ(table.values, Eigen::Vector2d(1, 2));
}

TEST(CsvTest, HeaderIsRecognisedOrStated) {
  EXPECT_THAT(parse("u,y\n1,-2.5\n3,4e-3").names, ElementsAre("u", "y"));
  EXPECT_TRUE(parse("u,y\n1,2").has_header);
  CsvOptions options;
  options.header = true;
  const Table numbered = parse("10,20\n1,-2.5\n3,4e-3", options);
  EXPECT_THAT(numbered.names, ElementsAre("10", "20"));
  EXPECT_EQ(numbered.values, kTwoByTwo);
  options.header = false;
  EXPECT_THAT(message("u,y\n1,2", options),
              AllOf(StartsWith("data.csv:1: column 1"), HasSubstr("'u' is not a number")));
}

TEST(CsvTest, ALineOfNumbersAndNamesIsNotDroppedSilently) {
  EXPECT_THAT(message("1.0,1.o\n2,3"),
              AllOf(StartsWith("data.csv:1: column 2"), HasSubstr("'1.o' is not a number"), HasSubstr("header")));
  EXPECT_THAT(message("\"1\",\"2\"\n3,4"), AllOf(StartsWith("data.csv:1"), HasSubstr("say whether there is a header")));
}

TEST(CsvTest, QuotedCells) {
  const Table table = parse("\"flow, l/s\",\"say \"\"hi\"\"\"\n\"1\",\"-2.5\"\n3,4e-3");
  EXPECT_THAT(table.names, ElementsAre("flow, l/s", "say \"hi\""));
  EXPECT_EQ(table.values, kTwoByTwo);
  EXPECT_THAT(message("u,y\n1,\"2\n3,4"), AllOf(StartsWith("data.csv:2: column 2"), HasSubstr("quote without an end")));
  EXPECT_THAT(message("u,y\n1,\"2\"x\n3,4"),
              AllOf(StartsWith("data.csv:2: column 2"), HasSubstr("after the closing quote")));
}

TEST(CsvTest, CommentsBlankLinesLineEndsAndByteOrderMark) {
  const std::string text =
      "\xEF\xBB\xBF# made by hand\r\n% MATLAB too\r\n\r\nu,y\r\n1,-2.5\r\n   \r\n# between\r\n3,4e-3";
  EXPECT_EQ(parse(text).values, kTwoByTwo);
  EXPECT_THAT(parse(text).names, ElementsAre("u", "y"));
  EXPECT_EQ(parse("1,-2.5\r3,4e-3\r").values, kTwoByTwo);
  EXPECT_THAT(message("# one\r\n\r\n1,2\r\n3,x\r\n"), StartsWith("data.csv:4: column 2"));
}

TEST(CsvTest, NumberFormats) {
  const Eigen::VectorXd values = column(parse("+1\n-0\n.5\n5.\n1E+003\n1e-400\n4.9e-324\n0.1"), "1");
  EXPECT_EQ(values[0], 1.0);
  EXPECT_TRUE(std::signbit(values[1]));
  EXPECT_EQ(values[2], 0.5);
  EXPECT_EQ(values[3], 5.0);
  EXPECT_EQ(values[4], 1000.0);
  EXPECT_EQ(values[5], 0.0);
  EXPECT_EQ(values[6], std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(values[7], 0.1);
  for (const char* bad : {"+-1", "++1", "0x10", "1e", "1.2.3", "--1", "1_000", "e5", "+"}) {
    EXPECT_THAT(message(compose("1\n", bad)),
                AllOf(StartsWith("data.csv:2: column 1"), HasSubstr(compose("'", bad, "' is not a number"))))
        << bad;
  }
}

TEST(CsvTest, RaggedRowsSayWhereAndHowMany) {
  EXPECT_THAT(message("u,y,z\n1,2,3\n4,5\n"), AllOf(StartsWith("data.csv:3: ragged row"),
                                                    HasSubstr("expected 3 cells as in line 1"), HasSubstr("came 2")));
  EXPECT_THAT(message("# c\n1 2\n3 4 5\n"), AllOf(StartsWith("data.csv:3: ragged row"),
                                                  HasSubstr("expected 2 cells as in line 2"), HasSubstr("came 3")));
  EXPECT_THAT(message("time (s) u (V)\n1 2\n"), AllOf(HasSubstr("expected 4 cells as in line 1"), HasSubstr("came 2")));
}

TEST(CsvTest, NonNumericCellsSayLineColumnAndName) {
  EXPECT_THAT(message("u,y\n1,2\n3,abc\n"),
              AllOf(StartsWith("data.csv:3: column 2 ('y')"), HasSubstr("'abc' is not a number")));
  EXPECT_THAT(message("u;y\n1;2\n3;4,5\n"),
              AllOf(StartsWith("data.csv:3: column 2 ('y')"), HasSubstr("'4,5'"), HasSubstr("point, not a comma")));
  EXPECT_THAT(message("u,y\n1,\n"), AllOf(StartsWith("data.csv:2: column 2 ('y')"), HasSubstr("empty cell")));
}

TEST(CsvTest, NonFiniteSamplesSayIndex) {
  for (const char* bad : {"nan", "NaN", "inf", "-Infinity", "1e999"}) {
    EXPECT_THAT(message(compose("u,y\n1,2\n3,4\n5,", bad, "\n")),
                AllOf(StartsWith("data.csv:4: column 2 ('y')"), HasSubstr("non-finite"), HasSubstr("sample index 2")))
        << bad;
  }
}

TEST(CsvTest, MissingCellsOnRequest) {
  CsvOptions options;
  options.allow_missing = true;
  const Table table = parse("u,y\n1,\n3,NaN\n5,6\n", options);
  EXPECT_TRUE(std::isnan(table.values(0, 1)));
  EXPECT_TRUE(std::isnan(table.values(1, 1)));
  EXPECT_EQ(table.values(2, 1), 6.0);
  EXPECT_THAT(message("u,y\n1,inf\n", options), HasSubstr("non-finite"));
  EXPECT_EQ(parse("1\t\t3\n4\t5\t6", options).values.cols(), 3);
}

TEST(CsvTest, NothingToReadIsAnError) {
  EXPECT_THAT(message(""), AllOf(HasSubstr("data.csv"), HasSubstr("empty")));
  EXPECT_THAT(message("\xEF\xBB\xBF\r\n# only a comment\n  \n"), HasSubstr("empty"));
  EXPECT_THAT(message("u,y\n"), AllOf(StartsWith("data.csv:1"), HasSubstr("no data")));
  EXPECT_THAT(message(std::string_view("1\0 2", 4)), AllOf(HasSubstr("not a text file"), HasSubstr("offset 1")));
}

TEST(CsvTest, ColumnsByNameThenNumber) {
  const Table table = parse("2,u,u\n10,20,30\n", CsvOptions{.separator = {}, .header = true});
  EXPECT_EQ(column(table, "2")[0], 10.0) << "a name goes before a number";
  EXPECT_EQ(column(table, "3")[0], 30.0);
  EXPECT_EQ(column_index(table, "1"), 0);
  EXPECT_THAT(BLOCKID_MESSAGE(column(table, "u")), AllOf(HasSubstr("'u' occurs twice"), HasSubstr("columns 2 and 3")));
  EXPECT_THAT(BLOCKID_MESSAGE(column(table, "y")), AllOf(HasSubstr("data.csv"), HasSubstr("no column 'y'"),
                                                         HasSubstr("'2', 'u', 'u'"), HasSubstr("1 to 3")));
  for (const char* bad : {"0", "4", "-1", "1.0", "", "99999999999999999999"})
    EXPECT_THAT(BLOCKID_MESSAGE(column(table, bad)), HasSubstr("no column"));
  EXPECT_THAT(BLOCKID_MESSAGE(column(parse("1,2"), "u")), HasSubstr("numbered 1 to 2"));
}

struct CommaAndGroups : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(CsvTest, NumbersDoNotDependOnTheGlobalLocale) {
  std::string text_on_line_2000(1999, '\n');
  text_on_line_2000 += "1,0.5,x";
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new CommaAndGroups));
  const Table table = parse("1,-2.5\n3,4e-3");
  const std::string text = to_csv(table);
  const std::string error = message(text_on_line_2000);
  std::locale::global(before);
  EXPECT_EQ(table.values, kTwoByTwo);
  EXPECT_EQ(text, "1,-2.5\n3,0.004\n");
  EXPECT_THAT(error, StartsWith("data.csv:2000: column 3"));
}

void expect_same_bits(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  ASSERT_EQ(a.rows(), b.rows());
  ASSERT_EQ(a.cols(), b.cols());
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    ASSERT_EQ(std::bit_cast<std::uint64_t>(a.reshaped()[i]), std::bit_cast<std::uint64_t>(b.reshaped()[i]))
        << "entry " << i;
  }
}

TEST(CsvTest, RoundTripKeepsEveryBit) {
  std::mt19937_64 generator(5);
  Table table;
  table.values.resize(2000, 3);
  for (double& value : table.values.reshaped()) {
    do {
      value = std::bit_cast<double>(generator());
    } while (!std::isfinite(value));
  }
  table.values(0, 0) = -0.0;
  table.values(1, 0) = std::numeric_limits<double>::denorm_min();
  table.values(2, 0) = std::numeric_limits<double>::max();
  table.names = {"plain", "with, comma", "a \"quoted\" name"};
  table.has_header = true;
  const testing::TempDir dir;
  write_csv(dir / "table.csv", table);
  const Table again = read_csv(dir / "table.csv");
  EXPECT_EQ(again.names, table.names);
  EXPECT_EQ(again.source, (dir / "table.csv").string());
  expect_same_bits(again.values, table.values);
}

TEST(CsvTest, RoundTripOfNamesThatNeedQuotes) {
  for (const std::string name : {"", " u", "#u", "%", "u;v", "\t", "u\tv", "\"", "\"\"", "1e5x", "a b"}) {
    Table table;
    table.values = Eigen::Vector2d(1, 2);
    table.names = {name};
    table.has_header = true;
    EXPECT_THAT(parse(to_csv(table)).names, ElementsAre(name)) << to_csv(table);
  }
}

TEST(CsvTest, WritingRefusesWhatCannotBeReadBack) {
  Table table;
  table.source = "out";
  table.values = Eigen::MatrixXd::Ones(2, 2);
  table.names = {"u"};
  table.has_header = true;
  EXPECT_THAT(BLOCKID_MESSAGE(to_csv(table)), AllOf(HasSubstr("1 column names"), HasSubstr("2 columns")));
  table.names = {"u", "y\nz"};
  EXPECT_THAT(BLOCKID_MESSAGE(to_csv(table)), HasSubstr("line break"));
}

TEST(CsvTest, FileErrorsNameTheFile) {
  const testing::TempDir dir;
  EXPECT_THAT(BLOCKID_MESSAGE(read_csv(dir / "absent.csv")), AllOf(HasSubstr("absent.csv"), HasSubstr("no such file")));
  std::ofstream(dir / "bad.csv") << "u,y\n1,2\n3\n";
  EXPECT_THAT(BLOCKID_MESSAGE(read_csv(dir / "bad.csv")), HasSubstr("bad.csv:3: ragged row"));
}

}  // namespace
}  // namespace blockid
