// Tables 1 and 2 and figure 1 of Janiszowski 1999.
#pragma once

#include <blockid/cli/reproduction.hpp>

#include <cstdint>

namespace blockid::cli {

/// Errors of damping, natural frequency and gain by both schemes under drift, noise, coarse measurement and other
/// sample times, with convergence and settling time; figure 1. Medians over nine records problems::servo_record() from
/// `seed` on.
Reproduction janiszowski1999_table1(std::uint64_t seed);

/// Coefficients of five structures and the criterion IQ, on problems::servo_record() of `seed`.
Reproduction janiszowski1999_table2(std::uint64_t seed);

}  // namespace blockid::cli
