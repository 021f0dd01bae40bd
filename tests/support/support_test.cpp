#include "support/data_dir.hpp"
#include "support/temp_dir.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace blockid::testing {
namespace {

TEST(TempDirTest, IsEmptyUniqueAndRemoved) {
  std::filesystem::path where;
  {
    const TempDir first;
    const TempDir second;
    EXPECT_NE(first.path(), second.path());
    EXPECT_TRUE(std::filesystem::is_empty(first.path()));
    std::ofstream(first / "file.txt") << "content";
    EXPECT_TRUE(std::filesystem::exists(first.path() / "file.txt"));
    where = first.path();
  }
  EXPECT_FALSE(std::filesystem::exists(where));
}

TEST(DataDirTest, EnvironmentNamesTheFolder) {
  const TempDir dir;
  std::ofstream(dir / "record.csv") << "u,y\n";
  ASSERT_EQ(::setenv("BLOCKID_DATA_DIR", dir.path().c_str(), 1), 0);
  EXPECT_EQ(data_file("record.csv"), dir / "record.csv");
  EXPECT_EQ(data_file("absent.csv"), std::nullopt);
  EXPECT_EQ(data_file("."), std::nullopt) << "a folder is not a file";
  BLOCKID_DATA_FILE_OR_SKIP(path, "record.csv");
  EXPECT_EQ(path.filename(), "record.csv");
}

}  // namespace
}  // namespace blockid::testing
