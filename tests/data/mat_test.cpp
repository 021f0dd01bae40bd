#include "blockid/data/mat.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <complex>
#include <cstdint>
#include <fstream>
#include <limits>
#include <thread>

#include "blockid/data/atomic_file.hpp"
#include "mat_writer.hpp"
#include "message.hpp"
#include "support/temp_dir.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Eigen::MatrixXd kMatrix = (Eigen::MatrixXd(3, 2) << 1, 4, 2, 5, 3, 6.5).finished();

template <class Scalar>
Eigen::Matrix<Scalar, 2, 1> extremes() {
  return {std::numeric_limits<Scalar>::lowest(), std::numeric_limits<Scalar>::max()};
}

class MatVersions : public ::testing::TestWithParam<mat_ft> {
 protected:
  void SetUp() override {
    testing::MatWriter writer(path_, GetParam());
    writer.add("x", Eigen::Vector3d(0.1, -2, 1e300));
    writer.add("row", Eigen::RowVector3d(7, 8, 9));
    writer.add("M", kMatrix);
    writer.add("fs", Eigen::Matrix<std::uint16_t, 1, 1>(51200));
  }
  testing::TempDir dir_;
  std::filesystem::path path_ = dir_ / "file.mat";
};

TEST_P(MatVersions, ListsVariables) {
  std::vector<std::string> lines;
  for (const MatVariable& v : list_mat(path_))
    lines.push_back(compose(v.name, " ", v.rows, "x", v.cols, " ", v.type, " ", v.numeric));
  EXPECT_THAT(lines,
              ::testing::UnorderedElementsAre("x 3x1 double 1", "row 1x3 double 1", "M 3x2 double 1",
                                              GetParam() == MAT_FT_MAT4 ? "fs 1x1 double 1" : "fs 1x1 uint16 1"));
}

TEST_P(MatVersions, ReadsVectorsColumnsAndNumbers) {
  EXPECT_EQ(read_mat_vector(path_, "x"), Eigen::Vector3d(0.1, -2, 1e300));
  EXPECT_EQ(read_mat_vector(path_, "x[0]"), Eigen::Vector3d(0.1, -2, 1e300));
  EXPECT_EQ(read_mat_vector(path_, "row"), Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(read_mat_vector(path_, "row[0]"), Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(read_mat_vector(path_, "M[0]"), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read_mat_vector(path_, "M[1]"), Eigen::Vector3d(4, 5, 6.5));
  EXPECT_EQ(MatFile(path_).matrix("M"), kMatrix);
  EXPECT_EQ(read_mat_scalar(path_, "fs"), 51200.0);
}

TEST_P(MatVersions, ErrorsSayWhatThereIs) {
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "z")),
              AllOf(HasSubstr("file.mat"), HasSubstr("no variable 'z'"), HasSubstr("x (3 x 1 double)"),
                    HasSubstr("M (3 x 2 double)")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "x.u")),
              AllOf(HasSubstr("no variable 'x.u'"), HasSubstr("x (3 x 1")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "M")),
              AllOf(HasSubstr("'M' is 3 x 2"), HasSubstr("add [k]"), HasSubstr("0 to 1")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "M[2]")),
              AllOf(HasSubstr("'M[2]'"), HasSubstr("0 to 1"), HasSubstr("3 x 2")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "row[1]")), AllOf(HasSubstr("0 to 0"), HasSubstr("vector")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_scalar(path_, "x")),
              AllOf(HasSubstr("'x' has 3 elements"), HasSubstr("one number")));
  EXPECT_THAT(BLOCKID_MESSAGE(MatFile(path_).matrix("M[0]")), HasSubstr("whole matrix"));
}

TEST_P(MatVersions, ManyReadsFromOneOpenFile) {
  const MatFile file(path_);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(file.vector("row")[2], 9.0);
    EXPECT_EQ(file.variables().size(), 4U);
    EXPECT_THROW(static_cast<void>(file.vector("absent")), Error);
    EXPECT_EQ(file.vector("x")[1], -2.0);
  }
}

TEST_P(MatVersions, ReadsFromSeveralThreads) {
  std::vector<std::thread> threads;
  std::vector<double> sums(4, 0.0);
  for (double& sum : sums) {
    threads.emplace_back([&sum, this] {
      for (int i = 0; i < 20; ++i) sum += read_mat_vector(path_, "M[1]").sum();
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(sums, ::testing::Each(20 * 15.5));
}

INSTANTIATE_TEST_SUITE_P(Mat, MatVersions, ::testing::Values(MAT_FT_MAT4, MAT_FT_MAT5, MAT_FT_MAT73),
                         [](const auto& version) {
                           return version.param == MAT_FT_MAT4 ? "v4" : version.param == MAT_FT_MAT5 ? "v7" : "v73";
                         });

class MatStructures : public ::testing::TestWithParam<mat_ft> {
 protected:
  void SetUp() override {
    testing::MatWriter writer(path_, GetParam());
    writer.add_struct("s", Eigen::Vector3d(1, 2, 3), 500.0, 1);
    writer.add_struct("a", Eigen::Vector3d(1, 2, 3), 500.0, 2);
    writer.add("flag", Eigen::Matrix<std::uint8_t, 2, 1>(1, 0), MAT_F_LOGICAL);
    writer.add("i8", extremes<std::int8_t>());
    writer.add("u8", extremes<std::uint8_t>());
    writer.add("i16", extremes<std::int16_t>());
    writer.add("u16", extremes<std::uint16_t>());
    writer.add("i32", extremes<std::int32_t>());
    writer.add("u32", extremes<std::uint32_t>());
    writer.add("i64", extremes<std::int64_t>());
    writer.add("u64", extremes<std::uint64_t>());
    writer.add("f32", extremes<float>());
    writer.add_complex("z", Eigen::VectorXcd::Constant(1, std::complex<double>(1.0, 2.0)));
    writer.add_text("text", "volt");
    writer.add_cell("c");
    writer.add_cube("cube");
  }
  testing::TempDir dir_;
  std::filesystem::path path_ = dir_ / "file.mat";
};

TEST_P(MatStructures, FieldsAreListedAndRead) {
  std::vector<std::string> names;
  for (const MatVariable& v : list_mat(path_)) {
    if (v.name[0] == 's' || v.name[0] == 'a') names.push_back(v.name);
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("s.u", "s.inner.fs", "a[0].u", "a[0].inner.fs", "a[1].u",
                                                     "a[1].inner.fs"));
  EXPECT_EQ(read_mat_vector(path_, "s.u"), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read_mat_vector(path_, "s[0].u"), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read_mat_vector(path_, "a[1].u"), Eigen::Vector3d(2, 3, 4));
  EXPECT_EQ(read_mat_scalar(path_, "s.inner.fs"), 500.0);
}

TEST_P(MatStructures, StructMistakesAreNamed) {
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "s")),
              AllOf(HasSubstr("'s' holds struct data"), HasSubstr("real numbers")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "s.y")),
              AllOf(HasSubstr("no variable 's.y'"), HasSubstr("s.u (3 x 1 double)")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "a.u")),
              AllOf(HasSubstr("array of 2 structs"), HasSubstr("a[k]"), HasSubstr("0 to 1")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "a[2].u")), HasSubstr("no variable 'a[2].u'"));
  for (const char* bad : {"", ".", "s.", ".u", "s..u", "s[", "s[]", "s[x]", "s[-1]", "s[1]x", "s]", "[0]"}) {
    EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, bad)), HasSubstr(compose("'", bad, "' is no variable name")))
        << bad;
  }
}

template <class Scalar>
void expect_extremes(const std::filesystem::path& path, const char* name) {
  const Eigen::VectorXd expected = extremes<Scalar>().template cast<double>();
  EXPECT_EQ(read_mat_vector(path, name), expected) << name;
}

TEST_P(MatStructures, ConvertsEveryNumericClass) {
  expect_extremes<std::int8_t>(path_, "i8");
  expect_extremes<std::uint8_t>(path_, "u8");
  expect_extremes<std::int16_t>(path_, "i16");
  expect_extremes<std::uint16_t>(path_, "u16");
  expect_extremes<std::int32_t>(path_, "i32");
  expect_extremes<std::uint32_t>(path_, "u32");
  expect_extremes<std::int64_t>(path_, "i64");
  expect_extremes<std::uint64_t>(path_, "u64");
  expect_extremes<float>(path_, "f32");
  EXPECT_EQ(read_mat_vector(path_, "flag"), Eigen::Vector2d(1, 0));
}

TEST_P(MatStructures, RefusesWhatHoldsNoRealMatrix) {
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "z")), AllOf(HasSubstr("'z'"), HasSubstr("complex double")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "text")), AllOf(HasSubstr("'text'"), HasSubstr("char")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "c")), AllOf(HasSubstr("'c'"), HasSubstr("cell")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(path_, "cube")), AllOf(HasSubstr("'cube'"), HasSubstr("3 dimensions")));
}

INSTANTIATE_TEST_SUITE_P(Mat, MatStructures, ::testing::Values(MAT_FT_MAT5, MAT_FT_MAT73),
                         [](const auto& version) { return version.param == MAT_FT_MAT5 ? "v7" : "v73"; });

TEST(MatTest, EmptyVariableIsNamed) {
  const testing::TempDir dir;
  testing::MatWriter(dir / "e.mat", MAT_FT_MAT5).add("none", Eigen::MatrixXd(0, 0));
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(dir / "e.mat", "none")),
              AllOf(HasSubstr("'none' is empty"), HasSubstr("0 x 0")));
}

TEST(MatTest, FileErrorsNameTheFile) {
  const testing::TempDir dir;
  EXPECT_THAT(BLOCKID_MESSAGE(list_mat(dir / "absent.mat")), AllOf(HasSubstr("absent.mat"), HasSubstr("no such file")));
  EXPECT_THAT(BLOCKID_MESSAGE(list_mat(dir.path())), HasSubstr("folder"));
  std::ofstream(dir / "text.mat") << "u,y\n1,2\n";
  EXPECT_THAT(BLOCKID_MESSAGE(list_mat(dir / "text.mat")), AllOf(HasSubstr("text.mat"), HasSubstr("not a MAT file")));
}

/// Messages of reading x from the first 1/16, 2/16, ... of the file.
std::vector<std::string> messages_of_cut_files(const std::filesystem::path& folder, std::string_view whole) {
  std::vector<std::string> messages;
  for (std::size_t part = 1; part < 16; ++part) {
    write_file_atomically(folder / "cut.mat", whole.substr(0, whole.size() * part / 16));
    messages.push_back(BLOCKID_MESSAGE(read_mat_vector(folder / "cut.mat", "x")));
  }
  return messages;
}

TEST(MatTest, TruncatedFilesAreErrorsAndNothingIsPrinted) {
  const testing::TempDir dir;
  for (const mat_ft version : {MAT_FT_MAT4, MAT_FT_MAT5, MAT_FT_MAT73}) {
    testing::MatWriter(dir / "whole.mat", version).add("x", Eigen::VectorXd::Random(1000));
    const std::string whole = read_file(dir / "whole.mat");
    ::testing::internal::CaptureStderr();
    ::testing::internal::CaptureStdout();
    const std::vector<std::string> messages = messages_of_cut_files(dir.path(), whole);
    EXPECT_THAT(::testing::internal::GetCapturedStdout(), IsEmpty());
    EXPECT_THAT(::testing::internal::GetCapturedStderr(), IsEmpty());
    EXPECT_THAT(messages,
                ::testing::Each(AllOf(HasSubstr("cut.mat"), AnyOf(HasSubstr("truncated"), HasSubstr("damaged")))))
        << version;
  }
}

TEST(MatTest, DamagedCompressedDataIsAnError) {
  const testing::TempDir dir;
  testing::MatWriter(dir / "x.mat", MAT_FT_MAT5).add("x", Eigen::VectorXd::Random(1000));
  std::string content = read_file(dir / "x.mat");
  content[content.size() / 2] = static_cast<char>(content[content.size() / 2] ^ 0x10);
  write_file_atomically(dir / "x.mat", content);
  EXPECT_THAT(BLOCKID_MESSAGE(read_mat_vector(dir / "x.mat", "x")),
              AllOf(HasSubstr("x.mat: damaged"), HasSubstr("at byte 128"), HasSubstr("checksum")));
}

}  // namespace
}  // namespace blockid
