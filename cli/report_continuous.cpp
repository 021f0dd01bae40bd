#include <blockid/cli/report_continuous.hpp>

#include <blockid/cli/continuous_summary.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

namespace blockid::cli {
namespace {

constexpr Index kResponsePoints = 400;

LinearRoots roots_of(const ContinuousTransferFunction& model) {
  const Eigen::VectorXcd found = poles(model);
  LinearRoots roots;
  roots.poles.assign(found.begin(), found.end());
  try {
    const Eigen::VectorXcd tops = zeros(model);
    roots.zeros.assign(tops.begin(), tops.end());
  } catch (const Error&) {
    // A numerator of lower degree than stated: the summary says so.
  }
  return roots;
}

}  // namespace

Eigen::VectorXd curve_frequencies(const FrequencyRange& band, const Eigen::VectorXcd& poles) {
  const Eigen::VectorXd even = break_points(band.low, band.high, kResponsePoints);
  std::vector<double> omega(even.begin(), even.end());
  // In half widths from the peak of |1 / (s - pole)|.
  constexpr double kWidths[] = {-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0};
  for (const std::complex<double>& pole : poles) {
    for (const double width : kWidths) {
      const double point = std::abs(pole.imag()) + width * std::abs(pole.real());
      if (point > band.low && point < band.high) omega.push_back(point);
    }
  }
  std::sort(omega.begin(), omega.end());
  omega.erase(std::unique(omega.begin(), omega.end()), omega.end());
  return Eigen::Map<const Eigen::VectorXd>(omega.data(), std::ssize(omega)) / kTurn;
}

void add_continuous_figures(HtmlPage& page, const ContinuousTransferFunction& model, const Eigen::MatrixXd& covariance,
                            const FrequencyRange& band, const MeasuredPoints& measured, bool gnuplot) {
  const LinearRoots roots = roots_of(model);
  const Eigen::VectorXd frequency =
      curve_frequencies(band, Eigen::Map<const Eigen::VectorXcd>(roots.poles.data(), std::ssize(roots.poles)));
  const BasisValues values = evaluate(model.basis, Eigen::VectorXd(kTurn * frequency));
  const Index n = model.denominator.size();
  const auto response = [&](const Eigen::VectorXd& ab) -> Eigen::VectorXcd {
    return (values.psi * ab.tail(ab.size() - n)).cwiseQuotient(values.lead + values.phi * ab.head(n));
  };
  Eigen::VectorXd ab(n + model.numerator.size());
  ab << model.denominator, model.numerator;
  add_figure(page, bode_figure("G", bode_band(response, ab, covariance, frequency), measured), gnuplot);
  add_figure(page, s_plane_figure("G", roots), gnuplot);
}

}  // namespace blockid::cli
