#include <blockid/cli/report/figures.hpp>

#include <blockid/cli/report/envelope.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/histogram.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <iostream>
#include <limits>
#include <utility>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

constexpr Index kZoomSamples = 400;
constexpr Index kBuckets = 400;
constexpr Index kStaticCurvePoints = 300;
constexpr Index kBins = 60;
/// Below, a measured frequency response is mostly noise.
constexpr double kLeastCoherence = 0.7;

constexpr const char* kBandColour = "fillcolor rgb '#93c5fd' fillstyle transparent solid 0.55 noborder";

/// Two panels with one abscissa; the upper takes `share` of the height.
std::string upper_panel(double share) {
  return "set multiplot\nset size 1," + fixed_number(share, 2) + "\nset origin 0," + fixed_number(1.0 - share, 2) +
         "\nset format x ''\nset bmargin 0.6\nset tmargin 2\n";
}

std::string lower_panel(double share) {
  return "set size 1," + fixed_number(1.0 - share, 2) +
         "\nset origin 0,0\nset format x\nset bmargin 3.2\nset tmargin 0.6\nunset key\n";
}

/// A range about zero that holds the values, with a tic on either side.
std::string symmetric_range(double largest) {
  if (!(largest > 0.0)) return "set yrange [-1:1]\nset ytics 1\n";
  const double power = std::pow(10.0, std::floor(std::log10(largest)));
  double tic = power;
  for (const double multiple : {2.0, 5.0}) {
    if (multiple * power <= largest) tic = multiple * power;
  }
  const std::string reach = number(1.08 * largest);
  return "set yrange [-" + reach + ":" + reach + "]\nset ytics " + number(tic) + "\n";
}

VectorXd times(Index begin, Index count, double sample_time_s) {
  return VectorXd::LinSpaced(count, static_cast<double>(begin), static_cast<double>(begin + count - 1)) * sample_time_s;
}

std::string x_range(const VectorXd& x) {
  return "set xrange [" + number(x[0], 10) + ":" + number(x[x.size() - 1], 10) + "]\n";
}

/// The phase in degrees of `measured`, moved by whole turns to where the model's is.
VectorXd phase_beside(const BodeBand& measured, const BodeBand& model) {
  constexpr double kTurnDegrees = 360.0;
  VectorXd phase = measured.phase_deg;
  Index nearest = 0;
  for (Index k = 0; k < phase.size(); ++k) {
    while (nearest + 1 < model.frequency_hz.size() && model.frequency_hz[nearest + 1] <= measured.frequency_hz[k]) {
      ++nearest;
    }
    phase[k] += kTurnDegrees * std::round((model.phase_deg[nearest] - phase[k]) / kTurnDegrees);
  }
  return phase;
}

/// Largest magnitude at which roots are drawn; farther ones would leave no room for the circle.
constexpr double kMapRadius = 3.0;
constexpr const char* kFilterColours[] = {"#047857", "#b45309"};

struct Points {
  VectorXd real;
  VectorXd imaginary;
  std::string beyond;
};

Points points_of(const std::vector<std::complex<double>>& roots) {
  std::vector<double> real;
  std::vector<double> imaginary;
  Points points;
  for (const std::complex<double>& root : roots) {
    if (std::abs(root) > kMapRadius) {
      points.beyond += (points.beyond.empty() ? "" : ", ") + to_text(root);
      continue;
    }
    real.push_back(root.real());
    imaginary.push_back(root.imag());
  }
  points.real = Eigen::Map<const VectorXd>(real.data(), static_cast<Index>(real.size()));
  points.imaginary = Eigen::Map<const VectorXd>(imaginary.data(), static_cast<Index>(imaginary.size()));
  return points;
}

/// The roots and the circle with a margin.
double map_reach(const Points& zeros, const Points& poles) {
  double reach = 1.0;
  for (const Points* points : {&zeros, &poles}) {
    if (points->real.size() == 0) continue;
    reach = std::max({reach, points->real.cwiseAbs().maxCoeff(), points->imaginary.cwiseAbs().maxCoeff()});
  }
  constexpr double kMargin = 1.15;
  return kMargin * reach;
}

VectorXd density_decibels(const VectorXd& density) {
  return density.unaryExpr([](double s) { return 10.0 * std::log10(s); });
}

/// Moduli of roots that differ by more are drawn logarithmically.
constexpr double kLinearSpan = 100.0;

/// Where a root of the s plane is drawn: as it is, or at its angle with the radius 1 + log10(modulus / least).
std::complex<double> place_in_map(std::complex<double> root, double least, bool logarithmic) {
  if (!logarithmic || root == 0.0) return root;
  return std::polar(1.0 + std::log10(std::abs(root) / least), std::arg(root));
}

/// Least and largest modulus of the roots that are not zero; ones when there are none.
std::pair<double, double> moduli(const LinearRoots& roots) {
  double least = std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (const auto* list : {&roots.zeros, &roots.poles}) {
    for (const std::complex<double>& root : *list) {
      if (root == 0.0) continue;
      least = std::min(least, std::abs(root));
      largest = std::max(largest, std::abs(root));
    }
  }
  return largest > 0.0 ? std::pair{least, largest} : std::pair{1.0, 1.0};
}

Points placed(const std::vector<std::complex<double>>& roots, double least, bool logarithmic) {
  Points points{VectorXd(std::ssize(roots)), VectorXd(std::ssize(roots)), {}};
  for (Index k = 0; k < std::ssize(roots); ++k) {
    const std::complex<double> place = place_in_map(roots[static_cast<std::size_t>(k)], least, logarithmic);
    points.real[k] = place.real();
    points.imaginary[k] = place.imag();
  }
  return points;
}

/// What the roots of one kind that went to one filter add to a picture.
struct SharesLayer {
  Points points;
  /// Commands that write the exponents beside the roots.
  std::string labels;
};

SharesLayer shares_layer(const Candidate& candidate, bool pole, bool in_first) {
  SharesLayer layer;
  std::vector<std::complex<double>> roots;
  for (const RootShare& share : candidate.root_shares) {
    if (share.pole != pole || share.in_first != in_first) continue;
    roots.push_back(share.value);
    if (share.value.imag() != 0.0) roots.push_back(std::conj(share.value));
    if (std::abs(share.value) > kMapRadius) continue;
    layer.labels += "set label " + plot_text(fixed_number(share.exponent, 2)) + " at " + number(share.value.real()) +
                    "," + number(share.value.imag()) + " left offset 0.8,0.5 front textcolor rgb " +
                    plot_text(kFilterColours[in_first ? 0 : 1]) + "\n";
  }
  layer.points = points_of(roots);
  return layer;
}

/// Axes of the z plane out to `reach`, with the first element of its plot: the unit circle.
std::string z_plane(double reach) {
  const std::string limit = number(reach, 4);
  return "set size ratio -1\nset lmargin 8\nset xrange [-" + limit + ":" + limit + "]\nset yrange [-" + limit + ":" +
         limit + "]\nset xlabel 'real'\nset ylabel 'imaginary' offset 1,0\nset parametric\nset trange [0:2*pi]\n" +
         "set samples 200\nplot cos(t), sin(t) with lines ls 4 notitle";
}

}  // namespace

Figure zoom_figure(const ScoredRecord& scored, const std::string& set, Index begin) {
  const Record& record = scored.record;
  const VectorXd error = scored_residual(scored);
  const Index length = std::min<Index>(kZoomSamples, error.size());
  const Index first = worst_stretch(error, length);
  const VectorXd t = times(begin + first, length, record.sample_time_s);
  Figure figure{.id = "measured-zoom",
                .title = "Measured against simulated, " + set + " data, in detail",
                .caption = std::to_string(length) + " samples from sample " + std::to_string(begin + first) +
                           " on, where the error is largest; below, the error (measured - simulated) on its own scale.",
                .script = {},
                .height = 440};
  figure.script =
      kFigureStyles +
      data_block(
          "d", {t, record.y.segment(first, length), scored.yhat.segment(first, length), error.segment(first, length)}) +
      x_range(t) + upper_panel(0.62) + "set ylabel " + plot_text(axis_label(record.output_name, record.output_unit)) +
      "\nplot $d using 1:2 with lines ls 1 title 'measured', $d using 1:3 with lines ls 2 title "
      "'simulated'\n" +
      lower_panel(0.62) + symmetric_range(error.segment(first, length).cwiseAbs().maxCoeff()) +
      "set xlabel 'time [s]'\nset ylabel " + plot_text(axis_label("error", record.output_unit)) +
      "\nplot $d using 1:4 with lines ls 3\nunset multiplot\n";
  return figure;
}

Figure whole_figure(const ScoredRecord& scored, const std::string& set, Index begin) {
  const Record& record = scored.record;
  const VectorXd residual = scored_residual(scored);
  const Envelope measured = envelope(record.y, kBuckets);
  const Envelope error = envelope(residual, kBuckets);
  const VectorXd t = (measured.position.array() + static_cast<double>(begin)).matrix() * record.sample_time_s;
  Figure figure{.id = "measured-whole",
                .title = "Measured output and error, " + set + " data, whole record",
                .caption = "Smallest and largest value in each of " + std::to_string(t.size()) +
                           " stretches of the record; the warm-up is not scored and shows no error.",
                .script = {},
                .height = 420};
  figure.script = kFigureStyles + data_block("d", {t, measured.lower, measured.upper, error.lower, error.upper}) +
                  x_range(t) + upper_panel(0.62) + "set ylabel " +
                  plot_text(axis_label(record.output_name, record.output_unit)) +
                  "\nplot $d using 1:2:3 with filledcurves fillcolor rgb '#4b5563' title 'measured'\n" +
                  lower_panel(0.62) + symmetric_range(residual.cwiseAbs().maxCoeff()) +
                  "set xlabel 'time [s]'\nset ylabel " + plot_text(axis_label("error", record.output_unit)) +
                  "\nplot $d using 1:4:5 with filledcurves fillcolor rgb '#dc2626'\nunset multiplot\n";
  return figure;
}

Figure bode_figure(const std::string& name, const BodeBand& band, const MeasuredPoints& measured) {
  const auto limits = [](const VectorXd& centre, const VectorXd& deviation) {
    return std::pair<VectorXd, VectorXd>{centre - 2.0 * deviation, centre + 2.0 * deviation};
  };
  const auto [low_db, high_db] = limits(band.magnitude_db, band.magnitude_deviation_db);
  const auto [low_deg, high_deg] = limits(band.phase_deg, band.phase_deviation_deg);
  const bool has_band = band.magnitude_deviation_db.maxCoeff() > 0.0;
  const BodeBand& points = measured.response;
  const bool has_points = points.frequency_hz.size() > 0;
  Figure figure{.id = "bode-" + name,
                .title = "Bode picture of " + name,
                .caption = has_band
                               ? "Shaded: 2 standard deviations from the covariance of the parameters (delta method), "
                                 "at most " +
                                     number(2.0 * band.magnitude_deviation_db.maxCoeff(), 3) + " dB and " +
                                     number(2.0 * band.phase_deviation_deg.maxCoeff(), 3) + " degrees."
                               : "No band: the covariance of the parameters is not known.",
                .script = {},
                .height = 460};
  if (has_points) figure.caption += " " + measured.caption;
  std::string script = kFigureStyles + data_block("d", {band.frequency_hz, band.magnitude_db, low_db, high_db,
                                                        band.phase_deg, low_deg, high_deg});
  if (has_points) script += data_block("m", {points.frequency_hz, points.magnitude_db, phase_beside(points, band)});
  const auto panel = [&](int column) {
    const std::string c = std::to_string(column);
    const std::string low = std::to_string(column + 1);
    const std::string high = std::to_string(column + 2);
    std::string plot = "plot ";
    if (has_band) plot += "$d using 1:" + low + ":" + high + " with filledcurves " + kBandColour + " title '2 sigma', ";
    if (has_points) {
      plot += "$m using 1:" + std::to_string(column == 2 ? 2 : 3) + " with points pt 7 ps " + number(measured.size, 3) +
              " lc rgb '#9ca3af' title " + plot_text(measured.label) + ", ";
    }
    return plot + "$d using 1:" + c + " with lines ls 2 title 'model'\n";
  };
  script += "set logscale x\n" + x_range(band.frequency_hz) + upper_panel(0.56) + "set ylabel 'magnitude [dB]'\n" +
            panel(2) + lower_panel(0.56) + "set xlabel 'frequency [Hz]'\nset ylabel 'phase [deg]'\n" + panel(5) +
            "unset multiplot\n";
  figure.script = std::move(script);
  return figure;
}

Figure pole_zero_figure(const std::string& name, const LinearRoots& roots) {
  const Points zeros = points_of(roots.zeros);
  const Points poles = points_of(roots.poles);
  Figure figure{.id = "pole-zero-" + name,
                .title = "Poles and zeros of " + name,
                .caption = "In the z plane with the unit circle; roots at the origin are left out.",
                .script = {},
                .width = 440,
                .height = 420};
  if (!zeros.beyond.empty()) figure.caption += " Beyond the picture: zeros at " + zeros.beyond + ".";
  if (!poles.beyond.empty()) figure.caption += " Beyond the picture: poles at " + poles.beyond + ".";
  std::string script = kFigureStyles;
  if (zeros.real.size() > 0) script += data_block("z", {zeros.real, zeros.imaginary});
  if (poles.real.size() > 0) script += data_block("p", {poles.real, poles.imaginary});
  script += z_plane(map_reach(zeros, poles));
  if (poles.real.size() > 0) script += ", $p using 1:2 with points pt 2 ps 1.1 lw 2 lc rgb '#2563eb' title 'poles'";
  if (zeros.real.size() > 0) script += ", $z using 1:2 with points pt 6 ps 1.1 lw 2 lc rgb '#dc2626' title 'zeros'";
  figure.script = script + "\n";
  return figure;
}

Figure s_plane_figure(const std::string& name, const LinearRoots& roots) {
  const auto [least, largest] = moduli(roots);
  const bool logarithmic = largest > kLinearSpan * least;
  const Points zeros = placed(roots.zeros, least, logarithmic);
  const Points poles = placed(roots.poles, least, logarithmic);
  Figure figure{.id = "pole-zero-" + name,
                .title = "Poles and zeros of " + name,
                .caption = logarithmic
                               ? "In the s plane, each root at its angle; the distance from the origin is one at a "
                                 "modulus of " +
                                     number(least, 4) + " rad/s and grows by one a decade."
                               : "In the s plane, rad/s.",
                .script = {},
                .width = 480,
                .height = 440};
  const std::string limit = number(1.1 * (logarithmic ? 1.0 + std::log10(largest / least) : largest), 6);
  std::string script = kFigureStyles;
  if (zeros.real.size() > 0) script += data_block("z", {zeros.real, zeros.imaginary});
  if (poles.real.size() > 0) script += data_block("p", {poles.real, poles.imaginary});
  const std::string unit = logarithmic ? "" : " [rad/s]";
  script += "set size ratio -1\nset lmargin 10\nset xrange [-" + limit + ":" + limit + "]\nset yrange [-" + limit +
            ":" + limit + "]\nset xlabel 'real" + unit + "'\nset ylabel 'imaginary" + unit +
            "' offset 1,0\nset xzeroaxis ls 4\nset yzeroaxis ls 4\nplot ";
  const std::string poles_text = "$p using 1:2 with points pt 2 ps 1.1 lw 2 lc rgb '#2563eb' title 'poles'";
  const std::string zeros_text = "$z using 1:2 with points pt 6 ps 1.1 lw 2 lc rgb '#dc2626' title 'zeros'";
  if (poles.real.size() > 0) script += poles_text;
  if (zeros.real.size() > 0) script += (poles.real.size() > 0 ? ", " : "") + zeros_text;
  figure.script = script + "\n";
  return figure;
}

Figure root_shares_figure(const Candidate& candidate) {
  Figure figure{.id = "root-shares",
                .title = "Where the fractional initialiser placed the poles and zeros",
                .caption =
                    "Roots of the best linear approximation with the exponents that were fitted: 1 belongs whole to "
                    "the first filter, 0 to the second. Colour: the filter that each went to. " +
                    candidate.how + ".",
                .script = kFigureStyles,
                .width = 620,
                .height = 560};
  std::string plots;
  double reach = 1.0;
  for (const bool pole : {true, false}) {
    for (const bool in_first : {true, false}) {
      const SharesLayer layer = shares_layer(candidate, pole, in_first);
      if (!layer.points.beyond.empty()) figure.caption += " Beyond the picture: " + layer.points.beyond + ".";
      if (layer.points.real.size() == 0) continue;
      reach = std::max(reach, map_reach(layer.points, layer.points));
      const std::string filter = in_first ? "1" : "2";
      const std::string name = (pole ? "p" : "z") + filter;
      figure.script += data_block(name, {layer.points.real, layer.points.imaginary}) + layer.labels;
      plots += ", $" + name + " using 1:2 with points pt " + (pole ? "2" : "6") + " ps 1.2 lw 2 lc rgb " +
               plot_text(kFilterColours[in_first ? 0 : 1]) + " title '" + (pole ? "poles" : "zeros") + " to G" +
               filter + "'";
    }
  }
  figure.script += z_plane(reach) + plots + "\n";
  return figure;
}

Figure static_figure(const LeafBlock& leaf, const Eigen::MatrixXd& covariance, const VectorXd& v) {
  const Histogram counts = histogram(v, kBins);
  const VectorXd grid = VectorXd::LinSpaced(kStaticCurvePoints, v.minCoeff(), v.maxCoeff());
  const CurveBand band = curve_band(leaf.block, leaf.parameters, covariance, grid);
  const bool has_band = band.deviation.maxCoeff() > 0.0;
  Figure figure{.id = "static-" + leaf.path,
                .title = "Static block " + leaf.path + " over the histogram of its input",
                .caption =
                    "The curve within the range that its input covers in the training data; grey: how often the "
                    "input falls into each of " +
                    std::to_string(counts.centre.size()) + " bins.",
                .script = {},
                .height = 400};
  if (has_band) figure.caption += " Shaded: 2 standard deviations.";
  figure.script =
      kFigureStyles + data_block("h", {counts.centre, 100.0 * counts.share}) +
      data_block("d", {band.u, band.f, band.f - 2.0 * band.deviation, band.f + 2.0 * band.deviation}) + x_range(grid) +
      "set border 11\nset rmargin 9\nset xlabel " + plot_text("input of " + leaf.path) + "\nset ylabel " +
      plot_text("output of " + leaf.path) +
      "\nset y2label 'share of samples [%]'\nset ytics nomirror\nset y2tics\nset y2range [0:" +
      number(std::max(300.0 * counts.share.maxCoeff(), 1e-3), 4) + "]\nset boxwidth " + number(counts.width, 8) +
      "\nplot $h using 1:2 axes x1y2 with boxes fillcolor rgb '#d1d5db' fillstyle solid 1 " +
      "border lc rgb '#ffffff' title 'histogram', " +
      (has_band ? std::string("$d using 1:3:4 with filledcurves ") + kBandColour + " title '2 sigma', " : "") +
      "$d using 1:2 with lines ls 2 lw 2 title 'f'\n";
  return figure;
}

Figure spectrum_figure(const ScoredRecord& scored, const std::string& set) {
  const Record& record = scored.record;
  const VectorXd mask = scored_mask(scored);
  const VectorXd y = (mask.array() > 0.0).select(record.y, 0.0);
  const Index segment = segment_length(y.size());
  const Spectrum output = welch(y, record.sample_time_s, segment);
  const Spectrum error = welch(scored_residual(scored), record.sample_time_s, segment);
  const std::string unit = record.output_unit.empty() ? "1/Hz" : record.output_unit + "²/Hz";
  Figure figure{.id = "error-spectrum",
                .title = "Spectrum of the error beside that of the output, " + set + " data",
                .caption = "Power spectral density from averaged periodograms, Hann window of " +
                           std::to_string(segment) + " samples.",
                .script = {},
                .height = 340};
  figure.script =
      kFigureStyles +
      data_block("d", {output.frequency_hz, density_decibels(output.density), density_decibels(error.density)}) +
      x_range(output.frequency_hz) + "set xlabel 'frequency [Hz]'\nset ylabel " +
      plot_text("density [dB re " + unit + "]") +
      "\nplot $d using 1:2 with lines ls 1 title 'measured output', $d using 1:3 with lines ls 3 title "
      "'error'\n";
  return figure;
}

BodeBand measured_response(const Record& record) {
  const Index segment = segment_length(record.u.size());
  const CrossSpectrum cross = welch_cross(record.u, record.y, record.sample_time_s, segment);
  std::vector<double> frequency;
  std::vector<double> magnitude;
  std::vector<double> phase;
  for (Index k = 1; k < cross.frequency_hz.size(); ++k) {
    const double coherence = std::norm(cross.cross_density[k]) / (cross.input_density[k] * cross.output_density[k]);
    if (!(coherence > kLeastCoherence)) continue;
    const std::complex<double> g = cross.cross_density[k] / cross.input_density[k];
    frequency.push_back(cross.frequency_hz[k]);
    magnitude.push_back(20.0 * std::log10(std::abs(g)));
    phase.push_back(kDegrees * std::arg(g));
  }
  const auto vector = [](const std::vector<double>& v) {
    return VectorXd(Eigen::Map<const VectorXd>(v.data(), static_cast<Index>(v.size())));
  };
  BodeBand band;
  band.frequency_hz = vector(frequency);
  band.magnitude_db = vector(magnitude);
  band.phase_deg = vector(phase);
  return band;
}

void add_figure(HtmlPage& page, const Figure& figure, bool gnuplot) {
  if (!gnuplot) {
    page.missing_figure(figure.id, figure.title, kGnuplotMissing);
    return;
  }
  try {
    page.figure(figure.id, figure.title, gnuplot_svg(figure.script, figure.id, figure.width, figure.height),
                figure.caption, figure.width);
  } catch (const Error& error) {
    // A report without one picture is worth more than none.
    std::cerr << "blockid: " << error.what() << '\n';
    page.missing_figure(figure.id, figure.title, error.what());
  }
}

}  // namespace blockid::cli
