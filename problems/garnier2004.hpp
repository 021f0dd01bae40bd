// The resonant wide-band system of Garnier, Goodwin and Welsh 2004, with its exact response to a multisine.
#pragma once

#include <blockid/data/record.hpp>

#include <Eigen/Core>
#include <cstdint>
#include <limits>

namespace blockid::problems {

/// G(s) = 1/alpha sum_k b_k omega_k^2 (s + omega_0) / (s^2 + 2 zeta_k omega_k s + omega_k^2),   k = 1..4,
/// b = [1, 3, 1, 1], alpha = 1320, omega_0 = 225 rad/s, omega = [4, 40, 400, 4000] rad/s, zeta = 0.0008 [10, 1, 1, 1].
/// Source: Garnier, Goodwin, Welsh 2004, (31).
struct Garnier2004 {
  static constexpr double kAlpha = 1320.0;
  static constexpr double kOmega0 = 225.0;
  static Eigen::Vector4d omega_rad_s();
  static Eigen::Vector4d damping();
  static Eigen::Vector4d gain();
};

/// G(j omega), (F,).
Eigen::VectorXcd garnier2004_response(const Eigen::VectorXd& omega_rad_s);
/// (8,) in ascending modulus, conjugates side by side, positive imaginary part first.
Eigen::VectorXcd garnier2004_poles();
/// The eight break points from 2 rad/s to twice the highest natural frequency, and the one of the state-variable
/// filter. Source: section 5.
Eigen::VectorXd garnier2004_break_points();
inline constexpr double kGarnier2004SvfPole = 4000.0;

/// u(t) = sum_i amplitude_i cos(omega_i t + phase_i).
struct Multisine {
  Eigen::VectorXd omega_rad_s;
  Eigen::VectorXd amplitude;
  Eigen::VectorXd phase;
};
/// 25 tones of amplitude 1 from 2 to 6000 rad/s, evenly spread on a logarithmic scale. Amplitudes and phases are not
/// printed. No phases given: those of Schroeder 1970 for tones of equal power, phase_i = -pi i (i - 1) / 25.
Multisine garnier2004_multisine();
/// Throws Error unless there are 25 phases.
Multisine garnier2004_multisine(const Eigen::VectorXd& phase);
/// One draw of phases, (25,), for which the condition number comes near the printed one: 4089 beside 4120.
Eigen::VectorXd garnier2004_printed_phases();

/// How the record is made. The window of 4 s is the article's.
struct Garnier2004Experiment {
  Multisine input = garnier2004_multisine();
  /// True: in steady state from the first sample on. False: at rest at t = 0.
  bool steady_state = true;
  /// Samples per period of 6000 rad/s; 50 gives 190 986 samples in 4 s.
  double oversampling = 50.0;
  double length_s = 4.0;
  /// Of white normal noise on the output, 20 log10 (rms of the output / deviation of the noise); infinite: none.
  double snr_db = std::numeric_limits<double>::infinity();
  std::uint64_t seed = 1;
};

/// Input and exact output
///   y(t) = Re sum_i G(j omega_i) amplitude_i e^{j (omega_i t + phase_i)} [ + Re sum_k 2 r_k U(lambda_k) e^{lambda_k t}
///   ]
/// at t = 0, T, 2 T, ... <= 4 s; the last sum, from rest only, over poles lambda_k with positive imaginary part and
/// residues r_k, U the transform of the input. Throws Error for an oversampling of at most 2, a length that holds no
/// sample, or tones at which the sizes of the multisine disagree.
Record garnier2004_record(const Garnier2004Experiment& experiment = {});

}  // namespace blockid::problems
