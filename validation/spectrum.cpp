#include <blockid/validation/spectrum.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// One-sided spectra of Hann-windowed segments that overlap by half.
class Segments {
 public:
  Segments(Index samples, Index segment)
      : hop_(std::max<Index>(1, std::min(segment, samples) / 2)),
        length_(2 * hop_),
        samples_(samples),
        window_(length_) {
    for (Index t = 0; t < length_; ++t) {
      const double turn = static_cast<double>(t) / static_cast<double>(length_);
      window_[t] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * turn);
    }
  }

  Index bins() const { return hop_ + 1; }
  Index count() const { return samples_ < length_ ? 0 : (samples_ - length_) / std::max<Index>(1, hop_) + 1; }

  /// (bins,) transform of segment k of x - mean.
  VectorXcd transform(const VectorXd& x, double mean, Index k) {
    std::vector<double> part(static_cast<std::size_t>(length_));
    for (Index t = 0; t < length_; ++t) {
      part[static_cast<std::size_t>(t)] = window_[t] * (x[k * hop_ + t] - mean);
    }
    std::vector<std::complex<double>> transformed;
    fft_.fwd(transformed, part);
    return Eigen::Map<const VectorXcd>(transformed.data(), bins());
  }

  VectorXd frequencies_hz(double sample_time_s) const {
    return VectorXd::LinSpaced(bins(), 0.0, static_cast<double>(bins() - 1)) /
           (static_cast<double>(length_) * sample_time_s);
  }

  /// (bins,) what turns a sum over segments into a one-sided density.
  VectorXd scale(double sample_time_s) const {
    const double segments = static_cast<double>(std::max<Index>(count(), 1));
    VectorXd result = VectorXd::Constant(bins(), sample_time_s / (window_.squaredNorm() * segments));
    result.segment(1, bins() - 2) *= 2.0;
    return result;
  }

 private:
  Index hop_;
  Index length_;
  Index samples_;
  VectorXd window_;
  Eigen::FFT<double> fft_;
};

}  // namespace

Index segment_length(Index samples) {
  constexpr Index kShortest = 64;
  constexpr Index kLongest = 4096;
  constexpr Index kSegments = 8;
  Index length = kShortest;
  while (length < kLongest && 2 * length * kSegments <= samples) length *= 2;
  return length;
}

Spectrum welch(const VectorXd& x, double sample_time_s, Index segment) {
  Segments segments(x.size(), segment);
  const double mean = x.size() > 0 ? x.mean() : 0.0;
  VectorXd power = VectorXd::Zero(segments.bins());
  for (Index k = 0; k < segments.count(); ++k) power += segments.transform(x, mean, k).cwiseAbs2();
  return {segments.frequencies_hz(sample_time_s), power.cwiseProduct(segments.scale(sample_time_s))};
}

CrossSpectrum welch_cross(const VectorXd& u, const VectorXd& y, double sample_time_s, Index segment) {
  Segments segments(u.size(), segment);
  VectorXd input = VectorXd::Zero(segments.bins());
  VectorXd output = VectorXd::Zero(segments.bins());
  VectorXcd cross = VectorXcd::Zero(segments.bins());
  for (Index k = 0; k < segments.count(); ++k) {
    const VectorXcd of_u = segments.transform(u, u.mean(), k);
    const VectorXcd of_y = segments.transform(y, y.mean(), k);
    input += of_u.cwiseAbs2();
    output += of_y.cwiseAbs2();
    cross += of_y.cwiseProduct(of_u.conjugate());
  }
  const VectorXd scale = segments.scale(sample_time_s);
  return {segments.frequencies_hz(sample_time_s), input.cwiseProduct(scale), output.cwiseProduct(scale),
          cross.cwiseProduct(scale)};
}

}  // namespace blockid
