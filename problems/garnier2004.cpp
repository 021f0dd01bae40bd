#include <blockid/problems/garnier2004.hpp>

#include <blockid/data/error.hpp>
#include <blockid/problems/gaussian.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace blockid::problems {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr double kFirstTone = 2.0;
constexpr double kLastTone = 6000.0;
constexpr Eigen::Index kTones = 25;
constexpr Eigen::Index kModes = 4;

/// count numbers from low to high with equal ratios.
VectorXd logarithmic(double low, double high, Eigen::Index count) {
  return VectorXd::LinSpaced(count, std::log10(low), std::log10(high)).unaryExpr([](double x) {
    return std::pow(10.0, x);
  });
}

/// Pole of mode k with positive imaginary part.
Complex pole(Eigen::Index k) {
  const double zeta = Garnier2004::damping()[k];
  return Garnier2004::omega_rad_s()[k] * Complex(-zeta, std::sqrt(1.0 - zeta * zeta));
}

/// Residue of G at pole(k): b omega^2 (lambda + omega_0) / (alpha (lambda - conj lambda)).
Complex residue(Eigen::Index k) {
  const Complex lambda = pole(k);
  const double scale = Garnier2004::gain()[k] * std::pow(Garnier2004::omega_rad_s()[k], 2) / Garnier2004::kAlpha;
  return scale * (lambda + Garnier2004::kOmega0) / Complex(0.0, 2.0 * lambda.imag());
}

/// Laplace transform of the input that begins at t = 0.
Complex transform(const Multisine& input, Complex s) {
  Complex sum = 0.0;
  for (Eigen::Index i = 0; i < input.omega_rad_s.size(); ++i) {
    const double omega = input.omega_rad_s[i];
    sum += input.amplitude[i] * (s * std::cos(input.phase[i]) - omega * std::sin(input.phase[i])) /
           (s * s + omega * omega);
  }
  return sum;
}

/// target_t += Re(amplitude e^{s t h}): by products, set anew before their rounding adds up.
void add_exponential(Complex amplitude, Complex s, double h, VectorXd& target) {
  constexpr Eigen::Index kAnew = 64;
  const Complex ratio = std::exp(s * h);
  Complex value;
  for (Eigen::Index t = 0; t < target.size(); ++t) {
    value = t % kAnew == 0 ? amplitude * std::exp(s * (static_cast<double>(t) * h)) : value * ratio;
    target[t] += value.real();
  }
}

void check(const Garnier2004Experiment& experiment) {
  const Multisine& input = experiment.input;
  if (input.amplitude.size() != input.omega_rad_s.size() || input.phase.size() != input.omega_rad_s.size()) {
    fail("multisine: expected an amplitude and a phase for each of ", input.omega_rad_s.size(), " tones, got ",
         input.amplitude.size(), " and ", input.phase.size());
  }
  if (!(experiment.oversampling > 2.0)) {
    fail("garnier2004: expected more than two samples per period of the last tone, got ", experiment.oversampling);
  }
  if (!(experiment.length_s > 0.0) || !std::isfinite(experiment.length_s)) {
    fail("garnier2004: expected a positive length in seconds, got ", experiment.length_s);
  }
  if (std::isnan(experiment.snr_db))
    fail("garnier2004: expected a signal-to-noise ratio in dB, got ", experiment.snr_db);
}

}  // namespace

Eigen::Vector4d Garnier2004::omega_rad_s() { return {4.0, 40.0, 400.0, 4000.0}; }
Eigen::Vector4d Garnier2004::damping() { return {0.008, 0.0008, 0.0008, 0.0008}; }
Eigen::Vector4d Garnier2004::gain() { return {1.0, 3.0, 1.0, 1.0}; }

VectorXcd garnier2004_response(const VectorXd& omega_rad_s) {
  VectorXcd g = VectorXcd::Zero(omega_rad_s.size());
  for (Eigen::Index k = 0; k < kModes; ++k) {
    for (Eigen::Index i = 0; i < g.size(); ++i) {
      const Complex s(0.0, omega_rad_s[i]);
      const double ratio = omega_rad_s[i] / Garnier2004::omega_rad_s()[k];
      // (1 - ratio)(1 + ratio) keeps its digits beside the resonance.
      const Complex denominator((1.0 - ratio) * (1.0 + ratio), 2.0 * Garnier2004::damping()[k] * ratio);
      g[i] += Garnier2004::gain()[k] * (s + Garnier2004::kOmega0) / (Garnier2004::kAlpha * denominator);
    }
  }
  return g;
}

VectorXcd garnier2004_poles() {
  VectorXcd result(2 * kModes);
  for (Eigen::Index k = 0; k < kModes; ++k) {
    result[2 * k] = pole(k);
    result[2 * k + 1] = std::conj(pole(k));
  }
  return result;
}

VectorXd garnier2004_break_points() { return logarithmic(2.0, 8000.0, 2 * kModes); }

VectorXd garnier2004_printed_phases() {
  return VectorXd{
      {5.467937011969567,  1.8021256739851832,  3.7896915944565217,  4.885390725635421,   4.499229591569185,
       5.751502923550237,  5.406012734936528,   5.769457179338603,   0.16705566255799906, 2.7473102100073867,
       3.0469950700637893, 0.40937589561693843, 0.03534951896620935, 5.218948408606197,   6.17827021381561,
       4.92984909818132,   1.9829952111260856,  4.431742369335002,   1.879810123305444,   4.654259983920474,
       1.7577036208467758, 4.917163740721939,   6.206158148190595,   6.196719562211705,   5.547189109212367}};
}

Multisine garnier2004_multisine() {
  return garnier2004_multisine(VectorXd::NullaryExpr(kTones, [](Eigen::Index k) {
    const auto i = static_cast<double>(k + 1);
    return -std::numbers::pi * i * (i - 1.0) / static_cast<double>(kTones);
  }));
}

Multisine garnier2004_multisine(const VectorXd& phase) {
  if (phase.size() != kTones) fail("multisine: expected ", kTones, " phases, got ", phase.size());
  return {logarithmic(kFirstTone, kLastTone, kTones), VectorXd::Ones(kTones), phase};
}

Record garnier2004_record(const Garnier2004Experiment& experiment) {
  check(experiment);
  const Multisine& input = experiment.input;
  const double h = 2.0 * std::numbers::pi / (experiment.oversampling * kLastTone);
  const auto count = static_cast<Eigen::Index>(std::floor(experiment.length_s / h)) + 1;
  Record record;
  record.name = "garnier2004";
  record.sample_time_s = h;
  record.u = VectorXd::Zero(count);
  record.y = VectorXd::Zero(count);
  const VectorXcd g = garnier2004_response(input.omega_rad_s);
  for (Eigen::Index i = 0; i < g.size(); ++i) {
    const Complex amplitude = std::polar(input.amplitude[i], input.phase[i]);
    add_exponential(amplitude, {0.0, input.omega_rad_s[i]}, h, record.u);
    add_exponential(g[i] * amplitude, {0.0, input.omega_rad_s[i]}, h, record.y);
  }
  for (Eigen::Index k = 0; k < kModes && !experiment.steady_state; ++k) {
    add_exponential(2.0 * residue(k) * transform(input, pole(k)), pole(k), h, record.y);
  }
  if (std::isfinite(experiment.snr_db)) {
    const double rms = std::sqrt(record.y.squaredNorm() / static_cast<double>(count));
    record.y += rms * std::pow(10.0, -experiment.snr_db / 20.0) * Gaussian(experiment.seed).vector(count);
  }
  return record;
}

}  // namespace blockid::problems
