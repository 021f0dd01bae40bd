#include "blockid/data/atomic_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "message.hpp"
#include "support/temp_dir.hpp"

namespace blockid {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::ptrdiff_t entry_count(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

TEST(AtomicFileTest, WritesAndReplacesBytes) {
  const testing::TempDir dir;
  const std::string content("line\r\n\0binary", 13);
  write_file_atomically(dir / "a.txt", content);
  EXPECT_EQ(read_file(dir / "a.txt"), content);
  write_file_atomically(dir / "a.txt", "");
  EXPECT_EQ(read_file(dir / "a.txt"), "");
  EXPECT_EQ(entry_count(dir.path()), 1);
}

TEST(AtomicFileTest, ReadsFilesLongerThanItsChunk) {
  const testing::TempDir dir;
  std::string content(300001, 'x');
  content[200000] = 'y';
  write_file_atomically(dir / "long", content);
  EXPECT_EQ(read_file(dir / "long"), content);
}

TEST(AtomicFileTest, BareNameLandsInTheCurrentFolder) {
  const fs::path name = "atomic_file_test_bare_name.txt";
  write_file_atomically(name, "here");
  EXPECT_EQ(read_file(fs::current_path() / name), "here");
  fs::remove(name);
}

TEST(AtomicFileTest, KeepsPermissionsAndLinks) {
  const testing::TempDir dir;
  write_file_atomically(dir / "target", "old");
  fs::permissions(dir / "target", fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  fs::create_symlink("target", dir / "link");
  write_file_atomically(dir / "link", "new");
  EXPECT_TRUE(fs::is_symlink(dir / "link"));
  EXPECT_EQ(read_file(dir / "target"), "new");
  EXPECT_EQ(fs::status(dir / "target").permissions(),
            fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
}

TEST(AtomicFileTest, FailureKeepsTheOldContentAndLeavesNoTemporary) {
  const testing::TempDir dir;
  write_file_atomically(dir / "a.txt", "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 4096;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message = BLOCKID_MESSAGE(write_file_atomically(dir / "a.txt", std::string(100000, 'x')));
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(message, AllOf(HasSubstr("a.txt"), HasSubstr("File too large")));
  EXPECT_EQ(read_file(dir / "a.txt"), "old");
  EXPECT_EQ(entry_count(dir.path()), 1);
}

TEST(AtomicFileTest, DevicesAreWrittenNotReplaced) {
  write_file_atomically("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(AtomicFileTest, ErrorsNameThePath) {
  const testing::TempDir dir;
  EXPECT_THAT(BLOCKID_MESSAGE(write_file_atomically(dir / "no" / "a.txt", "x")),
              AllOf(HasSubstr("no/a.txt"), HasSubstr("No such file")));
  EXPECT_THAT(BLOCKID_MESSAGE(write_file_atomically(dir.path(), "x")),
              AllOf(HasSubstr(dir.path().string()), HasSubstr("folder")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_file(dir / "absent")), AllOf(HasSubstr("absent"), HasSubstr("no such file")));
  EXPECT_THAT(BLOCKID_MESSAGE(read_file(dir.path())), HasSubstr("folder"));
}

}  // namespace
}  // namespace blockid
