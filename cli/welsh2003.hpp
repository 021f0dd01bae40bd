// Welsh and Goodwin 2003, "Frequency localising basis functions for wide-band identification", computed anew.
#pragma once

#include <blockid/cli/reproduction.hpp>

#include <cstdint>

namespace blockid::cli {

/// Table 1 with figures 1 and 2. There is no noise in it: the seed changes nothing.
Reproduction welsh2003(std::uint64_t seed);
/// Theorem 1 and its footnote.
Reproduction welsh2003_theorem1(std::uint64_t seed);

}  // namespace blockid::cli
