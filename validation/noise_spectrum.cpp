#include <blockid/validation/noise_spectrum.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/tail_probability.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr Index kShortest = 16;
constexpr Index kLongest = 1024;
constexpr Index kSegments = 8;
constexpr Index kBands = 16;
/// Lines next to the mean that Hann's window leaks it into.
constexpr Index kFirstLine = 2;
/// Squares of the correlations between lines 0, 1 and 2 apart.
constexpr std::array<double, 3> kLineCorrelation = {1.0, 4.0 / 9.0, 1.0 / 36.0};

/// Runs of scored samples.
std::vector<VectorXd> runs_of(std::span<const ResidualRecord> records) {
  std::vector<VectorXd> runs;
  for (const ResidualRecord& record : records) {
    const Index n = record.residual.size();
    if (record.weights.size() > 0 && record.weights.size() != n) {
      fail("noise spectrum: expected weights of ", n, " samples, got ", record.weights.size());
    }
    const auto scored = [&](Index t) { return record.weights.size() == 0 || record.weights[t] > 0.0; };
    for (Index begin = 0; begin < n;) {
      Index end = begin;
      while (end < n && scored(end)) ++end;
      if (end > begin) runs.emplace_back(record.residual.segment(begin, end - begin));
      begin = end + 1;
    }
  }
  return runs;
}

Index segments_in(const std::vector<VectorXd>& runs, Index segment) {
  Index count = 0;
  for (const VectorXd& run : runs) count += run.size() / segment;
  return count;
}

double mean_of(const std::vector<VectorXd>& runs) {
  double sum = 0.0;
  Index count = 0;
  for (const VectorXd& run : runs) {
    sum += run.sum();
    count += run.size();
  }
  return sum / static_cast<double>(count);
}

/// One-sided density at the lines kFirstLine .. segment / 2 - 1.
VectorXd density(const std::vector<VectorXd>& runs, Index segment, double sample_time_s) {
  const VectorXd window = VectorXd::NullaryExpr(segment, [&](Index t) {
    return 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(t) / static_cast<double>(segment));
  });
  const Index lines = segment / 2 - kFirstLine;
  const double mean = mean_of(runs);
  Eigen::FFT<double> fft;
  VectorXd power = VectorXd::Zero(lines);
  for (const VectorXd& run : runs) {
    for (Index begin = 0; begin + segment <= run.size(); begin += segment) {
      const VectorXd part = window.array() * (run.segment(begin, segment).array() - mean);
      VectorXcd spectrum(segment);
      fft.fwd(spectrum, part);
      power += spectrum.segment(kFirstLine, lines).cwiseAbs2();
    }
  }
  return 2.0 * sample_time_s / (window.squaredNorm() * static_cast<double>(segments_in(runs, segment))) * power;
}

/// 2 K (sum S)^2 / sum rho^2 S S.
double degrees_of_freedom(const VectorXd& band, Index segments) {
  double spread = 0.0;
  for (Index apart = 0; apart < std::min<Index>(3, band.size()); ++apart) {
    const Index pairs = band.size() - apart;
    spread += (apart == 0 ? 1.0 : 2.0) * kLineCorrelation[static_cast<std::size_t>(apart)] *
              band.head(pairs).dot(band.tail(pairs));
  }
  const double sum = band.sum();
  return 2.0 * static_cast<double>(segments) * sum * sum / spread;
}

void check_input(const std::vector<VectorXd>& runs, const VectorXd& noise, double sample_time_s, double significance) {
  for (const VectorXd& run : runs) {
    if (!run.allFinite()) fail("noise spectrum: expected finite residuals");
  }
  if (!noise.allFinite()) fail("noise spectrum: expected finite samples of the noise");
  if (noise.size() > 0 && noise.maxCoeff() == noise.minCoeff()) fail("noise spectrum: the noise does not vary");
  if (!(sample_time_s > 0.0)) fail("noise spectrum: expected a sample time above zero, got ", sample_time_s);
  if (!(significance > 0.0 && significance < 1.0)) {
    fail("noise spectrum: expected a significance in (0, 1), got ", significance);
  }
}

Index segment_of(const std::vector<VectorXd>& residual, const std::vector<VectorXd>& noise) {
  const auto least = [&](Index segment) {
    return std::min(segments_in(residual, segment), segments_in(noise, segment));
  };
  if (least(kShortest) < kSegments) {
    fail("noise spectrum: expected at least ", kSegments, " segments of ", kShortest,
         " samples without a gap in the residual and in the noise, got ", segments_in(residual, kShortest), " and ",
         segments_in(noise, kShortest));
  }
  Index segment = kShortest;
  while (segment < kLongest && least(2 * segment) >= kSegments) segment *= 2;
  return segment;
}

}  // namespace

NoiseSpectrumTest noise_spectrum_test(std::span<const ResidualRecord> records, const VectorXd& noise,
                                      double sample_time_s, double significance) {
  const std::vector<VectorXd> residual = runs_of(records);
  const std::vector<VectorXd> of_noise = {noise};
  check_input(residual, noise, sample_time_s, significance);
  NoiseSpectrumTest result;
  result.segment = segment_of(residual, of_noise);
  result.residual_segments = segments_in(residual, result.segment);
  result.noise_segments = segments_in(of_noise, result.segment);
  const VectorXd above = density(residual, result.segment, sample_time_s);
  const VectorXd below = density(of_noise, result.segment, sample_time_s);
  const Index bands = std::min(kBands, above.size() / 3);
  const double line_hz = 1.0 / (static_cast<double>(result.segment) * sample_time_s);
  for (VectorXd* all : {&result.frequency_hz, &result.residual_density, &result.noise_density, &result.p_values}) {
    all->resize(bands);
  }
  for (Index b = 0; b < bands; ++b) {
    const Index begin = b * above.size() / bands;
    const Index count = (b + 1) * above.size() / bands - begin;
    const VectorXd r = above.segment(begin, count);
    const VectorXd n = below.segment(begin, count);
    result.frequency_hz[b] = line_hz * (static_cast<double>(kFirstLine + begin) + 0.5 * static_cast<double>(count - 1));
    result.residual_density[b] = r.mean();
    result.noise_density[b] = n.mean();
    result.p_values[b] = f_tail(r.mean() / n.mean(), degrees_of_freedom(n, result.residual_segments),
                                degrees_of_freedom(n, result.noise_segments));
    result.statistic -= 2.0 * std::log(std::max(result.p_values[b], std::numeric_limits<double>::min()));
  }
  result.degrees_of_freedom = 2 * bands;
  const double of_sum = chi_square_tail(result.statistic, static_cast<double>(result.degrees_of_freedom));
  const double of_worst = -std::expm1(static_cast<double>(bands) * std::log1p(-result.p_values.minCoeff()));
  result.p_value = std::min(1.0, 2.0 * std::min(of_sum, of_worst));
  result.passed = result.p_value >= significance;
  return result;
}

}  // namespace blockid
