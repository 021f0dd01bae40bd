// Coprime factors of a loop with several inputs and outputs, and the signals that its uncertainty connects.
#pragma once

#include <blockid/validation/discrete_state_space.hpp>

#include <Eigen/Core>

namespace blockid {

/// G = N D^-1, both stable: with A + B F stable, D = (A + B F, B, F, 1) and N = (A + B F, B, C + D F, D).
struct RightFactors {
  DiscreteStateSpace numerator;    ///< N (p, m)
  DiscreteStateSpace denominator;  ///< D (m, m)
};

/// F by stabilising_feedback(): D = 1 for a stable G. For one input and output N and D are those of coprime_factors().
/// Throws Error as it does: the factors are coprime as long as all unstable modes are reached and seen.
RightFactors right_factors(const DiscreteStateSpace& g, double pole);

/// G = D~^-1 N~, both stable: with A + L C stable, D~ = (A + L C, L, C, 1) and N~ = (A + L C, B + L D, C, D).
struct LeftFactors {
  DiscreteStateSpace numerator;    ///< N~ (p, m)
  DiscreteStateSpace denominator;  ///< D~ (p, p)
};

/// L by stabilising_feedback() of A', C'. Throws Error as it does.
LeftFactors left_factors(const DiscreteStateSpace& g, double pole);

/// The loop u = r - C y, y = P u + d around the model Phat = Nhat Dhat^-1, and the set of plants
/// { (Nhat + Dc Delta V) (Dhat - Nc Delta V)^-1 : |Delta| <= 1 } with C = Nc Dc^-1, all of them right factors.
/// Source: as UncertainLoop, which it is for one input and output.
struct MimoLoop {
  DiscreteStateSpace plant;       ///< Phat (p, m)
  DiscreteStateSpace controller;  ///< C (m, p)
  DiscreteStateSpace weight;      ///< V (m, m), with a regular direct term, poles and zeros inside the unit circle
  double factor_pole = 0.0;       ///< where the factors have their poles instead of the unstable ones
};

/// Throws Error when sizes do not agree, the controller does not stabilise the model (hidden modes included), or the
/// weight is not biproper, stable and minimum phase.
void check(const MimoLoop& loop);

/// The least k with rho^k <= remainder, rho the largest modulus of the poles of the model's loop and the zeros of the
/// weight: as uncertainty_memory() of one input and output. Throws Error as check() does, and unless
/// 0 < remainder < 1.
Eigen::Index uncertainty_memory(const MimoLoop& loop, double remainder = 0.01);

/// w = Delta v + delta, where delta is what the disturbance leaves: zero without one.
struct MimoSignals {
  Eigen::MatrixXd v;  ///< (m, N)
  Eigen::MatrixXd w;  ///< (p, N)
};

/// v = V (D~c Dhat + N~c Nhat)^-1 (D~c u + N~c y), w = (D~ Dc + N~ Nc)^-1 (D~ y - N~ u).
///
/// The left factors stand here because [D~c, N~c; -N~, D~] [Dhat, -Nc; Nhat, Dc] is block diagonal (Bezout): what is
/// filtered is the inverse of the second matrix, a stable system with the poles of the loop, and no left factor is
/// computed. u (m, N), y (p, N) from the start of the experiment, when all was at rest. Throws Error as check() does,
/// for sizes that differ, and when v is zero.
/// Source: Crowder and de Callafon, equations (24)-(27), for one input and output; factors that do not commute: ours.
MimoSignals uncertainty_signals(const MimoLoop& loop, const Eigen::MatrixXd& u, const Eigen::MatrixXd& y);

/// (m, N) v = V (D~c Dhat + N~c Nhat)^-1 D~c r: the same v from the reference r (m, N).
Eigen::MatrixXd uncertainty_input(const MimoLoop& loop, const Eigen::MatrixXd& r);

/// max |C y + u - r| over samples and channels.
double reference_error(const DiscreteStateSpace& controller, const Eigen::MatrixXd& u, const Eigen::MatrixXd& y,
                       const Eigen::MatrixXd& r);

struct MimoRecord {
  Eigen::MatrixXd u;  ///< (m, N)
  Eigen::MatrixXd y;  ///< (p, N)
};

/// u = r - C y, y = P u + d from rest. Throws Error for sizes that differ and for an algebraic loop without solution.
MimoRecord simulate_closed_loop(const DiscreteStateSpace& plant, const DiscreteStateSpace& controller,
                                const Eigen::MatrixXd& r, const Eigen::MatrixXd& d);

struct MimoUncertainRecord {
  MimoRecord record;
  MimoSignals signals;
  Eigen::MatrixXd delta;  ///< (p, N) what the disturbance leaves in w
};

/// The loop of the plant that `uncertainty` (p, m) makes of the model, from rest, by stable filters alone:
/// w = Delta v + delta, delta = (L^-1 D~ - Delta V M^-1 N~c) d with L = D~ Dc + N~ Nc, M = D~c Dhat + N~c Nhat;
/// u = Dhat x - Nc w, y = Nhat x + Dc w with x = M^-1 D~c r, v = V x.
///
/// r (m, N), d (p, N). Throws Error as check() does, for sizes that differ, and when Delta has a pole on or outside
/// the unit circle.
MimoUncertainRecord simulate_uncertain_loop(const MimoLoop& loop, const DiscreteStateSpace& uncertainty,
                                            const Eigen::MatrixXd& r, const Eigen::MatrixXd& d);

}  // namespace blockid
