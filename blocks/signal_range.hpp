// The interval of values that a static block is laid out for.
#pragma once

namespace blockid {

/// lower < upper, both in units of the block's input.
struct SignalRange {
  double lower = -1.0;
  double upper = 1.0;
};

}  // namespace blockid
