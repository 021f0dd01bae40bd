// Arithmetic that takes numbers below 2.2e-308 for zero.
#pragma once

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace blockid::detail {

/// While it lives, results and operands of this thread that are subnormal are zero. What an initial state leaves dies
/// away geometrically, and processors are slower by tens on subnormal numbers. No effect where there is no SSE2.
class FlushDenormals {
 public:
#if defined(__SSE2__)
  FlushDenormals() : before_(_mm_getcsr()) {
    constexpr unsigned kFlushToZero = 0x8000;
    constexpr unsigned kDenormalsAreZero = 0x0040;
    _mm_setcsr(before_ | kFlushToZero | kDenormalsAreZero);
  }
  ~FlushDenormals() { _mm_setcsr(before_); }
#else
  FlushDenormals() = default;
  ~FlushDenormals() {}
#endif
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
#if defined(__SSE2__)
  unsigned before_;
#endif
};

}  // namespace blockid::detail
