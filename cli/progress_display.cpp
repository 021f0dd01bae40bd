#include <blockid/cli/progress_display.hpp>

#include <blockid/cli/interrupt.hpp>
#include <blockid/cli/text_table.hpp>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <utility>

namespace blockid::cli {
namespace {

constexpr Index kBarWidth = 20;
constexpr double kSecondsBetweenFrames = 0.1;
constexpr const char* kClearLine = "\r\x1b[K";

std::string bar_text(Index step, Index steps) {
  const Index filled = std::clamp<Index>(step * kBarWidth / steps, 0, kBarWidth);
  return "[" + std::string(static_cast<std::size_t>(filled), '#') +
         std::string(static_cast<std::size_t>(kBarWidth - filled), '.') + "]";
}

}  // namespace

std::string progress_line(const Progress& progress, const std::string& unit, bool bar) {
  constexpr int kDigits = 5;
  std::string line = fixed_number(progress.elapsed_s, 1) + " s  " + progress.stage;
  if (progress.steps > 0) {
    if (bar) line += "  " + bar_text(progress.step, progress.steps);
    line += "  " + std::to_string(progress.step) + "/" + std::to_string(progress.steps);
  } else {
    line += "  " + std::to_string(progress.step);
  }
  if (std::isfinite(progress.rmse)) line += "  RMSE " + with_unit(number(progress.rmse, kDigits), unit);
  return line;
}

ProgressDisplay::ProgressDisplay(Style style, std::ostream& stream, std::string unit, double seconds_between_lines)
    : style_(style),
      stream_(stream),
      unit_(std::move(unit)),
      between_(style == Style::live ? kSecondsBetweenFrames : seconds_between_lines),
      start_(std::chrono::steady_clock::now()),
      next_(start_) {}

ProgressDisplay::~ProgressDisplay() {
  if (drawn_) stream_ << kClearLine << std::flush;
}

bool ProgressDisplay::operator()(const Progress& progress) {
  const auto now = std::chrono::steady_clock::now();
  if (style_ != Style::none && now >= next_) {
    next_ = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(between_);
    const bool live = style_ == Style::live;
    Progress timed = progress;
    timed.elapsed_s = std::chrono::duration<double>(now - start_).count();
    const std::string line = progress_line(timed, unit_, live);
    if (live) {
      stream_ << kClearLine << line << std::flush;
      drawn_ = true;
    } else {
      stream_ << line << '\n' << std::flush;
    }
  }
  return !interrupted();
}

ProgressDisplay::Style progress_style(bool quiet) {
  if (quiet) return ProgressDisplay::Style::none;
  return ::isatty(STDERR_FILENO) == 1 ? ProgressDisplay::Style::live : ProgressDisplay::Style::lines;
}

}  // namespace blockid::cli
