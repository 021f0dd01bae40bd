// Pictures that every continuous-time model has in its report.
#pragma once

#include <blockid/cli/continuous_options.hpp>
#include <blockid/cli/report/figures.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/estimators/continuous_model.hpp>

#include <Eigen/Core>

namespace blockid::cli {

/// Frequencies in Hz for a curve over the band: evenly spaced logarithmically, and closer at the resonances of the
/// poles, so that no peak is cut off.
Eigen::VectorXd curve_frequencies(const FrequencyRange& band, const Eigen::VectorXcd& poles);

/// Bode picture over the band with measured points, and the map of poles and zeros. covariance: of [a, b], or empty.
void add_continuous_figures(HtmlPage& page, const ContinuousTransferFunction& model, const Eigen::MatrixXd& covariance,
                            const FrequencyRange& band, const MeasuredPoints& measured, bool gnuplot);

}  // namespace blockid::cli
