// The pictures of the reports as gnuplot scripts.
#pragma once

#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/validation/spectrum.hpp>

#include <blockid/estimators/candidate.hpp>

#include <Eigen/Core>
#include <string>

namespace blockid::cli {

/// A picture before gnuplot has drawn it.
struct Figure {
  std::string id;
  std::string title;
  std::string caption;
  std::string script;
  int width = 900;
  int height = 360;
};

/// Measured, simulated and their difference around the samples with the largest error. begin: number of the record's
/// first sample in the file.
Figure zoom_figure(const ScoredRecord& scored, const std::string& set, Index begin);

/// The whole record as envelopes of measured output and error.
Figure whole_figure(const ScoredRecord& scored, const std::string& set, Index begin);

/// Points of a response that was measured without a model; none when `response` is empty.
struct MeasuredPoints {
  BodeBand response;
  std::string label = "averaged spectra";
  std::string caption =
      "Points: averaged cross spectrum over input spectrum, no model involved, where the coherence is above 0.7.";
  /// Of a point.
  double size = 0.25;
};

/// Magnitude and phase with 2-sigma bands, and measured points.
Figure bode_figure(const std::string& name, const BodeBand& band, const MeasuredPoints& measured);

/// In the z plane.
Figure pole_zero_figure(const std::string& name, const LinearRoots& roots);

/// In the s plane. Roots that span more than two decades are drawn at their angle with a radius that grows with the
/// logarithm of their modulus.
Figure s_plane_figure(const std::string& name, const LinearRoots& roots);

/// Where an initialiser placed the roots: each with its exponent, coloured by the filter that it went to.
Figure root_shares_figure(const Candidate& candidate);

/// f with its 2-sigma band over the histogram of its input v.
Figure static_figure(const LeafBlock& leaf, const Eigen::MatrixXd& covariance, const Eigen::VectorXd& v);

/// Spectra of measured output and error.
Figure spectrum_figure(const ScoredRecord& scored, const std::string& set);

/// The frequency response that the record itself shows, S_yu / S_uu by averaged periodograms, where the coherence is
/// high; its phase lies within (-180, 180] degrees.
BodeBand measured_response(const Record& record);

/// Draws the figure and puts it on the page; says why when there is no gnuplot.
void add_figure(HtmlPage& page, const Figure& figure, bool gnuplot);

}  // namespace blockid::cli
