// The closed loop of Crowder and de Callafon: an integrator under PI control, sampled.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

namespace blockid::problems {

/// Coefficients of powers of q^-1.
struct Polynomials {
  Eigen::VectorXd numerator;
  Eigen::VectorXd denominator;
};

/// P(s) = 1 / s, its model 1 / (s + eps) and C(s) = Kp + Ki / s with Kp = Ki = 1:
///
///   P = Ts q^-1 / (1 - q^-1),  Phat = b q^-1 / (1 - p q^-1), p = e^(-eps Ts), b = (1 - p) / eps  (zero-order hold)
///   C = (c1 + c0 q^-1) / (1 - q^-1), c1 = Kp + Ki Ts / 2, c0 = -Kp + Ki Ts / 2                    (Tustin)
///   V = k (1 - 0.82)^2 / (1 - 0.82 q^-1)^2
///
/// The paper names the systems and neither numbers, sample time nor weight: eps = 0.5, Ts = 0.1 s and V are ours.
/// Source: Crowder and de Callafon, section V.
struct CrowderCallafon {
  double eps = 0.5;
  double sample_time_s = 0.1;

  double pole() const { return std::exp(-eps * sample_time_s); }
  Polynomials plant() const;
  Polynomials model() const;
  Polynomials controller() const;
  Polynomials weight(double k) const;

  /// k of a weight that covers the uncertainty, |Delta| = 0.952, of one that does not, 1.111, and of one that covers
  /// what the paper's (10) prints, 0.952, but not the uncertainty itself, 1.120, for Nc = C and Dc = 1.
  static constexpr double kCovers = 0.70;
  static constexpr double kTight = 0.60;
  static constexpr double kCoversPrinted = 0.532;
};

/// Uniform in [0, 1): 53 bits of two draws.
double uniform(std::mt19937& generator);

/// (count,) the reference: Box and Muller's pairs from mt19937(seed), N(0, 1).
Eigen::VectorXd crowder_reference(Eigen::Index count, std::uint32_t seed = 1);

}  // namespace blockid::problems
