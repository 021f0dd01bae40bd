// Linear discrete-time models with a model of their noise.
#pragma once

#include <blockid/blocks/model.hpp>

#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

namespace blockid {

/// Degrees of the polynomials in q^-1 of a PolynomialModel, and the delay in samples.
struct PolynomialOrders {
  Index na = 0;
  Index nb = 0;
  Index nc = 0;
  Index nd = 0;
  Index nf = 0;
  Index nk = 0;
  friend bool operator==(const PolynomialOrders&, const PolynomialOrders&) = default;
};

/// Throws Error unless all are >= 0.
void check(const PolynomialOrders& orders);

/// P = na + (nb + 1) + nc + nd + nf.
Index parameter_count(const PolynomialOrders& orders);

/// "a1", ..., "b0", ..., "c1", ..., "d1", ..., "f1", ...: (P,) in the order of PolynomialModel::theta.
std::vector<std::string> parameter_names(const PolynomialOrders& orders);

/// A(q) (y_t - y_mean) = q^-nk B(q)/F(q) (u_t - u_mean) + C(q)/D(q) e_t, e white with variance `noise_variance`.
///
/// B = b_0 + b_1 q^-1 + ... + b_nb q^-nb; A = 1 + a_1 q^-1 + ... + a_na q^-na, and C, D, F likewise. Orders are
/// polynomial degrees; with nk = 0 the output answers in the sample of the input. Members of the family:
///
/// | structure   | polynomials | equation                   |
/// |-------------|-------------|----------------------------|
/// | ARX         | A, B        | A y = B u + e              |
/// | ARMAX       | A, B, C     | A y = B u + C e            |
/// | output error| B, F        | y = B/F u + e              |
/// | Box-Jenkins | B, C, D, F  | y = B/F u + C/D e          |
///
/// Source: Ljung 1999, equation (4.33).
struct PolynomialModel {
  PolynomialOrders orders;
  /// (P,) a_1 .. a_na, b_0 .. b_nb, c_1 .. c_nc, d_1 .. d_nd, f_1 .. f_nf.
  Eigen::VectorXd theta;
  double sample_time_s = 1.0;
  double u_mean = 0.0;
  double y_mean = 0.0;
  /// Zero when unknown.
  double noise_variance = 0.0;
};

/// Throws Error unless sizes agree, numbers are finite and the sample time is positive.
void check(const PolynomialModel& model);

/// Coefficients in ascending powers of q^-1, leading ones and the delay of B included.
struct Polynomials {
  Eigen::VectorXd a;
  Eigen::VectorXd b;
  Eigen::VectorXd c;
  Eigen::VectorXd d;
  Eigen::VectorXd f;
};
Polynomials polynomials(const PolynomialOrders& orders, const Eigen::VectorXd& theta);
Polynomials polynomials(const PolynomialModel& model);

/// True when all roots of p_0 z^n + p_1 z^{n-1} + ... + p_n lie inside the unit circle; p_0 != 0.
/// Source: Schur 1917, Cohn 1922, the step-down recursion.
bool has_roots_inside_circle(const Eigen::VectorXd& polynomial);

/// A and F have their roots inside the circle: the path from u to y is stable.
bool is_stable(const PolynomialModel& model);
/// A and D have: the noise is stationary.
bool has_stationary_noise(const PolynomialModel& model);
/// C and F have: the predictor forgets its start.
bool has_stable_predictor(const PolynomialModel& model);

/// G(e^{jw}) = q^-nk B/(A F) from u to y, w in rad/sample.
std::complex<double> response(const PolynomialModel& model, double omega);
/// H(e^{jw}) = C/(A D) from e to y, w in rad/sample.
std::complex<double> noise_response(const PolynomialModel& model, double omega);
/// (count,) h_0 = 1, h_1, ... of H.
Eigen::VectorXd noise_impulse_response(const PolynomialModel& model, Index count);

/// The path from u to y as a chain `input=offset | G=rational | output=offset`, for simulation and model files.
Model deterministic_part(const PolynomialModel& model);

/// (N,) response to u from rest, without noise.
Eigen::VectorXd simulate(const PolynomialModel& model, const Eigen::VectorXd& u);

}  // namespace blockid
