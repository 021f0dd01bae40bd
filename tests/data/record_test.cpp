#include "blockid/data/record.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "blockid/data/data_set.hpp"
#include "message.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Record ramp(Eigen::Index count = 6) {
  Record record;
  record.name = "ramp";
  record.u = Eigen::VectorXd::LinSpaced(count, 0.0, static_cast<double>(count - 1));
  record.y = 10.0 * record.u;
  record.sample_time_s = 0.5;
  return record;
}

TEST(RecordTest, ValidRecordPasses) {
  EXPECT_NO_THROW(check(ramp()));
  EXPECT_EQ(sample_count(ramp()), 6);
  EXPECT_EQ(weight(ramp(), 3), 1.0);
  EXPECT_FALSE(is_missing(ramp(), 3));
}

TEST(RecordTest, MissingOutputMayBeNan) {
  Record record = ramp();
  record.y[2] = kNan;
  EXPECT_THAT(BLOCKID_MESSAGE(check(record)),
              AllOf(HasSubstr("'ramp'"), HasSubstr("non-finite output 'y'"), HasSubstr("index 2")));
  record.weights = Eigen::VectorXd::Ones(6);
  record.weights[2] = 0.0;
  EXPECT_NO_THROW(check(record));
  EXPECT_TRUE(is_missing(record, 2));
  EXPECT_EQ(present_count(record), 5);
}

TEST(RecordTest, InputMustBeKnownEvenWhereOutputIsMissing) {
  Record record = ramp();
  record.weights = Eigen::VectorXd::Zero(6);
  record.u[4] = -std::numeric_limits<double>::infinity();
  EXPECT_THAT(BLOCKID_MESSAGE(check(record)),
              AllOf(HasSubstr("non-finite input 'u'"), HasSubstr("index 4"), HasSubstr("-inf")));
}

TEST(RecordTest, UnequalLengthsSayBoth) {
  Record record = ramp();
  record.y.conservativeResize(4);
  EXPECT_THAT(BLOCKID_MESSAGE(check(record)),
              AllOf(HasSubstr("unequal lengths"), HasSubstr("'u' has 6"), HasSubstr("'y' has 4")));
  EXPECT_THAT(BLOCKID_MESSAGE(slice(record, 0, 2)), HasSubstr("unequal lengths"));
  record = ramp();
  record.weights = Eigen::VectorXd::Ones(5);
  EXPECT_THAT(BLOCKID_MESSAGE(check(record)), AllOf(HasSubstr("unequal lengths"), HasSubstr("6"), HasSubstr("came 5")));
}

TEST(RecordTest, EmptyRecordIsRefused) {
  EXPECT_THAT(BLOCKID_MESSAGE(check(Record{})), HasSubstr("empty"));
  EXPECT_THAT(BLOCKID_MESSAGE(check_excitation(Record{})), HasSubstr("empty"));
}

TEST(RecordTest, BadWeightsSayWhere) {
  Record record = ramp();
  record.weights = Eigen::VectorXd::Ones(6);
  for (const double bad : {-0.25, kNan, std::numeric_limits<double>::infinity()}) {
    record.weights[3] = bad;
    EXPECT_THAT(BLOCKID_MESSAGE(check(record)),
                AllOf(HasSubstr("weight"), HasSubstr("index 3"), HasSubstr(compose(bad))));
  }
}

TEST(RecordTest, BadSampleTimeSaysValue) {
  for (const double bad : {0.0, -1.5, kNan, std::numeric_limits<double>::infinity()}) {
    Record record = ramp();
    record.sample_time_s = bad;
    EXPECT_THAT(BLOCKID_MESSAGE(check(record)), AllOf(HasSubstr("sample time"), HasSubstr(compose(bad))));
  }
}

TEST(RecordTest, PeriodLiesWithinTheRecord) {
  Record record = ramp();
  record.period = 6;
  EXPECT_NO_THROW(check(record));
  record.period = 7;
  EXPECT_THAT(BLOCKID_MESSAGE(check(record)), AllOf(HasSubstr("period"), HasSubstr("7"), HasSubstr("6")));
  record.period = -1;
  EXPECT_THAT(BLOCKID_MESSAGE(check(record)), HasSubstr("period is -1"));
}

TEST(RecordTest, SliceKeepsEverythingElse) {
  Record record = ramp();
  record.weights = Eigen::VectorXd::LinSpaced(6, 1.0, 6.0);
  record.period = 3;
  record.input_unit = "V";
  const Record part = slice(record, 2, 5);
  EXPECT_EQ(part.u, Eigen::Vector3d(2, 3, 4));
  EXPECT_EQ(part.y, Eigen::Vector3d(20, 30, 40));
  EXPECT_EQ(part.weights, Eigen::Vector3d(3, 4, 5));
  EXPECT_EQ(part.name, "ramp[2:5)");
  EXPECT_EQ(part.sample_time_s, 0.5);
  EXPECT_EQ(part.input_unit, "V");
  EXPECT_EQ(part.period, 3);
  EXPECT_EQ(slice(record, 2, 4).period, 0);
  EXPECT_NO_THROW(check(slice(record, 2, 4)));
}

TEST(RecordTest, SliceOfSliceIsSlice) {
  const Record record = ramp(20);
  EXPECT_EQ(slice(slice(record, 3, 17), 2, 9).u, slice(record, 5, 12).u);
  EXPECT_EQ(slice(record, 0, 20).y, record.y);
}

TEST(RecordTest, SliceOutsideSaysLimits) {
  for (const auto& range : {std::pair{-1, 3}, {2, 2}, {4, 2}, {0, 7}}) {
    const int begin = range.first;
    const int end = range.second;
    EXPECT_THAT(BLOCKID_MESSAGE(slice(ramp(), begin, end)),
                AllOf(HasSubstr(compose(begin, ":", end)), HasSubstr("0:6")));
  }
}

TEST(RecordTest, ConstantInputSaysValue) {
  Record record = ramp();
  EXPECT_NO_THROW(check_excitation(record));
  record.u.setConstant(2.5);
  EXPECT_THAT(BLOCKID_MESSAGE(check_excitation(record)), AllOf(HasSubstr("constant input 'u'"), HasSubstr("2.5")));
}

TEST(RecordTest, FewerSamplesThanParametersSaysBoth) {
  Record record = ramp();
  EXPECT_NO_THROW(check_sample_count(record, 6));
  record.weights = Eigen::VectorXd::Ones(6);
  record.weights[0] = 0.0;
  EXPECT_THAT(BLOCKID_MESSAGE(check_sample_count(record, 6)),
              AllOf(HasSubstr("fewer samples than parameters"), HasSubstr("5 output"), HasSubstr("6 parameters")));
}

TEST(DataSetTest, RecordIsADataSet) {
  const DataSet data = ramp();
  EXPECT_EQ(data.records.size(), 1U);
  EXPECT_EQ(total_samples(data), 6);
  EXPECT_NO_THROW(check(data));
}

TEST(DataSetTest, CountsOverRecords) {
  Record other = ramp(4);
  other.weights = Eigen::VectorXd::Ones(4);
  other.weights[1] = 0.0;
  const DataSet data(std::vector<Record>{ramp(), other});
  EXPECT_EQ(total_samples(data), 10);
  EXPECT_EQ(present_count(data), 9);
  EXPECT_NO_THROW(check_sample_count(data, 9));
  EXPECT_THAT(BLOCKID_MESSAGE(check_sample_count(data, 10)),
              AllOf(HasSubstr("fewer samples than parameters"), HasSubstr("9 output"), HasSubstr("2 records"),
                    HasSubstr("10 parameters")));
  EXPECT_THAT(BLOCKID_MESSAGE(check_sample_count(DataSet(ramp()), 7)), HasSubstr("'ramp': fewer samples"));
}

TEST(DataSetTest, ErrorsNameThePosition) {
  EXPECT_THAT(BLOCKID_MESSAGE(check(DataSet{})), HasSubstr("no records"));
  DataSet data(std::vector<Record>{ramp(), ramp()});
  data.records[1].sample_time_s = 0.25;
  EXPECT_THAT(BLOCKID_MESSAGE(check(data)), AllOf(HasSubstr("position 1"), HasSubstr("0.25 s"), HasSubstr("0.5 s")));
  data.records[1] = ramp();
  data.records[1].u[3] = kNan;
  EXPECT_THAT(BLOCKID_MESSAGE(check(data)), AllOf(HasSubstr("position 1"), HasSubstr("'ramp'"), HasSubstr("index 3")));
}

TEST(DataSetTest, OneVaryingInputIsEnough) {
  DataSet data(std::vector<Record>{ramp(), ramp()});
  data.records[0].u.setConstant(1.0);
  EXPECT_NO_THROW(check_excitation(data));
  data.records[1].u.setConstant(2.0);
  EXPECT_THAT(BLOCKID_MESSAGE(check_excitation(data)), AllOf(HasSubstr("constant input"), HasSubstr("2 records")));
  data.records.pop_back();
  EXPECT_THAT(BLOCKID_MESSAGE(check_excitation(data)), HasSubstr("constant input 'u'"));
}

TEST(RangeTest, ParsesClosedAndOpenRanges) {
  EXPECT_EQ(parse_range("5200:105200"), (Range{5200, 105200}));
  EXPECT_EQ(parse_range("7:"), (Range{7, kToEnd}));
  EXPECT_EQ(parse_range(":9"), (Range{0, 9}));
  EXPECT_EQ(parse_range(":"), Range{});
}

TEST(RangeTest, TextRoundTrips) {
  for (const Range range : {Range{0, 1}, Range{3, 12}, Range{5, kToEnd}, Range{}})
    EXPECT_EQ(parse_range(to_text(range)), range);
}

TEST(RangeTest, RefusesAnythingElseAndQuotesIt) {
  for (const char* text :
       {"", "5", "5:5", "6:5", "-1:4", "a:b", "1:2:3", "1 :2", "1:2 ", "1.5:3", "99999999999999999999:"}) {
    EXPECT_THAT(BLOCKID_MESSAGE(parse_range(text)),
                AllOf(HasSubstr(compose("'", text, "'")), HasSubstr("expected A:B")))
        << text;
  }
}

TEST(RangeTest, ResolvesAgainstALength) {
  EXPECT_EQ(resolve(parse_range("2:"), 10), (Range{2, 10}));
  EXPECT_EQ(resolve(parse_range("2:4"), 10), (Range{2, 4}));
  EXPECT_THAT(BLOCKID_MESSAGE(resolve(parse_range("2:11"), 10)), AllOf(HasSubstr("2:11"), HasSubstr("0:10")));
  EXPECT_THAT(BLOCKID_MESSAGE(resolve(parse_range("10:"), 10)), AllOf(HasSubstr("10:"), HasSubstr("0:10")));
}

TEST(RangeTest, SlicesFollowTheirOrder) {
  const DataSet data = slices(ramp(10), {parse_range("6:"), parse_range("1:3")});
  ASSERT_EQ(data.records.size(), 2U);
  EXPECT_EQ(data.records[0].u, Eigen::Vector4d(6, 7, 8, 9));
  EXPECT_EQ(data.records[1].u, Eigen::Vector2d(1, 2));
  EXPECT_THAT(BLOCKID_MESSAGE(slices(ramp(), {})), HasSubstr("no ranges"));
  EXPECT_THAT(BLOCKID_MESSAGE(slices(ramp(), {Range{0, 3}, Range{3, 9}})), AllOf(HasSubstr("3:9"), HasSubstr("0:6")));
}

}  // namespace
}  // namespace blockid
