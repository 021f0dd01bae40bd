#include "blockid/data/frequency_response.hpp"

#include <cmath>
#include <complex>
#include <numbers>

#include "blockid/data/error.hpp"

namespace blockid {
namespace {

void check_sizes(const FrequencyResponse& g) {
  const Eigen::Index count = g.omega_rad_s.size();
  if (count == 0) fail("frequency response: empty, expected at least one frequency");
  if (g.response.size() != count) {
    fail("frequency response: unequal lengths: ", count, " frequencies, ", g.response.size(), " responses");
  }
  if (g.standard_deviation.size() != 0 && g.standard_deviation.size() != count) {
    fail("frequency response: unequal lengths: ", count, " frequencies, ", g.standard_deviation.size(),
         " standard deviations");
  }
  if (!(std::isfinite(g.sample_time_s) && g.sample_time_s >= 0)) {
    fail("frequency response: sample time is ", g.sample_time_s, " s, expected 0 (continuous) or positive");
  }
}

void check_frequencies(const FrequencyResponse& g) {
  // 1e-9: a grid that ends on the Nyquist frequency may exceed it by rounding.
  const double limit = g.sample_time_s > 0 ? std::numbers::pi / g.sample_time_s * (1 + 1e-9) : INFINITY;
  for (Eigen::Index k = 0; k < g.omega_rad_s.size(); ++k) {
    const double omega = g.omega_rad_s[k];
    if (!std::isfinite(omega) || omega < 0) {
      fail("frequency response: frequency at index ", k, " is ", omega, " rad/s, expected finite and >= 0");
    }
    if (k > 0 && omega <= g.omega_rad_s[k - 1]) {
      fail("frequency response: frequency at index ", k, " is ", omega, " rad/s, expected above its predecessor ",
           g.omega_rad_s[k - 1]);
    }
    if (omega > limit) {
      fail("frequency response: frequency at index ", k, " is ", omega, " rad/s, above the Nyquist frequency ",
           std::numbers::pi / g.sample_time_s);
    }
  }
}

}  // namespace

void check(const FrequencyResponse& g) {
  check_sizes(g);
  check_frequencies(g);
  for (Eigen::Index k = 0; k < g.response.size(); ++k) {
    if (!std::isfinite(g.response[k].real()) || !std::isfinite(g.response[k].imag())) {
      fail("frequency response: non-finite response at index ", k, ": ", g.response[k]);
    }
  }
  for (Eigen::Index k = 0; k < g.standard_deviation.size(); ++k) {
    if (!(std::isfinite(g.standard_deviation[k]) && g.standard_deviation[k] >= 0)) {
      fail("frequency response: standard deviation at index ", k, " is ", g.standard_deviation[k],
           ", expected finite and >= 0");
    }
  }
}

Eigen::VectorXd magnitude_db(const FrequencyResponse& g) { return 20.0 * g.response.array().abs().log10(); }

Eigen::VectorXd phase_deg(const FrequencyResponse& g) {
  constexpr double kTurn = 360.0;
  Eigen::VectorXd phase(g.response.size());
  double previous = 0.0;
  for (Eigen::Index k = 0; k < phase.size(); ++k) {
    const double wrapped = std::arg(g.response[k]) * 180.0 / std::numbers::pi;
    phase[k] = k == 0 ? wrapped : wrapped - kTurn * std::round((wrapped - previous) / kTurn);
    previous = phase[k];
  }
  return phase;
}

}  // namespace blockid
