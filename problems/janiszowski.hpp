// The pneumatic servomechanism of Janiszowski 1999.
#pragma once

#include <blockid/data/record.hpp>

#include <Eigen/Core>
#include <cstdint>

namespace blockid::problems {

/// v'' + a1 v' + a0 v = b0 u: the velocity in mm/s of a servo, natural frequency 20 rad/s, damping 0.5, gain 2500.
/// Source: Janiszowski 1999, section 3.
struct ServoPlant {
  static constexpr double kA1 = 20.0;
  static constexpr double kA0 = 400.0;
  static constexpr double kB0 = 1e6;
};

/// Exact response of ServoPlant from rest to an input held between samples (zero-order hold).
struct ServoMotion {
  Eigen::VectorXd velocity_mm_s;
  /// The integral of the velocity.
  Eigen::VectorXd position_mm;
};
ServoMotion servo_response(const Eigen::VectorXd& u, double sample_time_s);

/// (n,) u(t) = amplitude (sin(2 pi 4 t) + 2 sin(2 pi 12 t)).
Eigen::VectorXd two_tones(Eigen::Index n, double sample_time_s, double amplitude = 1.0);

/// What disturbs the measured position.
struct ServoConditions {
  double sample_time_s = 1e-3;
  /// w: scale of the slow drift, a random walk.
  double drift_um = 100.0;
  /// eta: width of the uniform noise.
  double noise_um = 10.0;
  /// epsilon: step of the measurement.
  double resolution_um = 10.0;
  std::uint64_t seed = 1;
};

/// Input and reconstructed velocity in mm/s.
///
///   u(t) = 7.814 sin(2 pi (4.12 t + (16.53 - 4.12) t^2 / (2 T))), T = 2.5 s, held between samples
///   measured position = epsilon round((x + drift + eta (r - 1/2)) / epsilon), drift = 0.46 w walk / max |walk|
///   y(k) = (x(k+2) + x(k+1) - x(k-1) - x(k-2)) / (6 D); the two samples at either end are missing
/// The paper prints neither input nor drift nor how the velocity was obtained: these are a reconstruction, chosen
/// because its errors are those of the paper's tables. Source: Janiszowski 1999, section 3.
Record servo_record(const ServoConditions& conditions);

}  // namespace blockid::problems
