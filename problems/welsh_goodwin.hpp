// Simulated systems over many decades after Welsh and Goodwin 2003.
#pragma once

#include <blockid/data/frequency_response.hpp>

#include <Eigen/Core>
#include <cstdint>

namespace blockid::problems {

/// G(s) = sum_k b_k omega_k^2 / (s^2 + 2 zeta_k omega_k s + omega_k^2).
/// Source: Welsh and Goodwin 2003, equation (48).
struct ResonantModes {
  Eigen::VectorXd omega_rad_s;
  Eigen::VectorXd damping;
  Eigen::VectorXd gain;
};

/// G(j omega), (F,).
Eigen::VectorXcd response_at(const ResonantModes& modes, const Eigen::VectorXd& omega_rad_s);
/// In ascending modulus, conjugates side by side, positive imaginary part first.
Eigen::VectorXcd poles(const ResonantModes& modes);

/// Noise-free tones of modes that span a band.
struct ResonantProblem {
  ResonantModes modes;
  FrequencyResponse data;
  /// As many as there are poles, evenly spread over the band of the tones.
  Eigen::VectorXd break_points_rad_s;
};

/// Nine modes of damping 0.01 and gains +2, -2, +2, ... between 10^-3.7 and 10^4.7 rad/s, tones from 10^-4 to 10^5
/// rad/s. The article gives nine modes, nine decades and 36 tones; frequencies, dampings and gains are not printed.
/// These were chosen so that the condition number comes near the printed one: 3788 beside 4059.
ResonantProblem welsh_goodwin(Eigen::Index tones = 36);

/// Modes alike, one in each of `decades` decades from 1 rad/s on, two break points a decade beside each mode, four
/// tones a decade: the same at every mode, however many there are.
ResonantProblem resonant_decades(Eigen::Index decades);

/// g_k (1 + e_k), e_k independent, circular and Gaussian with E |e_k|^2 = deviation^2; its standard_deviation says so.
FrequencyResponse with_relative_noise(const FrequencyResponse& g, double deviation, std::uint64_t seed);

/// Assumptions A.2 and A.3 of theorem 1: p_k = gamma^(k-1), a tone in the middle of the pass band of each filter,
/// omega_k = sqrt(p_(k-1) p_k) with p_0 = p_1 / gamma.
struct LocalisingDesign {
  Eigen::VectorXd break_points_rad_s;
  Eigen::VectorXd omega_rad_s;
};
LocalisingDesign welsh_goodwin_theorem1(double gamma, Eigen::Index filters);

}  // namespace blockid::problems
