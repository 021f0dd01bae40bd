#pragma once

namespace blockid {

/// P(X > x) of a chi-square variable with `degrees_of_freedom` > 0, by the incomplete gamma function.
[[nodiscard]] double chi_square_tail(double x, double degrees_of_freedom);

/// x with P(X > x) = significance, 0 < significance <= 1: 6.635 for 0.01 and one degree of freedom.
[[nodiscard]] double chi_square_point(double significance, double degrees_of_freedom);

/// P(X > x) of Fisher's F with d_1, d_2 > 0 degrees of freedom: the ratio of two mean squares.
[[nodiscard]] double f_tail(double x, double d_1, double d_2);

/// P(X > x) of a standard normal variable.
[[nodiscard]] double normal_tail(double x);

/// z with P(|X| > z) = significance of a standard normal X, 0 < significance <= 1: 2.5758 for 0.01.
[[nodiscard]] double two_sided_point(double significance);

}  // namespace blockid
