// Calls in a child process: what they return, what they cannot reach, how they end.
#include "data/message.hpp"

#include <blockid/validation/isolated_call.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <unistd.h>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <thread>

namespace blockid::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kLimit = 60.0;

TEST(IsolatedCall, NumbersComeBack) {
  EXPECT_THAT(call_isolated([] { return std::vector<double>{1.5, -2.0}; }, kLimit), ElementsAre(1.5, -2.0));
  EXPECT_THAT(call_isolated([] { return std::vector<double>(); }, kLimit), IsEmpty());
  // More than a pipe holds at once.
  const std::vector<double> many = call_isolated([] { return std::vector<double>(100'000, 3.0); }, kLimit);
  EXPECT_EQ(many, std::vector<double>(100'000, 3.0));
}

TEST(IsolatedCall, NothingOfTheParentIsReached) {
  int changed = 0;
  setenv("BLOCKID_ISOLATED_CALL", "before", 1);
  const auto here = std::filesystem::current_path();
  const std::vector<double> seen = call_isolated(
      [&changed] {
        changed = 1;
        setenv("BLOCKID_ISOLATED_CALL", "after", 1);
        std::puts("printed by the child");
        std::fflush(stdout);
        const bool empty = std::filesystem::is_empty(std::filesystem::current_path());
        return std::vector<double>{empty ? 1.0 : 0.0};
      },
      kLimit);
  EXPECT_THAT(seen, ElementsAre(1.0));
  EXPECT_EQ(changed, 0);
  EXPECT_STREQ(std::getenv("BLOCKID_ISOLATED_CALL"), "before");
  EXPECT_EQ(std::filesystem::current_path(), here);
  unsetenv("BLOCKID_ISOLATED_CALL");
}

TEST(IsolatedCall, OpenFilesAreClosedAndTheFolderGoes) {
  const int file = open("/dev/null", O_RDONLY);
  ASSERT_GE(file, 0);
  const std::vector<double> seen = call_isolated(
      [file] {
        const auto folder = std::filesystem::current_path();
        std::FILE* left = std::fopen("param.csdp", "w");
        if (left != nullptr) std::fclose(left);
        return std::vector<double>{fcntl(file, F_GETFD) < 0 || file == 3 ? 1.0 : 0.0, left != nullptr ? 1.0 : 0.0};
      },
      kLimit);
  close(file);
  EXPECT_THAT(seen, ElementsAre(1.0, 1.0));
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::temp_directory_path())) {
    EXPECT_FALSE(entry.is_directory() && entry.path().filename().string().starts_with("blockid_") &&
                 std::filesystem::exists(entry.path() / "param.csdp"))
        << entry.path();
  }
}

TEST(IsolatedCall, EndsAreReported) {
  using Numbers = std::vector<double>;
  const auto message = [](const std::function<Numbers()>& call, double limit) {
    return message_of([&] { call_isolated(call, limit); });
  };
  // exit(0) is no answer either.
  EXPECT_THAT(message([]() -> Numbers { std::exit(0); }, kLimit), HasSubstr("without an answer"));
  EXPECT_THAT(message([]() -> Numbers { std::exit(206); }, kLimit), HasSubstr("without an answer"));
  EXPECT_THAT(message([]() -> Numbers { throw std::runtime_error("no"); }, kLimit), HasSubstr("without an answer"));
  EXPECT_THAT(message([]() -> Numbers { throw 1; }, kLimit), HasSubstr("without an answer"));
  EXPECT_THAT(message(
                  []() -> Numbers {
                    raise(SIGKILL);
                    return {};
                  },
                  kLimit),
              HasSubstr("signal 9"));
  const auto before = std::chrono::steady_clock::now();
  EXPECT_THAT(message(
                  []() -> Numbers {
                    std::this_thread::sleep_for(std::chrono::minutes(10));
                    return {};
                  },
                  0.05),
              HasSubstr("within 0.05 s"));
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::minutes(5));
  EXPECT_THAT(message([] { return Numbers(); }, 0.0), HasSubstr("above 0 s, got 0"));
}

}  // namespace
}  // namespace blockid::testing
