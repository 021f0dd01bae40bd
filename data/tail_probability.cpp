#include "blockid/data/tail_probability.hpp"

#include <Eigen/Core>
#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace blockid {

double chi_square_tail(double x, double degrees_of_freedom) {
  if (!(x > 0.0)) return std::isnan(x) ? x : 1.0;
  return std::isinf(x) ? 0.0 : Eigen::numext::igammac(0.5 * degrees_of_freedom, 0.5 * x);
}

double normal_tail(double x) { return 0.5 * std::erfc(x / std::sqrt(2.0)); }

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
