// Progress of a long computation on stderr.
#pragma once

#include <blockid/estimators/candidate.hpp>

#include <chrono>
#include <iosfwd>
#include <string>

namespace blockid::cli {

/// A progress function: one line that renews itself on a terminal, otherwise a line at once and then every few
/// seconds.
class ProgressDisplay {
 public:
  enum class Style { none, lines, live };

  /// unit: of the RMSE, may be empty. seconds_between_lines: for Style::lines.
  ProgressDisplay(Style style, std::ostream& stream, std::string unit, double seconds_between_lines = 3.0);
  /// Removes the live line.
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// Draws, with the time since this object was made; false once the user has interrupted.
  bool operator()(const Progress& progress);

 private:
  Style style_;
  std::ostream& stream_;
  std::string unit_;
  std::chrono::duration<double> between_;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point next_;
  bool drawn_ = false;
};

/// none when quiet, live when stderr is a terminal, lines otherwise.
ProgressDisplay::Style progress_style(bool quiet);

/// "12.3 s  candidate 2 of 8  [######....]  15/25  RMSE 0.00123 V"
std::string progress_line(const Progress& progress, const std::string& unit, bool bar);

}  // namespace blockid::cli
