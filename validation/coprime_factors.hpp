// Coprime factors of a loop of model and controller, and the signals that its uncertainty connects.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// G(q) = (b_0 + b_1 q^-1 + ... + b_nb q^-nb) / (a_0 + a_1 q^-1 + ... + a_na q^-na), a_0 not zero.
struct DiscreteTransferFunction {
  Eigen::VectorXd numerator;    ///< (nb + 1,)
  Eigen::VectorXd denominator;  ///< (na + 1,)
};

/// Throws Error unless both polynomials are finite and not empty and a_0 is not zero.
void check(const DiscreteTransferFunction& g);

/// y = G u from rest. Throws Error unless both polynomials are finite and a_0 is not zero.
Eigen::VectorXd filter(const DiscreteTransferFunction& g, const Eigen::VectorXd& u);

/// (n,) roots z of a_0 z^n + ... + a_n. Throws Error unless the coefficients are finite and a_0 is not zero.
Eigen::VectorXcd polynomial_roots(const Eigen::VectorXd& polynomial);

/// Largest |z| with a_0 z^na + ... + a_na = 0; 0 for a constant.
double spectral_radius(const Eigen::VectorXd& polynomial);

/// G = N D^-1 with N = numerator / stable, D = denominator / stable; N and D have no pole outside the circle when
/// `stable` has no root there.
struct CoprimeFactors {
  Eigen::VectorXd numerator;
  Eigen::VectorXd denominator;
  Eigen::VectorXd stable;
};

/// `stable` = the denominator of G with every root on or outside the unit circle moved to `pole`: a controller
/// (c_1 + c_0 q^-1) / (1 - q^-1) gets D = (1 - q^-1) / (1 - pole q^-1). D = 1 for a stable G.
/// Throws Error unless |pole| < 1.
CoprimeFactors coprime_factors(const DiscreteTransferFunction& g, double pole);

/// N = G, D = 1, whether G is stable or not. For an integrating G the set of plants that the factors describe contains
/// some that the controller does not stabilise: prefer coprime_factors().
CoprimeFactors trivial_factors(const DiscreteTransferFunction& g);

/// The loop u = r - C y, y = P u + d around the model Phat = Nhat Dhat^-1, and the set of plants
/// { (Nhat + Dc Delta V) (Dhat - Nc Delta V)^-1 : |Delta| <= 1 } with C = Nc Dc^-1.
/// Source: Crowder and de Callafon, equations (3)-(7), with |Delta| <= 1, which is what their (19) tests. Solved for
/// Delta V: Dc^-1 (1 + P C)^-1 (P - Phat) Dhat with the true P, where (8) and (9) print Phat in the sensitivity.
struct UncertainLoop {
  CoprimeFactors plant;
  CoprimeFactors controller;
  DiscreteTransferFunction weight;  ///< V, with b_0 not zero, poles and zeros inside the unit circle
};

/// chi = d_P d_C + n_P n_C, whose roots are the poles of the loop of model and controller.
Eigen::VectorXd characteristic_polynomial(const UncertainLoop& loop);

/// Throws Error when the controller does not stabilise the model, or the weight is not biproper, stable and minimum
/// phase.
void check(const UncertainLoop& loop);

/// The least k with rho^k <= remainder, where rho is the largest modulus among the poles of the model's loop and the
/// zeros of the weight: after k samples the response of Delta = V^-1 Dc^-1 (1 + P C)^-1 (P - Phat) Dhat has decayed to
/// about that part of itself, as long as the true loop is about as fast as the model's. 0 when there is nothing to
/// decay. Throws Error as check() does, and unless 0 < remainder < 1.
Eigen::Index uncertainty_memory(const UncertainLoop& loop, double remainder = 0.01);

/// w = Delta v + delta, where delta is what the disturbance leaves: zero without one.
struct UncertaintySignals {
  Eigen::VectorXd v;
  Eigen::VectorXd w;
};

/// v = V Lambda^-1 (Dc u + Nc y), w = Lambda^-1 (Dhat y - Nhat u), Lambda = Dhat Dc + Nhat Nc.
///
/// u, y (N,) from the start of the experiment, when all was at rest: cut windows from v and w, not from u and y.
/// Throws Error as check() does, for sizes that differ, and when v is zero.
/// Source: Crowder and de Callafon, equations (24)-(27).
UncertaintySignals uncertainty_signals(const UncertainLoop& loop, const Eigen::VectorXd& u, const Eigen::VectorXd& y);

/// w of uncertainty_signals() alone, without a condition on v: delta, when there is no reference.
Eigen::VectorXd uncertainty_output(const UncertainLoop& loop, const Eigen::VectorXd& u, const Eigen::VectorXd& y);

/// v = V Lambda^-1 Dc r: the same v from the reference, by (28).
Eigen::VectorXd uncertainty_input(const UncertainLoop& loop, const Eigen::VectorXd& r);

/// max |(C y + u - r)_t| over t >= first: large when a saturation or another controller than C was at work. The first
/// samples need y from before the record, which counts as zero: for C without poles as many as its degree.
double reference_error(const DiscreteTransferFunction& controller, const Eigen::VectorXd& u, const Eigen::VectorXd& y,
                       const Eigen::VectorXd& r, Eigen::Index first = 0);

/// u = r - C y, y = P u + d from rest.
struct ClosedLoopRecord {
  Eigen::VectorXd u;
  Eigen::VectorXd y;
};
ClosedLoopRecord simulate_closed_loop(const DiscreteTransferFunction& plant, const DiscreteTransferFunction& controller,
                                      const Eigen::VectorXd& r, const Eigen::VectorXd& d);

struct UncertainRecord {
  ClosedLoopRecord record;
  UncertaintySignals signals;
  Eigen::VectorXd delta;  ///< what the disturbance leaves in w
};

/// The loop of the plant that `uncertainty` makes of the model, from rest, by filters of the model's loop alone:
/// v = V Lambda^-1 Dc r, w = Delta v + delta, delta = (Dhat - Nc V Delta) Lambda^-1 d,
/// y = Lambda^-1 Nhat Dc r + Dc w, u = Lambda^-1 Dhat Dc r - Nc w.
///
/// r, d (N,) for studies of what a test can see. The plant itself, multiplied out, loses several digits.
/// Throws Error as check() does, for sizes that differ, and when Delta has a pole on or outside the unit circle.
UncertainRecord simulate_uncertain_loop(const UncertainLoop& loop, const DiscreteTransferFunction& uncertainty,
                                        const Eigen::VectorXd& r, const Eigen::VectorXd& d);

}  // namespace blockid
