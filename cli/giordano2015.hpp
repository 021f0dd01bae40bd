// The simulation example of Giordano and Sjoberg 2015, section 5, step by step.
#pragma once

#include <blockid/cli/reproduction.hpp>

#include <cstdint>

namespace blockid::cli {

/// The steps (1) to (6) and the comparisons of section 5 on problems::giordano_sjoberg(seed), whose roots and
/// nonlinearity are ours because the paper prints neither: errors are compared as ratios, exponents by the filter that
/// they choose.
///
/// Twice: as printed (n = 14, n1 = 3, exponents from 1/2), and with all n coefficients following the exponents, which a
/// weak penalty pulls to 1/2. The pictures are those of figures 2 to 5, the best linear approximation's response, and
/// the errors as signals.
Reproduction giordano2015(std::uint64_t seed);

}  // namespace blockid::cli
