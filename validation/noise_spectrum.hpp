// The spectrum of a residual beside that of the noise, from a record of noise alone.
#pragma once

#include <blockid/validation/residual_tests.hpp>

#include <Eigen/Core>
#include <span>

namespace blockid {

/// Means over the lines of B bands of equal width, from the periodograms of Hann-windowed segments that do not overlap.
struct NoiseSpectrumTest {
  Eigen::VectorXd frequency_hz;      ///< (B,) middle of the band
  Eigen::VectorXd residual_density;  ///< (B,) one-sided, in unit^2 / Hz
  Eigen::VectorXd noise_density;     ///< (B,)
  Eigen::VectorXd p_values;          ///< (B,) of a residual so much larger by chance
  Eigen::Index segment = 0;          ///< samples of a segment
  Eigen::Index residual_segments = 0;
  Eigen::Index noise_segments = 0;
  double statistic = 0.0;  ///< -2 sum_b ln p_b
  Eigen::Index degrees_of_freedom = 0;
  double p_value = 1.0;  ///< of the sum and of the worst band
  bool passed = true;
};

/// In each band the ratio of the densities is F(nu_r, nu_n) when the residual is noise of that spectrum, normal and
/// independent of the record; nu = 2 K (sum_k S_k)^2 / sum_kl rho_{k-l}^2 S_k S_l for K segments, lines k and l of the
/// band, the noise's densities S and rho = 1, 2/3, 1/6, 0, ... of Hann's window. p_b is the tail of a residual above
/// the noise. Fisher's sum of all sees an excess everywhere, the smallest of them, 1 - (1 - p)^B, one in a band;
/// p_value is twice the smaller of the two. What the parameters have fitted is missing in the residual, so that the
/// test errs on the safe side for the records of the fit; on others, errors of the parameters count as the model's.
///
/// The segment is the largest power of two, 16 .. 1024 samples, of which residual and noise have 8 or more; segments
/// lie within runs of scored samples. The mean and the lines next to it are left out. noise (M,): the output while the
/// input rests. Throws Error for records whose sizes do not agree, samples that are not finite, noise that does not
/// vary, a sample time or a significance out of range, and fewer than 8 segments of 16 samples in residual or noise.
NoiseSpectrumTest noise_spectrum_test(std::span<const ResidualRecord> records, const Eigen::VectorXd& noise,
                                      double sample_time_s, double significance = 0.01);

}  // namespace blockid
