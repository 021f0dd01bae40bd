// Crowder and de Callafon, section V, computed anew.
#pragma once

#include <blockid/cli/reproduction.hpp>

#include <cstdint>

namespace blockid::cli {

/// Figures 2 and 3 for the numbers of problems/crowder_callafon.hpp. The paper prints pictures and no numbers: what has
/// to be reproduced are its statements, and reference values of an independent computation in double precision.
/// seed: 1 is the reference signal that the reference values belong to; with others only the statements are checked.
Reproduction crowder_callafon(std::uint64_t seed);

}  // namespace blockid::cli
