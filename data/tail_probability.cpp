#include "blockid/data/tail_probability.hpp"

#include <Eigen/Core>
#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace blockid {

double chi_square_tail(double x, double degrees_of_freedom) {
  if (!(x > 0.0)) return std::isnan(x) ? x : 1.0;
  return std::isinf(x) ? 0.0 : Eigen::numext::igammac(0.5 * degrees_of_freedom, 0.5 * x);
}

double f_tail(double x, double d_1, double d_2) {
  if (!(x > 0.0)) return std::isnan(x) ? x : 1.0;
  return std::isinf(x) ? 0.0 : Eigen::numext::betainc(0.5 * d_2, 0.5 * d_1, d_2 / (d_2 + d_1 * x));
}

double normal_tail(double x) { return 0.5 * std::erfc(x / std::sqrt(2.0)); }

double chi_square_point(double significance, double degrees_of_freedom) {
  // Twice as far until the point is inside, then bisection to neighbouring numbers.
  double low = 0.0;
  double high = 1.0;
  while (chi_square_tail(high, degrees_of_freedom) > significance) high *= 2.0;
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    (chi_square_tail(middle, degrees_of_freedom) > significance ? low : high) = middle;
  }
}

double two_sided_point(double significance) {
  // Bisection to neighbouring numbers; normal_tail(40) underflows.
  double low = 0.0;
  double high = 40.0;
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    (2.0 * normal_tail(middle) > significance ? low : high) = middle;
  }
}

}  // namespace blockid
