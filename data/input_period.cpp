#include <blockid/data/input_period.hpp>

#include <Eigen/Core>
#include <unsupported/Eigen/FFT>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Least sum of squared differences, in units of 2 (N - P) variances, that counts as having changed.
constexpr double kChanged = 0.5;
constexpr double kRepeats = 1e-3;

/// sum_t v_t v_{t+k}, k = 0 .. N / 2.
VectorXd autocorrelation(const VectorXd& v) {
  Index size = 1;
  while (size < 2 * v.size()) size *= 2;
  VectorXd padded = VectorXd::Zero(size);
  padded.head(v.size()) = v;
  Eigen::FFT<double> fft;
  Eigen::VectorXcd spectrum(size);
  fft.fwd(spectrum, padded);
  spectrum = spectrum.cwiseAbs2().cast<std::complex<double>>().eval();
  VectorXd result(size);
  fft.inv(result, spectrum);
  return result.head(v.size() / 2 + 1);
}

}  // namespace

Index input_period(const VectorXd& u) {
  constexpr Index kFewest = 4;
  const Index count = u.size();
  if (count < kFewest) return 0;
  const VectorXd v = u.array() - u.mean();
  const double variance = v.squaredNorm() / static_cast<double>(count);
  // A constant leaves rounding only.
  if (!(variance > 1e-24 * u.cwiseAbs2().maxCoeff())) return 0;
  const VectorXd products = autocorrelation(v);
  double first = v.squaredNorm();  // of v_0 .. v_{N-1-P}
  double last = first;             // of v_P .. v_{N-1}
  bool changed = false;
  for (Index lag = 1; lag <= count / 2; ++lag) {
    first -= v[count - lag] * v[count - lag];
    last -= v[lag - 1] * v[lag - 1];
    const double ratio = (first + last - 2.0 * products[lag]) / (2.0 * static_cast<double>(count - lag) * variance);
    if (changed && ratio <= kRepeats) return lag;
    changed = changed || ratio >= kChanged;
  }
  return 0;
}

}  // namespace blockid
