// Continuous-time rational models in the basis in which they were estimated.
#pragma once

#include <blockid/data/frequency_response.hpp>
#include <blockid/estimators/rational_basis.hpp>

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace blockid {

/// G = (psi b) / (lead + phi a), see RationalBasis. Nothing in it depends on how a and b were found.
struct ContinuousTransferFunction {
  RationalBasis basis;
  Eigen::VectorXd denominator;  ///< a, (n,)
  Eigen::VectorXd numerator;    ///< b, (m + 1,)
};

/// Verifies basis, sizes and that all coefficients are finite; throws Error.
void check(const ContinuousTransferFunction& model);

/// G(j omega), (F,), from the basis form: no polynomial is formed.
Eigen::VectorXcd response_at(const ContinuousTransferFunction& model, const Eigen::VectorXd& omega_rad_s);
/// The same with its frequencies.
FrequencyResponse frequency_response(const ContinuousTransferFunction& model, const Eigen::VectorXd& omega_rad_s);

/// max |A/E| / min |A/E| over the frequencies: by how much 1 + phi a cancels. Digits are lost as it grows, whatever the
/// condition number.
double denominator_drift(const ContinuousTransferFunction& model, const Eigen::VectorXd& omega_rad_s);

/// x' = A x + B u, y = C x + D u. States of localising functions are in descending order of their break points: rows
/// fall in size, which lets the QR algorithm keep all digits of slow poles beside fast ones.
struct StateSpace {
  Eigen::MatrixXd a;     ///< (n, n)
  Eigen::VectorXd b;     ///< (n,)
  Eigen::RowVectorXd c;  ///< (n,)
  double d = 0.0;
};
StateSpace state_space(const ContinuousTransferFunction& model);

/// Eigenvalues of the state matrix, polished for a localising basis, in ascending modulus, conjugates side by side,
/// (n,).
Eigen::VectorXcd poles(const ContinuousTransferFunction& model);
/// In ascending modulus, (m,); none for b = 0. Throws Error when the highest coefficient of the numerator vanishes.
Eigen::VectorXcd zeros(const ContinuousTransferFunction& model);

/// All poles in the open left half plane.
bool is_stable(const ContinuousTransferFunction& model);

/// d poles / d a, (n, n), a row for each pole in the order of poles(): dlambda = -(l'B) (da' r) / (l'r) with left and
/// right eigenvectors l, r.
Eigen::MatrixXcd pole_sensitivities(const ContinuousTransferFunction& model);

/// Standard deviations of what a pole is described by, each (n,) in the order of poles().
struct PoleDeviations {
  Eigen::VectorXd real;       ///< rad/s
  Eigen::VectorXd imaginary;  ///< rad/s
  Eigen::VectorXd frequency;  ///< of its modulus, rad/s
  Eigen::VectorXd damping;    ///< of -Re / modulus
};
/// By linearisation, from the covariance of a in the leading (n, n) part of `covariance`.
PoleDeviations pole_deviations(const ContinuousTransferFunction& model, const Eigen::MatrixXd& covariance);

/// Standard deviation of the modulus of the error of G(j omega), (F,), by linearisation, from the covariance of [a, b].
Eigen::VectorXd response_deviation(const ContinuousTransferFunction& model, const Eigen::MatrixXd& covariance,
                                   const Eigen::VectorXd& omega_rad_s);

/// B(z) / A(z) with z = s / scale_rad_s, lowest powers first, A monic.
struct RationalPolynomials {
  Eigen::VectorXd numerator;    ///< (m + 1,)
  Eigen::VectorXd denominator;  ///< (n + 1,)
  double scale_rad_s = 1.0;
};
/// With the geometric mean of the points as scale, or the given one. Throws Error when a coefficient overflows.
RationalPolynomials polynomials(const ContinuousTransferFunction& model);
RationalPolynomials polynomials(const ContinuousTransferFunction& model, double scale_rad_s);

/// gain prod (s - zero) / prod (s - pole).
struct ZeroPoleGain {
  Eigen::VectorXcd zeros;
  Eigen::VectorXcd poles;
  double gain = 0.0;
};
/// Throws Error when the gain overflows or underflows: then use second_order_sections.
ZeroPoleGain zero_pole_gain(const ContinuousTransferFunction& model);

/// (c0 + c1 z + c2 z^2) / (d0 + d1 z + d2 z^2) with z = s / scale_rad_s.
struct SecondOrderSection {
  double scale_rad_s = 1.0;
  Eigen::Vector3d numerator = Eigen::Vector3d::Zero();
  Eigen::Vector3d denominator = Eigen::Vector3d::Zero();
};
/// Sections in ascending frequency of their poles, each with unit modulus of its scaled poles, zeros with the nearest
/// poles; the product of all is G.
std::vector<SecondOrderSection> second_order_sections(const ContinuousTransferFunction& model);

}  // namespace blockid
