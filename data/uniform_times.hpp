// The sample time that a column of time stamps stands for.
#pragma once

#include <Eigen/Core>

#include <string_view>

namespace blockid {

/// Part of the median interval by which an interval may differ from it. Stamps that are off by half of it change a
/// sinusoid at a tenth of the sampling frequency by 0.3 %; a lost sample makes an interval twice as long.
inline constexpr double kSampleTimeJitter = 0.01;

/// Part of the median interval up to which rounding of the stamps is put up with.
inline constexpr double kCoarsestStamp = 0.25;

/// Part by which a sample time from stamps and one that is given may differ: clocks are good to better than 100 ppm.
inline constexpr double kClockTolerance = 1e-4;

/// What stamps t_0 .. t_{N-1} say.
struct SampleTimes {
  double sample_time_s = 0.0;  ///< T = (t_{N-1} - t_0) / (N - 1)
  double resolution_s = 0.0;   ///< q: to what the stamps are rounded, 0 when that is less than T / 1000
};

/// The sample time of stamps t (N,) in seconds, N >= 2, that are uniform but for jitter and rounding:
///
///     |t_{k+m} - t_k - m T| <= 0.01 m T + min(q, T / 4),   m = 1, 10, 100, ...,
///
/// with the median interval for T at m = 1 and the mean interval beyond, where slow changes of the rate show that
/// rounding hides in single intervals. q is the largest power of ten of which all stamps are multiples, or the
/// spacing of single-precision numbers where all stamps are such.
/// @param name of the column or variable, for messages
/// @throws Error for fewer than two stamps, one that is not finite, stamps that do not increase, and intervals that are
///   not uniform; the message has the zero-based sample, the interval expected and the one found.
[[nodiscard]] SampleTimes uniform_times(const Eigen::Ref<const Eigen::VectorXd>& times_s, std::string_view name);

/// Verifies that N stamps with these times and a given sample time T0 agree: |T - T0| <= 1e-4 T0 + min(q, T / 4) / (N -
/// 1).
/// @throws Error with both sample times.
void check_sample_time(const SampleTimes& times, Eigen::Index count, double given_s, std::string_view name);

}  // namespace blockid
