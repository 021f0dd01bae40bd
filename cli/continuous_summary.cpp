#include <blockid/cli/continuous_summary.hpp>

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>

#include <cmath>
#include <limits>
#include <ostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double deviation(const VectorXd& deviations, Index k) { return k < deviations.size() ? deviations[k] : kUnknown; }

/// Powers descending: `count` coefficients of `letter`, scaled from powers of s / scale to powers of s.
void append_powers(char letter, const VectorXd& values, const VectorXd& deviations, Index count, double scale,
                   Index order, std::vector<Coefficient>& list) {
  for (Index power = count - 1; power >= 0; --power) {
    const double factor = std::pow(scale, static_cast<double>(order - power));
    list.push_back({letter + std::to_string(power), values[power] * factor, deviation(deviations, power) * factor});
  }
}

/// sqrt diag(M C M') for the linear map M from parameters to coefficients.
VectorXd mapped_deviations(const MatrixXd& map, const MatrixXd& covariance) {
  return (map * covariance * map.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
}

/// Coefficients are linear in [a, b], since no phi contains the highest power of s.
void add_coefficients(const ContinuousTransferFunction& model, const MatrixXd& covariance, ContinuousSummary& summary) {
  const Index n = model.basis.order;
  const Index m = model.basis.numerator_degree;
  try {
    const RationalPolynomials scaled = polynomials(model);
    VectorXd a_deviations;
    VectorXd b_deviations;
    if (covariance.size() > 0) {
      const BasisPolynomials basis = polynomials(model.basis, scaled.scale_rad_s);
      const double leading = basis.lead[n];
      a_deviations = mapped_deviations(basis.phi.topRows(n) / leading, covariance.topLeftCorner(n, n));
      b_deviations = mapped_deviations(basis.psi.topRows(m + 1) / leading, covariance.bottomRightCorner(m + 1, m + 1));
    }
    std::vector<Coefficient> list;
    append_powers('a', scaled.denominator, a_deviations, n, scaled.scale_rad_s, n, list);
    append_powers('b', scaled.numerator, b_deviations, m + 1, scaled.scale_rad_s, n, list);
    for (const Coefficient& one : list) {
      if (!std::isfinite(one.value)) fail("coefficients of powers of s overflow over a band this wide");
    }
    summary.coefficients = std::move(list);
  } catch (const Error& error) {
    summary.notes.push_back(std::string("no polynomials: ") + error.what());
  }
}

std::string known(double value, int digits = 3) { return std::isnan(value) ? "-" : number(value, digits); }

/// Damping ratio -Re / |.|; 1 and -1 for real roots.
double damping(std::complex<double> root) { return root == 0.0 ? kUnknown : -root.real() / std::abs(root); }

std::vector<std::vector<std::string>> coefficient_rows(const ContinuousSummary& summary) {
  std::vector<std::vector<std::string>> rows;
  for (const Coefficient& one : summary.coefficients) {
    rows.push_back({one.name, number(one.value, 8), known(one.standard_deviation)});
  }
  return rows;
}

std::vector<std::vector<std::string>> root_rows(const ContinuousSummary& summary) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const char* what, const std::complex<double>& root, const std::string& deviations) {
    rows.push_back({what, to_text(root), deviations, number(std::abs(root) / kTurn), known(damping(root), 5)});
  };
  for (const ContinuousRoot& pole : summary.poles) {
    const bool has_deviation = !std::isnan(pole.real_deviation);
    std::string text = known(pole.real_deviation);
    if (has_deviation && pole.value.imag() != 0.0) text += ", " + number(pole.imaginary_deviation, 3);
    add("pole", pole.value, text);
  }
  for (const std::complex<double>& zero : summary.zeros) add("zero", zero, "");
  return rows;
}

Json root_json(const std::complex<double>& root) {
  return {{"real", finite_or_null(root.real())},
          {"imaginary", finite_or_null(root.imag())},
          {"natural_frequency_hz", finite_or_null(std::abs(root) / kTurn)},
          {"damping", finite_or_null(damping(root))}};
}

}  // namespace

ContinuousSummary summary_of(const ContinuousTransferFunction& model, const MatrixXd& covariance) {
  ContinuousSummary summary;
  add_coefficients(model, covariance, summary);
  const Eigen::VectorXcd roots = poles(model);
  VectorXd re;
  VectorXd im;
  if (covariance.size() > 0) {
    const Eigen::MatrixXcd slopes = pole_sensitivities(model);
    const MatrixXd denominator = covariance.topLeftCorner(roots.size(), roots.size());
    re = mapped_deviations(slopes.real(), denominator);
    im = mapped_deviations(slopes.imag(), denominator);
  }
  for (Index k = 0; k < roots.size(); ++k) summary.poles.push_back({roots[k], deviation(re, k), deviation(im, k)});
  try {
    const Eigen::VectorXcd found = zeros(model);
    summary.zeros.assign(found.begin(), found.end());
  } catch (const Error& error) {
    summary.notes.emplace_back(error.what());
  }
  const std::complex<double> gain = response_at(model, VectorXd::Zero(1))[0];
  summary.dc_gain = std::isfinite(gain.real()) ? gain.real() : std::numeric_limits<double>::infinity();
  summary.stable = is_stable(model);
  return summary;
}

ContinuousSummary summary_of(const TrendFit& fit) {
  ContinuousSummary summary;
  const auto deviation_of_next = [&] {
    const Index k = std::ssize(summary.coefficients);
    return std::sqrt(fit.covariance(k, k));
  };
  for (const Index power : fit.structure.a) {
    summary.coefficients.push_back({"a" + std::to_string(power), fit.a[power], deviation_of_next()});
  }
  for (const Index power : fit.structure.b) {
    summary.coefficients.push_back({"b" + std::to_string(power), fit.b[power], deviation_of_next()});
  }
  for (const std::complex<double>& pole : poles(fit)) summary.poles.push_back({pole, kUnknown, kUnknown});
  summary.dc_gain = fit.a[0] != 0.0 ? fit.b[0] / fit.a[0] : std::numeric_limits<double>::infinity();
  summary.stable = is_stable(fit);
  return summary;
}

void print_summary(std::ostream& stream, const ContinuousSummary& summary) {
  if (!summary.coefficients.empty()) {
    print(stream, {{{"coefficient", Align::left}, {"value", Align::right}, {"standard deviation", Align::right}},
                   coefficient_rows(summary)});
  }
  print(stream, {{{"", Align::left},
                  {"root rad/s", Align::right},
                  {"standard deviation", Align::right},
                  {"natural frequency Hz", Align::right},
                  {"damping ratio", Align::right}},
                 root_rows(summary)});
  stream << "  gain at frequency zero " << number(summary.dc_gain) << '\n';
  for (const std::string& note : summary.notes) stream << "  " << note << '\n';
}

void add_summary(HtmlPage& page, const ContinuousSummary& summary) {
  page.heading("Poles, zeros and coefficients");
  page.table({"", "root [rad/s]", "standard deviation", "natural frequency [Hz]", "damping ratio"}, root_rows(summary));
  page.paragraph("Gain at frequency zero: " + number(summary.dc_gain) + ".");
  if (!summary.coefficients.empty()) {
    page.table({"coefficient of a power of s", "value", "standard deviation"}, coefficient_rows(summary));
  }
  for (const std::string& note : summary.notes) page.paragraph(note);
}

void add_summary(Json& result, const ContinuousSummary& summary) {
  result["coefficients"] = Json::array();
  for (const Coefficient& one : summary.coefficients) {
    result["coefficients"].push_back({{"name", one.name},
                                      {"value", finite_or_null(one.value)},
                                      {"standard_deviation", finite_or_null(one.standard_deviation)}});
  }
  result["poles"] = Json::array();
  for (const ContinuousRoot& pole : summary.poles) {
    Json entry = root_json(pole.value);
    entry["real_standard_deviation"] = finite_or_null(pole.real_deviation);
    entry["imaginary_standard_deviation"] = finite_or_null(pole.imaginary_deviation);
    result["poles"].push_back(std::move(entry));
  }
  result["zeros"] = Json::array();
  for (const std::complex<double>& zero : summary.zeros) result["zeros"].push_back(root_json(zero));
  result["dc_gain"] = finite_or_null(summary.dc_gain);
  result["stable"] = summary.stable;
}

nlohmann::ordered_json excitation_json(const Excitation& excitation, Index coefficients) {
  return {{"frequencies", excitation.frequencies},
          {"equations", excitation.equations()},
          {"coefficients", coefficients},
          {"enough", excitation.equations() >= coefficients}};
}

}  // namespace blockid::cli
