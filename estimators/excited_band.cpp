#include <blockid/estimators/excited_band.hpp>

#include <Eigen/Core>
#include <unsupported/Eigen/FFT>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace blockid {
namespace {

/// Of the power of the input at either end.
constexpr double kLeftOut = 0.01;
/// Least ratio of the ends.
constexpr double kLeastRatio = 4.0;

const Record& longest(const DataSet& data) {
  return *std::max_element(data.records.begin(), data.records.end(),
                           [](const Record& a, const Record& b) { return a.u.size() < b.u.size(); });
}

/// Lines 1 .. size / 2 of the spectrum of u, padded with zeros to `size`.
Eigen::VectorXd powers_of_lines(const Eigen::VectorXd& u, Eigen::Index size) {
  Eigen::VectorXd padded = Eigen::VectorXd::Zero(size);
  padded.head(u.size()) = u.array() - u.mean();
  Eigen::VectorXcd spectrum(size);
  Eigen::FFT<double> fft;
  fft.fwd(spectrum, padded);
  return spectrum.segment(1, size / 2).cwiseAbs2();
}

}  // namespace

FrequencyRange sampled_band(const DataSet& data) {
  const Record& record = longest(data);
  const double nyquist = std::numbers::pi / record.sample_time_s;
  return {2.0 * nyquist / static_cast<double>(record.u.size()), nyquist};
}

FrequencyRange excited_band(const DataSet& data) {
  const Record& record = longest(data);
  const FrequencyRange all = sampled_band(data);
  const Eigen::Index size = static_cast<Eigen::Index>(std::bit_ceil(static_cast<std::size_t>(record.u.size())));
  const Eigen::VectorXd power = powers_of_lines(record.u, size);
  const double total = power.sum();
  if (!(total > 0.0)) return all;
  FrequencyRange band = all;
  double sum = 0.0;
  for (Eigen::Index k = 0; k < power.size(); ++k) {
    const double omega = all.high * static_cast<double>(k + 1) / static_cast<double>(power.size());
    if (sum < kLeftOut * total) band.low = std::max(omega, all.low);
    if (sum < (1.0 - kLeftOut) * total) band.high = omega;
    sum += power[k];
  }
  const double middle = std::sqrt(band.low * band.high);
  band.low = std::max(all.low, std::min(band.low, middle / std::sqrt(kLeastRatio)));
  band.high = std::min(all.high, std::max(band.high, middle * std::sqrt(kLeastRatio)));
  return band;
}

}  // namespace blockid
