// Roots of polynomials in q^-1, real ones and complex pairs kept together.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

namespace blockid {

using Index = Eigen::Index;

/// One real root or one complex pair of a polynomial in x = q^-1.
///
/// kind real: factor 1 - value x; pair: 1 - 2 Re(value) x + |value|^2 x^2, Im(value) > 0; infinite: factor x, a zero
/// that left through infinity (one more sample of delay).
struct RootGroup {
  enum class Kind { real, pair, infinite };
  Kind kind = Kind::real;
  std::complex<double> value = 0.0;

  Index degree() const { return kind == Kind::pair ? 2 : 1; }
  /// (degree + 1,) coefficients in powers of x, scaled so that the largest is one in magnitude.
  Eigen::VectorXd polynomial() const;
};

/// Groups of p_0 + p_1 x + ... + p_n x^n as the roots z of p_0 z^n + p_1 z^{n-1} + ... + p_n: n degrees in all.
///
/// Leading coefficients below `tolerance` times the largest count as zero and give infinite groups. Throws Error for
/// the zero polynomial. Source of the convention: Giordano and Sjoberg 2015, equation (5).
std::vector<RootGroup> root_groups(const Eigen::VectorXd& polynomial, double tolerance = 1e-12);

/// Product of the groups' polynomials: (sum of degrees + 1,); the constant 1 for none.
Eigen::VectorXd product(const std::vector<RootGroup>& groups);

/// The complex pair as two real roots: at its real part, or on either side of it.
std::vector<RootGroup> broken_pair(const RootGroup& pair);

/// "0.9", "0.7+-0.3i", "inf".
std::string to_text(const RootGroup& group);
std::string to_text(const std::vector<RootGroup>& groups);

/// All roots as complex numbers, infinite ones left out.
std::vector<std::complex<double>> roots(const std::vector<RootGroup>& groups);

/// p with every root outside the circle reflected to 1/conj: a_0 = 1 kept.
Eigen::VectorXd stabilised(const Eigen::VectorXd& denominator);

}  // namespace blockid
