#include <blockid/estimators/excitation.hpp>

#include <blockid/data/error.hpp>

#include <Eigen/Core>
#include <unsupported/Eigen/FFT>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace blockid {
namespace {

using Eigen::VectorXd;

constexpr double kLeastPower = 1e-6;
constexpr double kLeastMean = 1e-3;
/// Lines that a sinusoid fills down to that power.
constexpr double kLobe = 7.2;
constexpr Index kFewest = 16;

/// Frequencies that cannot be told apart from one another, rad/s, and how many they can be.
struct Cluster {
  double low = 0.0;
  double high = 0.0;
  Index frequencies = 1;
};

VectorXd blackman_harris(Index count) {
  constexpr std::array<double, 4> kTerms = {0.35875, -0.48829, 0.14128, -0.01168};
  VectorXd window(count);
  for (Index t = 0; t < count; ++t) {
    const double phase = 2.0 * std::numbers::pi * (static_cast<double>(t) + 0.5) / static_cast<double>(count);
    window[t] = 0.0;
    for (std::size_t k = 0; k < kTerms.size(); ++k) window[t] += kTerms[k] * std::cos(static_cast<double>(k) * phase);
  }
  return window;
}

/// Turns that are not whole leave nothing in it.
double windowed_mean(const VectorXd& u) {
  const VectorXd window = blackman_harris(u.size());
  return window.dot(u) / window.sum();
}

/// Lines 0 .. size / 2 of the windowed input, its mean removed.
VectorXd powers_of_windowed_lines(const VectorXd& u, Index size) {
  VectorXd padded = VectorXd::Zero(size);
  padded.head(u.size()) = blackman_harris(u.size()).array() * (u.array() - windowed_mean(u));
  Eigen::VectorXcd spectrum(size);
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, padded);
  return spectrum.head(size / 2 + 1).cwiseAbs2();
}

std::vector<Cluster> clusters_of(const Record& record) {
  const Index size = static_cast<Index>(std::bit_ceil(static_cast<std::size_t>(record.u.size())));
  const VectorXd power = powers_of_windowed_lines(record.u, size);
  const double least = kLeastPower * power.maxCoeff();
  const double spacing = 2.0 * std::numbers::pi / (static_cast<double>(size) * record.sample_time_s);
  const double part = static_cast<double>(record.u.size()) / static_cast<double>(size);
  std::vector<Cluster> result;
  for (Index begin = 0; begin < power.size(); ++begin) {
    if (!(power[begin] > least)) continue;
    Index end = begin;
    while (end < power.size() && power[end] > least) ++end;
    const double lines = part * static_cast<double>(end - begin);
    result.push_back({spacing * static_cast<double>(begin), spacing * static_cast<double>(end),
                      1 + static_cast<Index>(std::max(0.0, std::floor(lines - kLobe)))});
    begin = end;
  }
  return result;
}

/// Clusters that overlap are one.
Index frequencies_of(std::vector<Cluster> clusters) {
  std::sort(clusters.begin(), clusters.end(), [](const Cluster& a, const Cluster& b) { return a.low < b.low; });
  std::vector<Cluster> merged;
  for (const Cluster& one : clusters) {
    if (merged.empty() || one.low >= merged.back().high) {
      merged.push_back(one);
      continue;
    }
    merged.back().high = std::max(merged.back().high, one.high);
    merged.back().frequencies = std::max(merged.back().frequencies, one.frequencies);
  }
  Index count = 0;
  for (const Cluster& one : merged) count += one.frequencies;
  return count;
}

}  // namespace

Excitation excitation(const DataSet& data) {
  Excitation result;
  std::vector<Cluster> clusters;
  for (const Record& record : data.records) {
    const double rms = std::sqrt(record.u.squaredNorm() / static_cast<double>(record.u.size()));
    result.mean = result.mean || (rms > 0.0 && std::abs(windowed_mean(record.u)) > kLeastMean * rms);
    if (record.u.size() < kFewest) {
      result.frequencies = std::max(result.frequencies, record.u.size() / 2);
      continue;
    }
    if (!((record.u.array() - record.u.mean()).abs().maxCoeff() > 0.0)) continue;
    const std::vector<Cluster> more = clusters_of(record);
    clusters.insert(clusters.end(), more.begin(), more.end());
  }
  result.frequencies = std::max(result.frequencies, frequencies_of(std::move(clusters)));
  return result;
}

std::string text_of_lack(const Excitation& excitation, Index coefficients) {
  if (excitation.equations() >= coefficients) return {};
  return compose("the input excites ", excitation.frequencies,
                 excitation.frequencies == 1 ? " frequency" : " frequencies", excitation.mean ? " and a mean" : "",
                 ": ", excitation.equations(), " equations for ", coefficients,
                 " coefficients; many models fit these data alike, take lower orders or an input with ",
                 (coefficients + 1) / 2, " frequencies or more");
}

}  // namespace blockid
