#include "blockid/data/load_response.hpp"

#include <cmath>
#include <complex>
#include <numbers>

#include "blockid/data/error.hpp"
#include "blockid/data/load.hpp"
#include "blockid/data/mat.hpp"

namespace blockid {
namespace {

constexpr const char* kForms =
    "expected one complex variable, real and imaginary parts, or magnitude and phase of the response";

/// Both halves of a form, or none.
bool has_pair(const ResponseSpec& spec, const std::optional<std::string>& first,
              const std::optional<std::string>& second, const char* names) {
  if (first.has_value() != second.has_value()) {
    fail(spec.path.string(), ": only one of ", names, " is named, expected both");
  }
  return first.has_value();
}

Eigen::VectorXd signal(const ResponseSpec& spec, const std::string& name) {
  return load_column(spec.path, name, spec.csv);
}

void check_length(const ResponseSpec& spec, const std::string& name, Eigen::Index length, Eigen::Index expected) {
  if (length == expected) return;
  fail(spec.path.string(), ": '", name, "' has ", length, " entries, '", spec.frequency, "' ", expected);
}

Eigen::VectorXd signal(const ResponseSpec& spec, const std::string& name, Eigen::Index expected) {
  Eigen::VectorXd values = signal(spec, name);
  check_length(spec, name, values.size(), expected);
  return values;
}

Eigen::VectorXcd complex_signal(const ResponseSpec& spec, const std::string& name, Eigen::Index expected) {
  if (detect_file_kind(spec.path) != FileKind::mat) {
    fail(spec.path.string(), ": a complex variable needs a MAT file; name the columns of its real and imaginary part");
  }
  Eigen::VectorXcd values = MatFile(spec.path).complex_vector(name);
  check_length(spec, name, values.size(), expected);
  return values;
}

Eigen::VectorXd magnitudes(const ResponseSpec& spec, Eigen::Index expected) {
  Eigen::VectorXd values = signal(spec, *spec.magnitude, expected);
  if (spec.magnitude_unit == MagnitudeUnit::decibels) {
    constexpr double kDecibels = 20.0;
    return values.unaryExpr([](double db) { return std::pow(10.0, db / kDecibels); });
  }
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    if (values[k] >= 0.0) continue;
    fail(spec.path.string(), ": magnitude '", *spec.magnitude, "' at index ", k, " is ", values[k],
         ", expected a ratio >= 0 (or the unit dB)");
  }
  return values;
}

Eigen::VectorXcd polar(const ResponseSpec& spec, Eigen::Index expected) {
  const Eigen::VectorXd magnitude = magnitudes(spec, expected);
  const double unit = spec.phase_unit == AngleUnit::degrees ? std::numbers::pi / 180.0 : 1.0;
  const Eigen::VectorXd phase = unit * signal(spec, *spec.phase, expected);
  return magnitude.binaryExpr(phase, [](double r, double angle) { return std::polar(r, angle); });
}

}  // namespace

FrequencyResponse load_frequency_response(const ResponseSpec& spec) {
  const bool cartesian = has_pair(spec, spec.real, spec.imaginary, "real and imaginary part");
  const bool in_polar_form = has_pair(spec, spec.magnitude, spec.phase, "magnitude and phase");
  const int forms = int{spec.response.has_value()} + int{cartesian} + int{in_polar_form};
  if (forms != 1) fail(spec.path.string(), ": the response is given in ", forms, " forms, ", kForms);
  FrequencyResponse g;
  const double unit = spec.frequency_unit == FrequencyUnit::hertz ? 2.0 * std::numbers::pi : 1.0;
  g.omega_rad_s = unit * signal(spec, spec.frequency);
  const Eigen::Index count = g.omega_rad_s.size();
  if (spec.response) g.response = complex_signal(spec, *spec.response, count);
  if (in_polar_form) g.response = polar(spec, count);
  if (cartesian) {
    g.response.resize(count);
    g.response.real() = signal(spec, *spec.real, count);
    g.response.imag() = signal(spec, *spec.imaginary, count);
  }
  if (spec.deviation) g.standard_deviation = signal(spec, *spec.deviation, count);
  try {
    check(g);
  } catch (const Error& error) {
    fail(spec.path.string(), ": ", error.what());
  }
  return g;
}

}  // namespace blockid
