// Bases in which numerator and denominator of a continuous-time rational function are expanded.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <string>

namespace blockid {

using Index = Eigen::Index;

enum class BasisKind {
  localising,  ///< frequency localising basis functions (Welsh and Goodwin 2003)
  monomial,    ///< powers of s (Levy 1959)
  chebyshev,   ///< Chebyshev polynomials on the imaginary axis
  laguerre,    ///< orthonormal functions with one real pole (Wahlberg 1991)
  kautz        ///< orthonormal functions with one pair of poles (Wahlberg 1994)
};

/// "flbf", "monomial", "chebyshev", "laguerre", "kautz".
std::string to_text(BasisKind kind);

/// The kind with that name; throws Error that lists the names.
BasisKind basis_kind(const std::string& name);

/// G = B / A with
///
///     A / E = lead + sum_{k=1..n} a_k phi_k,      B / E = sum_{j=0..m} b_j psi_j,      psi of degree m <= n
///
/// | kind       | points                        | lead      | phi_k                                                 |
/// |------------|-------------------------------|-----------|-------------------------------------------------------|
/// | localising | (n,) break points p, rising   | 1         | s^(k-1) p_k / prod_{l<=k} (s + p_l)                   |
/// | monomial   | (1,) frequency scale w        | (s/w)^n   | (s/w)^(k-1)                                           |
/// | chebyshev  | (1,) frequency scale w        | q_n(s/w)  | q_(k-1)(s/w), q_0 = 1, q_1 = z, q_i+1 = 2 z q_i + q_i-1 |
/// | laguerre   | (1,) p                        | 1         | sqrt(2p) (s-p)^(k-1) / (s+p)^k                        |
/// | kautz      | (2,) frequency, damping ratio | 1         | sqrt(2b) [sqrt(c), s] / D, times (s^2-bs+c)/D a pair  |
///
/// with D = s^2 + b s + c. phi_k lies between p_(k-1) and p_k, with a gain near one, and falls off on both sides: a
/// column of the regression is large at a few tones only, whatever the width of the band.
///
/// psi: the first m + 1 of [phi, lead] for all kinds but the localising one, which has
/// m = n:     [phi_1 .. phi_n, s / (s + p_n)]
/// m <= n-1:  phi_1 .. phi_(m+1) times prod_{j > m+1} p_j / (s + p_j).
///
/// Source: Welsh and Goodwin 2003, equations (28) (whose product must not contain the numerator), (29), (30), (36).
struct RationalBasis {
  BasisKind kind = BasisKind::localising;
  /// n >= 1; even for kautz.
  Index order = 0;
  /// m, 0 .. n; n - 1 or n for laguerre and kautz.
  Index numerator_degree = 0;
  /// rad/s (and a damping ratio below one), positive.
  Eigen::VectorXd points;
};

/// Verifies every promise of RationalBasis; throws Error.
void check(const RationalBasis& basis);

/// Break points p of the order p.size().
RationalBasis localising_basis(const Eigen::VectorXd& break_points_rad_s, Index numerator_degree);
RationalBasis monomial_basis(Index order, Index numerator_degree, double scale_rad_s = 1.0);
RationalBasis chebyshev_basis(Index order, Index numerator_degree, double scale_rad_s);
RationalBasis laguerre_basis(Index order, Index numerator_degree, double pole_rad_s);
RationalBasis kautz_basis(Index order, Index numerator_degree, double frequency_rad_s, double damping);

/// `count` points from low to high with equal ratios; the geometric mean when count is 1. 0 < low <= high.
Eigen::VectorXd break_points(double low_rad_s, double high_rad_s, Index count);

/// sqrt(low high): the scale that makes powers of s least unequal over a band.
double geometric_mean(double low_rad_s, double high_rad_s);

/// All functions of a basis at N points s.
struct BasisValues {
  Eigen::VectorXcd lead;  ///< (N,)
  Eigen::MatrixXcd phi;   ///< (N, n)
  Eigen::MatrixXcd psi;   ///< (N, m + 1)
};

/// Localising functions by a running product of bounded factors, which no width of the band can make overflow.
BasisValues evaluate(const RationalBasis& basis, const Eigen::VectorXcd& s);
/// At s = j omega.
BasisValues evaluate(const RationalBasis& basis, const Eigen::VectorXd& omega_rad_s);

/// x' = A x + B v with x_k = (phi_k / lead) v: the functions as states of one filter bank.
struct FilterBank {
  Eigen::MatrixXd a;  ///< (n, n)
  Eigen::VectorXd b;  ///< (n,)
};
FilterBank filter_bank(const RationalBasis& basis);

/// T, (n + 1, m + 1), with psi = [phi, lead] T.
Eigen::MatrixXd numerator_map(const RationalBasis& basis);

/// Coefficients of powers of s / scale_rad_s, lowest first, of the functions times c E with one constant c.
struct BasisPolynomials {
  Eigen::VectorXd lead;  ///< (n + 1,)
  Eigen::MatrixXd phi;   ///< (n + 1, n)
  Eigen::MatrixXd psi;   ///< (n + 1, m + 1)
};
BasisPolynomials polynomials(const RationalBasis& basis, double scale_rad_s);

}  // namespace blockid
