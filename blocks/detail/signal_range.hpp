// Ranges of signals for the static blocks.
#pragma once

#include <blockid/blocks/signal_range.hpp>

#include <span>

namespace blockid::detail {

/// Throws Error unless lower < upper and both are finite.
void check_range(SignalRange range, const char* block);

/// Smallest interval that holds v; throws Error for an empty, constant or non-finite signal.
SignalRange range_of(std::span<const double> v, const char* block);

}  // namespace blockid::detail
