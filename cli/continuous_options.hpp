// Option texts that `frf` and `ct` share.
#pragma once

#include <blockid/blocks/hold.hpp>
#include <blockid/estimators/excited_band.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid::cli {

using Index = Eigen::Index;

/// Degrees of B(s) / A(s).
struct Degrees {
  Index numerator = 0;
  Index denominator = 1;
};

/// --orders NB,NA. Throws Error unless 0 <= NB <= NA and NA >= 1.
Degrees parse_degrees(const std::vector<int>& orders);

/// Powers of s that have no coefficient.
struct MissingCoefficients {
  std::vector<Index> numerator;
  std::vector<Index> denominator;
};

/// --without NAME, "a0" or "b1". Throws Error for a name that these degrees do not have or that is there twice, and
/// when nothing of the numerator remains.
MissingCoefficients parse_without(const std::vector<std::string>& names, const Degrees& degrees);

/// "LO:HI" with 0 < LO < HI. Throws Error that begins with `option`.
FrequencyRange parse_frequency_range(const std::string& option, const std::string& text);

/// --break-points LO:HI[:COUNT]: `count` points with equal ratios. Throws Error for another count, and when the points
/// lie outside `band` altogether.
Eigen::VectorXd parse_break_points(const std::string& text, Index count, const FrequencyRange& band);

/// --hold WORD. Throws Error that lists the words.
Hold parse_hold(const std::string& word);

}  // namespace blockid::cli
