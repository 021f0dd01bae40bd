#pragma once

#include <Eigen/Core>

namespace blockid {

/// Measured or computed frequency response G_k at omega_k, k = 0..F-1; G(j omega) when continuous,
/// G(e^{j omega sample_time_s}) when discrete.
struct FrequencyResponse {
  Eigen::VectorXd omega_rad_s;         ///< (F,) strictly increasing, >= 0, at most pi / sample_time_s when discrete
  Eigen::VectorXcd response;           ///< (F,)
  Eigen::VectorXd standard_deviation;  ///< (F,) of |G_k - E G_k|, >= 0, or empty when unknown
  double sample_time_s = 0.0;          ///< 0 when continuous
};

/// Verifies every promise of FrequencyResponse.
/// @throws Error with the zero-based index of the offending entry.
void check(const FrequencyResponse& g);

/// 20 log10 |G_k|, (F,) in dB; -infinity where G_k = 0.
[[nodiscard]] Eigen::VectorXd magnitude_db(const FrequencyResponse& g);

/// arg G_k in degrees, (F,), unwrapped: neighbours differ by at most 180 degrees; the first lies in
/// (-180, 180].
[[nodiscard]] Eigen::VectorXd phase_deg(const FrequencyResponse& g);

}  // namespace blockid
