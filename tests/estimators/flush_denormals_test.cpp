#include <blockid/estimators/detail/flush_denormals.hpp>

#include <gtest/gtest.h>

#include <limits>

namespace blockid {
namespace {

// Half of the smallest normal number, by the processor and not by the compiler.
double half_of_the_smallest() {
  volatile double smallest = std::numeric_limits<double>::min();
  volatile double half = 0.5 * smallest;
  return half;
}

TEST(FlushDenormalsTest, LastsAsLongAsItLives) {
  EXPECT_GT(half_of_the_smallest(), 0.0);
  double within = 1.0;
  double nested = 1.0;
  {
    const detail::FlushDenormals outer;
    { const detail::FlushDenormals inner; }
    nested = half_of_the_smallest();
    within = 2.0 * nested;
  }
#if defined(__SSE2__)
  EXPECT_EQ(nested, 0.0);
  EXPECT_EQ(within, 0.0);
#endif
  EXPECT_GT(half_of_the_smallest(), 0.0);
}

}  // namespace
}  // namespace blockid
