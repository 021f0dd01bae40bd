// Sections 5 and 6 of Garnier, Goodwin and Welsh 2004.
#pragma once

#include <blockid/cli/reproduction.hpp>

#include <cstdint>

namespace blockid::cli {

/// Table 1 and figure 1: condition numbers and models of the state-variable filter and of localising functions on the
/// eighth-order system, and what other holds make of them; `seed` is that of a noisy record which the paper has not.
Reproduction garnier2004(std::uint64_t seed);

/// Figures 2 and 3 on the measured robot arm. Nothing is drawn at random. Throws Error naming the file when the record
/// is not in problems::data_folder().
Reproduction garnier2004_robot_arm(std::uint64_t seed);

}  // namespace blockid::cli
