// The progress display, its lines and its silence.
#include <blockid/cli/progress_display.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>

namespace {

using namespace blockid;
using namespace blockid::cli;
using ::testing::HasSubstr;

TEST(Progress, LineSaysStageStepsAndError) {
  const Progress progress{"splits", 12, 48, 0.00125, 2.34};
  EXPECT_EQ(progress_line(progress, "V", false), "2.3 s  splits  12/48  RMSE 0.00125 V");
  EXPECT_EQ(progress_line(progress, "", true), "2.3 s  splits  [#####...............]  12/48  RMSE 0.00125");
  EXPECT_EQ(progress_line({"search", 7, 0, std::numeric_limits<double>::infinity(), 0.0}, "", true),
            "0.0 s  search  7");
  EXPECT_THAT(progress_line({"beyond", 9, 3, 1.0, 0.0}, "", true), HasSubstr("[####################]"));
}

TEST(Progress, LinesAreFew) {
  std::ostringstream stream;
  {
    ProgressDisplay display(ProgressDisplay::Style::lines, stream, "V", 1e6);
    for (int k = 0; k < 100; ++k) EXPECT_TRUE(display({"splits", k, 100, 1.0, 0.0}));
  }
  const std::string text = stream.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
}

TEST(Progress, LiveLineIsRemovedAtTheEnd) {
  std::ostringstream stream;
  {
    ProgressDisplay display(ProgressDisplay::Style::live, stream, "V");
    display({"splits", 1, 100, 1.0, 0.0});
  }
  EXPECT_EQ(stream.str().substr(0, 4), "\r\x1b[K");
  EXPECT_EQ(stream.str().substr(stream.str().size() - 4), "\r\x1b[K");
  EXPECT_EQ(stream.str().find('\n'), std::string::npos);
}

TEST(Progress, NoneIsSilent) {
  std::ostringstream stream;
  {
    ProgressDisplay display(ProgressDisplay::Style::none, stream, "V");
    EXPECT_TRUE(display({"splits", 1, 100, 1.0, 0.0}));
  }
  EXPECT_EQ(stream.str(), "");
}

}  // namespace
