#include <blockid/data/error.hpp>
#include <blockid/init/nonparametric_bla.hpp>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <unsupported/Eigen/FFT>
#include <utility>

namespace blockid {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Coefficients of a polynomial of second degree.
constexpr Index kCoefficients = 3;

void check_complete(const Record& record) {
  const Index present = present_count(record);
  if (present != sample_count(record)) {
    fail(describe(record), ": ", sample_count(record) - present,
         " output samples are missing; a frequency response without a model needs all of them");
  }
}

/// (samples,) sum_t x_t e^{-j 2 pi k t / samples}.
VectorXcd transform(const VectorXd& x) {
  Eigen::FFT<double> fft;
  VectorXcd spectrum;
  fft.fwd(spectrum, x);
  return spectrum;
}

/// Mean square of a real signal at line k > 0, both halves of the spectrum together.
double line_power(std::complex<double> value, Index samples) {
  const double n = static_cast<double>(samples);
  return 2.0 * std::norm(value) / (n * n);
}

VectorXd frequencies(const std::vector<Index>& lines, Index samples, double sample_time_s) {
  VectorXd omega(std::ssize(lines));
  const double step = 2.0 * std::numbers::pi / (static_cast<double>(samples) * sample_time_s);
  for (Index k = 0; k < omega.size(); ++k) omega[k] = step * static_cast<double>(lines[static_cast<std::size_t>(k)]);
  return omega;
}

/// Spectra of the periods of one realisation.
struct Periods {
  MatrixXcd u;  ///< (lines 0 .. period - 1, P)
  MatrixXcd y;
};

Index whole_periods(const Record& record, Index transient) { return sample_count(record) / record.period - transient; }

/// The last `count` whole periods of the record.
Periods spectra(const Record& record, Index transient, Index count) {
  const Index n = record.period;
  const Index first = transient + whole_periods(record, transient) - count;
  Periods result{MatrixXcd(n, count), MatrixXcd(n, count)};
  for (Index p = 0; p < count; ++p) {
    result.u.col(p) = transform(record.u.segment((first + p) * n, n));
    result.y.col(p) = transform(record.y.segment((first + p) * n, n));
  }
  return result;
}

/// Whole periods that every record has; checks what periodic_bla promises to.
Index common_periods(const DataSet& data, Index transient) {
  check(data);
  if (transient < 0) fail("periodic data: expected transient periods >= 0, got ", transient);
  const Index period = data.records.front().period;
  Index count = std::numeric_limits<Index>::max();
  for (const Record& record : data.records) {
    if (record.period < 1) {
      fail(describe(record), ": no period; expected the samples in one period of the input");
    }
    if (record.period != period) {
      fail(describe(record), ": period of ", record.period, " samples, the first record's is ", period);
    }
    check_complete(record);
    if (whole_periods(record, transient) < 1) {
      fail(describe(record), ": ", sample_count(record), " samples are ", sample_count(record) / period,
           " whole periods of ", period, "; expected more than the ", transient, " of the transient");
    }
    count = std::min(count, whole_periods(record, transient));
  }
  if (count < 2 && data.records.size() < 2) {
    fail(describe(data.records.front()), ": one period of ", period,
         " samples behind the transient of one realisation; expected two periods for the noise variance or two "
         "realisations for the total variance");
  }
  return count;
}

/// (line count,) smallest over the realisations of |U_k| / max |U|, U averaged over periods.
VectorXd excitation(const std::vector<Periods>& realisations, Index line_count) {
  VectorXd least = VectorXd::Constant(line_count + 1, std::numeric_limits<double>::infinity());
  for (const Periods& periods : realisations) {
    VectorXd amplitude = periods.u.topRows(line_count + 1).rowwise().mean().cwiseAbs();
    amplitude[0] = 0.0;
    const double largest = amplitude.maxCoeff();
    if (!(largest > 0.0)) fail("periodic data: the input of a realisation is constant");
    least = least.cwiseMin(amplitude / largest);
  }
  return least;
}

std::vector<Index> excited_lines(const VectorXd& amplitude, const PeriodicBlaOptions& options) {
  std::vector<Index> lines = options.lines;
  if (lines.empty()) {
    for (Index k = 1; k < amplitude.size(); ++k) {
      if (amplitude[k] >= options.excited) lines.push_back(k);
    }
    if (lines.empty()) fail("periodic data: no line is excited in every realisation");
    return lines;
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i] < 1 || lines[i] >= amplitude.size() || (i > 0 && lines[i] <= lines[i - 1])) {
      fail("periodic data: line ", lines[i], "; expected increasing lines in 1 .. ", amplitude.size() - 1);
    }
    if (!(amplitude[lines[i]] >= options.excited)) {
      fail("periodic data: line ", lines[i], " is not excited: its amplitude is ", amplitude[lines[i]],
           " of the largest in one of the realisations, expected at least ", options.excited);
    }
  }
  return lines;
}

/// sum |x_i - mean x|^2 / (n - 1).
double variance(const VectorXcd& x) { return (x.array() - x.mean()).abs2().sum() / static_cast<double>(x.size() - 1); }

void set_line(NonparametricBla& result, Index k, Index line, const std::vector<Periods>& realisations, Index period) {
  const Index count = std::ssize(realisations);
  const double m = static_cast<double>(count);
  VectorXcd g(count);
  double noise = 0.0;
  for (Index i = 0; i < count; ++i) {
    const Periods& periods = realisations[static_cast<std::size_t>(i)];
    const VectorXcd ratio = periods.y.row(line).cwiseQuotient(periods.u.row(line)).transpose();
    g[i] = ratio.mean();
    if (result.periods > 1) noise += variance(ratio) / (m * m * static_cast<double>(result.periods));
    result.input_power[k] += line_power(periods.u.row(line).mean(), period) / m;
  }
  result.response.response[k] = g.mean();
  if (result.periods > 1) result.noise_variance[k] = noise;
  if (count > 1) result.total_variance[k] = variance(g) / m;
}

/// What follows from the variances.
void finish(NonparametricBla& result) {
  const double m = static_cast<double>(result.realisations);
  const double p = static_cast<double>(result.periods);
  const bool noise = result.noise_variance.size() > 0;
  const bool total = result.total_variance.size() > 0;
  result.response.standard_deviation = (total ? result.total_variance : result.noise_variance).cwiseSqrt();
  if (noise && total) result.distortion_variance = m * (result.total_variance - result.noise_variance);
  if (!total) return;
  // In one period of one realisation: distortion and the noise of one period.
  VectorXd rest = m * result.total_variance;
  if (noise) rest += m * (p - 1.0) * result.noise_variance;
  result.rest_power = result.input_power.cwiseProduct(rest);
}

/// The largest length up to `samples` without prime factors above 5, for the sake of the transform.
Index smooth_length(Index samples) {
  const auto smooth = [](Index n) {
    for (const Index factor : {2, 3, 5}) {
      while (n % factor == 0) n /= factor;
    }
    return n == 1;
  };
  while (samples > 1 && !smooth(samples)) --samples;
  return samples;
}

/// Spectra of all records, cut to one length, means removed.
struct Spectra {
  Index samples = 0;
  std::vector<VectorXcd> u;
  std::vector<VectorXcd> y;
};

Spectra record_spectra(const DataSet& data) {
  Spectra result;
  result.samples = std::numeric_limits<Index>::max();
  for (const Record& record : data.records) {
    check_complete(record);
    result.samples = std::min(result.samples, sample_count(record));
  }
  result.samples = smooth_length(result.samples);
  for (const Record& record : data.records) {
    const VectorXd u = record.u.tail(result.samples);
    const VectorXd y = record.y.tail(result.samples);
    result.u.push_back(transform(u.array() - u.mean()));
    result.y.push_back(transform(y.array() - y.mean()));
  }
  return result;
}

/// Half window n: the smallest with the degrees of freedom wanted.
Index half_window(Index records, Index degrees_of_freedom) {
  Index n = 2;
  while (records * (2 * n + 1) - kCoefficients * (records + 1) < degrees_of_freedom) ++n;
  return n;
}

/// Least squares over one window.
struct LocalFit {
  std::complex<double> response;
  double response_variance = 0.0;
  double rest_variance = 0.0;
};

LocalFit fit_window(const Spectra& spectra, Index centre, Index n) {
  const Index records = std::ssize(spectra.u);
  const Index width = 2 * n + 1;
  const Index columns = kCoefficients * (records + 1);
  MatrixXcd regressors = MatrixXcd::Zero(records * width, columns);
  VectorXcd y(records * width);
  for (Index m = 0; m < records; ++m) {
    for (Index r = -n; r <= n; ++r) {
      const Index row = m * width + n + r;
      const std::complex<double> u = spectra.u[static_cast<std::size_t>(m)][centre + r];
      y[row] = spectra.y[static_cast<std::size_t>(m)][centre + r];
      double power = 1.0;
      for (Index s = 0; s < kCoefficients; ++s) {
        regressors(row, kCoefficients * m + s) = power;
        // g_0 is the last unknown, so that its variance is in the corner of the triangle.
        regressors(row, columns - 1 - s) = power * u;
        power *= static_cast<double>(r) / static_cast<double>(n);
      }
    }
  }
  const Eigen::HouseholderQR<MatrixXcd> qr(regressors);
  const VectorXcd z = qr.householderQ().adjoint() * y;
  const std::complex<double> corner = qr.matrixQR()(columns - 1, columns - 1);
  LocalFit fit;
  fit.response = z[columns - 1] / corner;
  fit.rest_variance = z.tail(y.size() - columns).squaredNorm() / static_cast<double>(y.size() - columns);
  fit.response_variance = fit.rest_variance / std::norm(corner);
  return fit;
}

/// Mean over records and the window of |U|^2.
double window_power(const Spectra& spectra, Index centre, Index n) {
  double sum = 0.0;
  for (const VectorXcd& u : spectra.u) sum += u.segment(centre - n, 2 * n + 1).squaredNorm();
  return sum / static_cast<double>(std::ssize(spectra.u) * (2 * n + 1));
}

std::vector<Index> window_centres(const Spectra& spectra, Index n, Index spacing, double excited) {
  const Index last = (spectra.samples - 1) / 2;
  std::vector<Index> all;
  double largest = 0.0;
  for (Index k = 1 + n; k + n <= last; k += spacing) {
    all.push_back(k);
    largest = std::max(largest, window_power(spectra, k, n));
  }
  if (all.empty()) {
    fail("local polynomial method: ", spectra.samples, " samples have ", last, " lines above 0; expected at least the ",
         2 * n + 1, " of one window");
  }
  if (!(largest > 0.0)) fail("local polynomial method: the input is constant");
  std::erase_if(all, [&](Index k) { return window_power(spectra, k, n) < excited * excited * largest; });
  return all;
}

}  // namespace

NonparametricBla periodic_bla(const DataSet& data, const PeriodicBlaOptions& options) {
  NonparametricBla result;
  result.periods = common_periods(data, options.transient_periods);
  result.realisations = std::ssize(data.records);
  std::vector<Periods> realisations;
  for (const Record& record : data.records) {
    realisations.push_back(spectra(record, options.transient_periods, result.periods));
  }
  const Index period = data.records.front().period;
  const std::vector<Index> lines = excited_lines(excitation(realisations, (period - 1) / 2), options);
  const Index count = std::ssize(lines);
  result.response.sample_time_s = data.records.front().sample_time_s;
  result.response.omega_rad_s = frequencies(lines, period, result.response.sample_time_s);
  result.response.response.resize(count);
  result.input_power = VectorXd::Zero(count);
  if (result.periods > 1) {
    result.noise_variance.resize(count);
    result.noise_dof = result.realisations * (result.periods - 1);
  }
  if (result.realisations > 1) {
    result.total_variance.resize(count);
    result.total_dof = result.realisations - 1;
  }
  for (Index k = 0; k < count; ++k) {
    set_line(result, k, lines[static_cast<std::size_t>(k)], realisations, period);
  }
  finish(result);
  return result;
}

NonparametricBla local_polynomial_bla(const DataSet& data, const LocalPolynomialOptions& options) {
  check(data);
  check_excitation(data);
  if (options.degrees_of_freedom < 1 || options.spacing < 0) {
    fail("local polynomial method: expected degrees of freedom >= 1 and spacing >= 0, got ", options.degrees_of_freedom,
         " and ", options.spacing);
  }
  const Spectra spectra = record_spectra(data);
  NonparametricBla result;
  result.realisations = std::ssize(data.records);
  const Index n = half_window(result.realisations, options.degrees_of_freedom);
  const Index width = 2 * n + 1;
  const Index spacing = options.spacing > 0 ? options.spacing : width;
  const std::vector<Index> centres = window_centres(spectra, n, spacing, options.excited);
  const Index count = std::ssize(centres);
  result.total_dof = result.realisations * width - kCoefficients * (result.realisations + 1);
  result.independent_step = (width + spacing - 1) / spacing;
  result.response.sample_time_s = data.records.front().sample_time_s;
  result.response.omega_rad_s = frequencies(centres, spectra.samples, result.response.sample_time_s);
  result.response.response.resize(count);
  result.input_power.resize(count);
  result.total_variance.resize(count);
  result.rest_power.resize(count);
  const double band = static_cast<double>(spacing);
  for (Index k = 0; k < count; ++k) {
    const Index centre = centres[static_cast<std::size_t>(k)];
    const LocalFit fit = fit_window(spectra, centre, n);
    result.response.response[k] = fit.response;
    result.total_variance[k] = fit.response_variance;
    result.input_power[k] = band * line_power(std::sqrt(window_power(spectra, centre, n)), spectra.samples);
    result.rest_power[k] = band * line_power(std::sqrt(fit.rest_variance), spectra.samples);
  }
  result.response.standard_deviation = result.total_variance.cwiseSqrt();
  return result;
}

}  // namespace blockid
