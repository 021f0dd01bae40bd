#include <blockid/blocks/taylor_expansion.hpp>

#include <blockid/data/error.hpp>

namespace blockid {

Eigen::VectorXd taylor_coefficients(const Eigen::VectorXd& power_sums) {
  const std::vector<double> a = taylor_coefficients(std::vector<double>(power_sums.begin(), power_sums.end()));
  return Eigen::Map<const Eigen::VectorXd>(a.data(), static_cast<Index>(a.size()));
}

Eigen::VectorXd power_sums(const Eigen::VectorXd& coefficients) {
  if (coefficients.size() == 0 || coefficients[0] == 0.0) {
    fail("power sums: expected Taylor coefficients with A_0 != 0, got ", coefficients.size() == 0 ? "none" : "A_0 = 0");
  }
  const Eigen::VectorXd a = coefficients / coefficients[0];
  Eigen::VectorXd s(a.size() - 1);
  for (Index k = 1; k < a.size(); ++k) {
    s[k - 1] = static_cast<double>(k) * a[k] - s.head(k - 1).dot(a.segment(1, k - 1).reverse());
  }
  return s;
}

Eigen::VectorXd taylor_tangent(const Eigen::VectorXd& coefficients, const Eigen::VectorXd& power_sum_tangent) {
  if (coefficients.size() != power_sum_tangent.size() + 1) {
    fail("taylor tangent: expected ", coefficients.size() - 1, " power sums beside ", coefficients.size(),
         " coefficients, got ", power_sum_tangent.size());
  }
  Eigen::VectorXd tangent = Eigen::VectorXd::Zero(coefficients.size());
  for (Index j = 1; j < coefficients.size(); ++j) {
    const Index rest = coefficients.size() - j;
    tangent.tail(rest) += power_sum_tangent[j - 1] / static_cast<double>(j) * coefficients.head(rest);
  }
  return tangent;
}

Eigen::VectorXd root_powers(std::complex<double> root, Index n) {
  const double members = root.imag() == 0.0 ? 1.0 : 2.0;
  Eigen::VectorXd powers(n);
  std::complex<double> power = 1.0;
  for (Index k = 0; k < n; ++k) {
    power *= root;
    powers[k] = members * power.real();
  }
  return powers;
}

}  // namespace blockid
