#include <blockid/validation/error_spectrum.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/tail_probability.hpp>

#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// First sample of the last whole periods, all of them scored.
Index first_of_periods(const ResidualRecord& record, Index period) {
  const Index n = record.residual.size();
  Index scored_from = 0;
  if (record.weights.size() > 0) {
    while (scored_from < n && !(record.weights[scored_from] > 0.0)) ++scored_from;
    if (!(record.weights.tail(n - scored_from).array() > 0.0).all()) {
      fail("periodic error: expected no missing samples behind the warm-up");
    }
  }
  const Index periods = (n - scored_from) / period;
  if (periods < 2) {
    fail("periodic error: expected two whole periods of ", period, " samples behind the warm-up, got ", n - scored_from,
         " samples");
  }
  return n - periods * period;
}

/// (lines, periods) DFT of each period.
MatrixXcd transforms(const VectorXd& residual, Index begin, Index period) {
  const Index periods = (residual.size() - begin) / period;
  const Index lines = (period - 1) / 2;
  Eigen::FFT<double> fft;
  MatrixXcd result(lines, periods);
  for (Index p = 0; p < periods; ++p) {
    const VectorXd part = residual.segment(begin + p * period, period);
    VectorXcd spectrum(period);
    fft.fwd(spectrum, part);
    result.col(p) = spectrum.segment(1, lines);
  }
  return result;
}

/// Adds one record; the densities are summed with its periods as weight.
void add(PeriodicError& sum, const MatrixXcd& spectra) {
  const double periods = static_cast<double>(spectra.cols());
  const double nu = periods - 1.0;
  const VectorXcd mean = spectra.rowwise().mean();
  const VectorXd variance = (spectra.colwise() - mean).cwiseAbs2().rowwise().sum() / nu;
  for (Index k = 0; k < mean.size(); ++k) {
    const double power = std::norm(mean[k]);
    sum.noise_density[k] += periods * variance[k];
    sum.error_density[k] += periods * power - variance[k];
    if (!(power > 0.0)) continue;
    sum.statistic += 2.0 * nu * std::log1p(power * periods / (nu * variance[k]));
    sum.degrees_of_freedom += 2;
  }
  sum.periods += spectra.cols();
}

}  // namespace

PeriodicError periodic_error(std::span<const ResidualRecord> records, Index period, double sample_time_s,
                             double significance) {
  if (records.empty()) fail("periodic error: expected at least one record");
  if (period < 3) fail("periodic error: expected a period of 3 samples or more, got ", period);
  if (!(sample_time_s > 0.0)) fail("periodic error: expected a sample time above zero, got ", sample_time_s);
  const Index lines = (period - 1) / 2;
  const double length_s = static_cast<double>(period) * sample_time_s;
  PeriodicError result;
  result.frequency_hz = VectorXd::LinSpaced(lines, 1.0, static_cast<double>(lines)) / length_s;
  result.error_density = VectorXd::Zero(lines);
  result.noise_density = VectorXd::Zero(lines);
  for (const ResidualRecord& record : records) {
    if (record.weights.size() > 0 && record.weights.size() != record.residual.size()) {
      fail("periodic error: expected weights of ", record.residual.size(), " samples, got ", record.weights.size());
    }
    const Index begin = first_of_periods(record, period);
    if (!record.residual.tail(record.residual.size() - begin).allFinite()) {
      fail("periodic error: expected finite residuals");
    }
    add(result, transforms(record.residual, begin, period));
  }
  // |DFT|^2 / M is the power of a line pair over fs / 2: one-sided density 2 Ts |DFT|^2 / M.
  const double scale = 2.0 * sample_time_s / (static_cast<double>(period) * static_cast<double>(result.periods));
  result.error_density *= scale;
  result.noise_density *= scale;
  if (result.degrees_of_freedom > 0) {
    result.p_value = chi_square_tail(result.statistic, static_cast<double>(result.degrees_of_freedom));
  }
  result.passed = result.p_value >= significance;
  return result;
}

NoiseLevelTest noise_level_test(const ResidualTests& tests, double noise_deviation) {
  if (!(noise_deviation > 0.0)) {
    fail("noise level: expected a standard deviation above zero, got ", noise_deviation);
  }
  NoiseLevelTest result;
  result.ratio = tests.deviation / noise_deviation;
  result.samples = effective_samples(tests.noise, tests.samples - tests.rank);
  result.p_value = chi_square_tail(result.samples * result.ratio * result.ratio, result.samples);
  result.passed = result.p_value >= tests.significance;
  return result;
}

}  // namespace blockid
