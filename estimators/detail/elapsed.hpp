// How long a computation has taken so far.
#pragma once

#include <chrono>

namespace blockid::detail {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace blockid::detail
