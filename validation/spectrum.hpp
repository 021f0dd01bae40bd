// Power spectral densities by averaged periodograms.
#pragma once

#include <Eigen/Core>

namespace blockid {

/// One-sided power spectral density S_k at f_k, in unit^2 / Hz: sum_k S_k df = mean square.
struct Spectrum {
  Eigen::VectorXd frequency_hz;  ///< (segment / 2 + 1,)
  Eigen::VectorXd density;       ///< (segment / 2 + 1,)
};

/// Mean of the periodograms of Hann-windowed segments that overlap by half, the mean of the signal removed.
/// segment: even, clipped to the length of the signal. Source: Welch 1967.
Spectrum welch(const Eigen::VectorXd& x, double sample_time_s, Eigen::Index segment);

/// Spectral densities of input and output together, from the same segments.
struct CrossSpectrum {
  Eigen::VectorXd frequency_hz;    ///< (segment / 2 + 1,)
  Eigen::VectorXd input_density;   ///< (segment / 2 + 1,) S_uu
  Eigen::VectorXd output_density;  ///< (segment / 2 + 1,) S_yy
  Eigen::VectorXcd cross_density;  ///< (segment / 2 + 1,) S_yu; S_yu / S_uu estimates the frequency response
};

/// As welch(); u, y: (N,) and finite.
CrossSpectrum welch_cross(const Eigen::VectorXd& u, const Eigen::VectorXd& y, double sample_time_s,
                          Eigen::Index segment);

/// A power of two with at least eight segments in `samples`, 64 .. 4096.
Eigen::Index segment_length(Eigen::Index samples);

}  // namespace blockid
