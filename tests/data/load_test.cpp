#include "blockid/data/load.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "mat_writer.hpp"
#include "message.hpp"
#include "support/temp_dir.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class LoadTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(csv_) << "t,u,y,fs\n0,1,10,50\n0.02,2,20,50\n0.04,4,30,50\n";
    testing::MatWriter writer(mat_, MAT_FT_MAT5);
    writer.add("u", Eigen::Vector3d(1, 2, 4));
    writer.add("y", Eigen::RowVector3d(10, 20, 30));
    writer.add("fs", Eigen::VectorXd::Constant(1, 50.0));
    writer.add("Ts", Eigen::VectorXd::Constant(1, 0.02));
    writer.add_text("unit", "V");
  }

  LoadSpec spec(const std::filesystem::path& path) const {
    LoadSpec result;
    result.path = path;
    result.input = "u";
    result.output = "y";
    result.rate_from = "fs";
    return result;
  }

  testing::TempDir dir_;
  std::filesystem::path csv_ = dir_ / "tank.csv";
  std::filesystem::path mat_ = dir_ / "tank.mat";
};

TEST_F(LoadTest, KindGoesByContentNotByName) {
  EXPECT_EQ(detect_file_kind(csv_), FileKind::csv);
  EXPECT_EQ(detect_file_kind(mat_), FileKind::mat);
  std::filesystem::copy(mat_, dir_ / "disguised.csv");
  std::filesystem::copy(csv_, dir_ / "disguised.mat");
  EXPECT_EQ(load_column(dir_ / "disguised.csv", "u"), Eigen::Vector3d(1, 2, 4));
  EXPECT_EQ(load_column(dir_ / "disguised.mat", "u"), Eigen::Vector3d(1, 2, 4));
  testing::MatWriter(dir_ / "h5.dat", MAT_FT_MAT73).add("u", Eigen::Vector2d(1, 2));
  testing::MatWriter(dir_ / "old.mat", MAT_FT_MAT4).add("u", Eigen::Vector2d(1, 2));
  EXPECT_EQ(detect_file_kind(dir_ / "h5.dat"), FileKind::mat);
  EXPECT_EQ(detect_file_kind(dir_ / "old.mat"), FileKind::mat);
}

TEST_F(LoadTest, SameRecordFromBothKinds) {
  for (const auto& path : {csv_, mat_}) {
    const Record record = load_record(spec(path));
    EXPECT_EQ(record.name, "tank");
    EXPECT_EQ(record.u, Eigen::Vector3d(1, 2, 4));
    EXPECT_EQ(record.y, Eigen::Vector3d(10, 20, 30));
    EXPECT_EQ(record.sample_time_s, 0.02);
    EXPECT_EQ(record.input_name, "u");
    EXPECT_EQ(record.output_name, "y");
    EXPECT_EQ(record.weights.size(), 0);
  }
}

TEST_F(LoadTest, EveryWayToGiveTheSampleTime) {
  LoadSpec by_time = spec(csv_);
  by_time.rate_from.reset();
  by_time.sample_time_s = 0.25;
  EXPECT_EQ(load_record(by_time).sample_time_s, 0.25);
  LoadSpec by_rate = spec(csv_);
  by_rate.rate_from.reset();
  by_rate.rate_hz = 8.0;
  EXPECT_EQ(load_record(by_rate).sample_time_s, 0.125);
  LoadSpec by_variable = spec(mat_);
  by_variable.rate_from.reset();
  by_variable.sample_time_from = "Ts";
  EXPECT_EQ(load_record(by_variable).sample_time_s, 0.02);
}

TEST_F(LoadTest, ExactlyOneSampleTimeIsWanted) {
  LoadSpec none = spec(csv_);
  none.rate_from.reset();
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(none)),
              AllOf(HasSubstr("tank.csv"), HasSubstr("in 0 ways"), HasSubstr("exactly one")));
  LoadSpec two = spec(csv_);
  two.rate_hz = 50.0;
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(two)), HasSubstr("in 2 ways"));
}

TEST_F(LoadTest, TimeStampsSayOrConfirmTheSampleTime) {
  LoadSpec stamped = spec(csv_);
  stamped.rate_from.reset();
  stamped.time_from = "t";
  EXPECT_DOUBLE_EQ(load_record(stamped).sample_time_s, 0.02);
  stamped.rate_from = "fs";
  EXPECT_EQ(load_record(stamped).sample_time_s, 0.02);
  stamped.rate_from.reset();
  stamped.rate_hz = 40.0;
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(stamped)),
              AllOf(HasSubstr("tank.csv"), HasSubstr("'t' are 0.02 s apart"), HasSubstr("expected 0.025 s")));
  LoadSpec from_mat = spec(mat_);
  from_mat.rate_from.reset();
  from_mat.time_from = "y";
  EXPECT_EQ(load_record(from_mat).sample_time_s, 10.0);
  from_mat.time_from = "fs";
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(from_mat)), AllOf(HasSubstr("unequal lengths"), HasSubstr("'fs' has 1")));
}

TEST_F(LoadTest, UnevenTimeStampsAreRefusedOrTold) {
  std::ofstream(dir_ / "lost.csv") << "Time [s],u,y\n0,1,10\n1,2,20\n2,4,30\n4,5,30\n";
  LoadSpec lost = spec(dir_ / "lost.csv");
  lost.rate_from.reset();
  lost.rate_hz = 1.0;
  std::vector<std::string> warnings;
  EXPECT_EQ(load_record(lost, &warnings).sample_time_s, 1.0);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], AllOf(HasSubstr("not used"), HasSubstr("'Time [s]'"), HasSubstr("sample index 3")));
  lost.time_from = "Time [s]";
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(lost)), AllOf(HasSubstr("lost.csv"), HasSubstr("not uniform")));
  LoadSpec uniform = spec(csv_);
  EXPECT_EQ(load_record(uniform, &warnings).u.size(), 3);
  EXPECT_EQ(warnings, std::vector<std::string>());
}

TEST_F(LoadTest, SampleTimesMustBePositiveAndOne) {
  LoadSpec negative = spec(csv_);
  negative.rate_from.reset();
  negative.rate_hz = -50.0;
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(negative)), AllOf(HasSubstr("sampling rate is -50"), HasSubstr("positive")));
  LoadSpec zero = spec(csv_);
  zero.rate_from.reset();
  zero.sample_time_s = 0.0;
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(zero)), HasSubstr("sample time is 0"));
  LoadSpec varying = spec(csv_);
  varying.rate_from = "t";
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(varying)), AllOf(HasSubstr("column 't' varies"), HasSubstr("0.04")));
  LoadSpec vector = spec(mat_);
  vector.rate_from = "u";
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(vector)), HasSubstr("'u' has 3 elements"));
}

TEST_F(LoadTest, WithoutOutputEverySampleIsMissing) {
  LoadSpec input_only = spec(mat_);
  input_only.output.reset();
  const Record record = load_record(input_only);
  EXPECT_EQ(record.y.size(), 3);
  EXPECT_EQ(present_count(record), 0);
}

TEST_F(LoadTest, MissingOutputsOnRequest) {
  std::ofstream(dir_ / "gaps.csv") << "u,y\n1,10\n2,\n3,nan\n4,40\n";
  LoadSpec gaps = spec(dir_ / "gaps.csv");
  gaps.rate_from.reset();
  gaps.sample_time_s = 1.0;
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(gaps)),
              AllOf(HasSubstr("gaps.csv:3: column 2 ('y')"), HasSubstr("empty cell")));
  gaps.allow_missing = true;
  EXPECT_EQ(load_record(gaps).weights, Eigen::Vector4d(1, 0, 0, 1));
  std::swap(gaps.input, *gaps.output);
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(gaps)),
              AllOf(HasSubstr("gaps.csv"), HasSubstr("non-finite input 'y'"), HasSubstr("index 1")));
}

TEST_F(LoadTest, NonFiniteMatSamplesSayIndex) {
  testing::MatWriter writer(dir_ / "nan.mat", MAT_FT_MAT5);
  writer.add("u", Eigen::Vector3d(1, 2, 4));
  writer.add("y", Eigen::Vector3d(1, 2, std::nan("")));
  writer.add("fs", Eigen::VectorXd::Constant(1, 1.0));
  LoadSpec gaps = spec(dir_ / "nan.mat");
  { [[maybe_unused]] const testing::MatWriter closed = std::move(writer); }
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(gaps)),
              AllOf(HasSubstr("nan.mat"), HasSubstr("non-finite output 'y'"), HasSubstr("index 2")));
  gaps.allow_missing = true;
  EXPECT_EQ(load_record(gaps).weights, Eigen::Vector3d(1, 1, 0));
}

TEST_F(LoadTest, MistakesNameTheFile) {
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(spec(dir_ / "absent.mat"))),
              AllOf(HasSubstr("absent.mat"), HasSubstr("no such file")));
  EXPECT_THAT(BLOCKID_MESSAGE(detect_file_kind(dir_.path())), HasSubstr("folder"));
  LoadSpec unknown = spec(mat_);
  unknown.input = "torque";
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(unknown)),
              AllOf(HasSubstr("tank.mat"), HasSubstr("no variable 'torque'"), HasSubstr("Ts")));
  unknown = spec(csv_);
  unknown.output = "torque";
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(unknown)),
              AllOf(HasSubstr("tank.csv"), HasSubstr("no column 'torque'"), HasSubstr("'fs'")));
  unknown = spec(mat_);
  unknown.output = "fs";
  EXPECT_THAT(BLOCKID_MESSAGE(load_record(unknown)), AllOf(HasSubstr("tank.mat"), HasSubstr("unequal lengths"),
                                                           HasSubstr("'u' has 3"), HasSubstr("'fs' has 1")));
}

TEST_F(LoadTest, NumbersFromColumns) {
  EXPECT_EQ(load_scalar(csv_, "fs"), 50.0);
  EXPECT_EQ(load_scalar(mat_, "fs"), 50.0);
  EXPECT_EQ(load_column(csv_, "2"), Eigen::Vector3d(1, 2, 4));
}

TEST_F(LoadTest, DescribesCsvFiles) {
  std::ofstream(dir_ / "gaps.csv") << "u,y\n1,10\n2,\n3,nan\n4,40\n";
  const FileInfo info = describe_file(dir_ / "gaps.csv");
  EXPECT_EQ(info.kind, FileKind::csv);
  ASSERT_EQ(info.columns.size(), 2U);
  EXPECT_EQ(info.columns[0].name, "u");
  EXPECT_EQ(info.columns[0].rows, 4);
  EXPECT_EQ(info.columns[0].mean, 2.5);
  EXPECT_DOUBLE_EQ(info.columns[0].std, std::sqrt(1.25));
  EXPECT_EQ(info.columns[0].non_finite, 0);
  EXPECT_EQ(info.columns[1].min, 10.0);
  EXPECT_EQ(info.columns[1].max, 40.0);
  EXPECT_EQ(info.columns[1].mean, 25.0);
  EXPECT_EQ(info.columns[1].non_finite, 2);
}

TEST_F(LoadTest, DescribesMatFiles) {
  const FileInfo info = describe_file(mat_);
  EXPECT_EQ(info.kind, FileKind::mat);
  ASSERT_EQ(info.columns.size(), 5U);
  EXPECT_EQ(info.columns[1].name, "y");
  EXPECT_EQ(info.columns[1].rows, 1);
  EXPECT_EQ(info.columns[1].cols, 3);
  EXPECT_EQ(info.columns[1].mean, 20.0);
  EXPECT_EQ(info.columns[4].type, "char");
  EXPECT_TRUE(std::isnan(info.columns[4].mean));
}

}  // namespace
}  // namespace blockid
