#include <blockid/cli/giordano2015_pictures.hpp>

#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/polynomial.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

constexpr Index kNonlinearityPoints = 200;
constexpr Index kFilterPoints = 200;
constexpr double kFilterDecades = 2.0;
/// Samples of the error signals that are shown.
constexpr Index kShownSamples = 200;

/// Poles and zeros of one filter as columns: real part, imaginary part.
std::string root_block(const std::string& name, const std::vector<std::complex<double>>& roots) {
  VectorXd real(std::ssize(roots));
  VectorXd imaginary(std::ssize(roots));
  for (Index k = 0; k < real.size(); ++k) {
    real[k] = roots[static_cast<std::size_t>(k)].real();
    imaginary[k] = roots[static_cast<std::size_t>(k)].imag();
  }
  return data_block(name, {real, imaginary});
}

/// The panel of a pole-zero map whose data blocks are called poles_NAME and zeros_NAME.
std::string map_panel(const std::string& name, const std::string& title, bool has_zeros) {
  std::string script =
      "set title " + plot_text(title) +
      "\nset size ratio -1\nset xrange [-1.2:1.2]\nset yrange [-1.2:1.2]\nset xlabel 'real'\nset ylabel "
      "'imaginary'\nset parametric\nset trange [0:2*pi]\nset samples 200\n"
      "plot cos(t), sin(t) with lines ls 4 notitle, $poles_" +
      name + " using 1:2 with points pt 2 ps 1.2 lw 2 lc rgb '#2563eb' title 'poles'";
  if (has_zeros)
    script += ", $zeros_" + name + " using 1:2 with points pt 6 ps 1.2 lw 2 lc rgb '#dc2626' title 'zeros'";
  return script + "\nunset parametric\n";
}

/// A filter of the chain: its place, its block, its numbers.
LeafBlock leaf(const Model& model, const std::string& path) {
  std::vector<LeafBlock> leaves = leaf_blocks(model);
  return *std::find_if(leaves.begin(), leaves.end(), [&](const LeafBlock& one) { return one.path == path; });
}

LinearRoots roots_of(const LeafBlock& filter) {
  return linear_roots(filter.block, filter.parameters).value_or(LinearRoots{});
}

Picture figure_2(const GiordanoPictures& shown) {
  const LinearRoots first = roots_of(leaf(shown.truth, "G1"));
  const LinearRoots second = roots_of(leaf(shown.truth, "G2"));
  return {"figure_2", "Poles and zeros of the two filters of the true system",
          root_block("poles_1", first.poles) + root_block("zeros_1", first.zeros) +
              root_block("poles_2", second.poles) + root_block("zeros_2", second.zeros) + "set multiplot layout 1,2\n" +
              map_panel("1", "G1", !first.zeros.empty()) + map_panel("2", "G2", !second.zeros.empty()) +
              "unset multiplot\n",
          900, 440};
}

/// The static block between filters of gain 1 at frequency zero, over the input v of the true one.
VectorXd curve_of(const Model& model, const VectorXd& v) {
  const LeafBlock first = leaf(model, "G1");
  const LeafBlock f = leaf(model, "f");
  const LeafBlock second = leaf(model, "G2");
  const double before = dc_gain(first.block, first.parameters).value_or(1.0);
  const double after = dc_gain(second.block, second.parameters).value_or(1.0);
  return after * curve_band(f.block, f.parameters, {}, before * v).f;
}

VectorXd inputs_of_f(const GiordanoPictures& shown) {
  const VectorXd v = leaf_inputs(shown.truth, shown.u)[1];
  return VectorXd::LinSpaced(kNonlinearityPoints, v.minCoeff(), v.maxCoeff());
}

/// Labels "alpha = 1.06" beside the upper root of each group.
std::string exponent_labels(const GiordanoPictures& shown) {
  std::string script;
  const auto add = [&](const std::vector<RootGroup>& groups, Index first, const std::string& symbol) {
    for (std::size_t k = 0; k < groups.size(); ++k) {
      const double exponent = shown.exponents[first + static_cast<Index>(k)];
      script += "set label " + plot_text(symbol + " = " + fixed_number(exponent, 2)) + " at " +
                number(groups[k].value.real(), 6) + "," + number(groups[k].value.imag(), 6) +
                " left offset 1,0 front textcolor rgb '" + (exponent > 0.5 ? "#b45309" : "#047857") + "'\n";
    }
  };
  add(shown.bla.poles, 0, "alpha");
  add(shown.bla.zeros, std::ssize(shown.bla.poles), "beta");
  return script;
}

Picture figure_3(const GiordanoPictures& shown) {
  const VectorXd v = inputs_of_f(shown);
  const std::vector<std::complex<double>> zeros = roots(shown.bla.zeros);
  return {"figure_3", "True nonlinearity; poles and zeros of the best linear approximation with their exponents in G1",
          data_block("f", {v, curve_of(shown.truth, v)}) + root_block("poles_bla", roots(shown.bla.poles)) +
              root_block("zeros_bla", zeros) +
              "set multiplot layout 1,2\nset title 'a) true nonlinearity'\nset xlabel 'v'\nset ylabel 'f(v)'\n"
              "plot $f using 1:2 with lines ls 1 notitle\n" +
              exponent_labels(shown) + map_panel("bla", "b) best linear approximation", !zeros.empty()) +
              "unset multiplot\n",
          900, 440};
}

Picture figure_4(const GiordanoPictures& shown) {
  return {
      "figure_4", "Root mean square errors of the steps over the noise",
      data_block("d", {VectorXd::LinSpaced(shown.from_bla.size(), 1.0, static_cast<double>(shown.from_bla.size())),
                       shown.from_bla, shown.from_product}) +
          "set logscale y\nset yrange [0.5:*]\nset xrange [0.4:5.6]\nset boxwidth 0.36\nset style fill solid 0.85 "
          "noborder\nset ylabel 'RMSE / noise'\nset xtics ('linear' 1, 'expansions' 2, 'alpha, beta, f' 3, "
          "'classified' 4, 'refitted' 5)\nplot $d using ($1-0.19):2 with boxes lc rgb '#2563eb' title 'from the best "
          "linear approximation', $d using ($1+0.19):3 with boxes lc rgb '#f59e0b' title 'from the true product', 1 "
          "with lines ls 3 title 'noise'\n",
      900, 400};
}

Picture figure_5(const GiordanoPictures& shown) {
  const VectorXd v = inputs_of_f(shown);
  return {"figure_5", "True and identified nonlinearity, filters of gain 1 at frequency zero",
          data_block("d", {v, curve_of(shown.truth, v), curve_of(shown.refitted, v)}) +
              "set xlabel 'v'\nset ylabel 'f(v)'\nplot $d using 1:2 with lines lc rgb '#9ca3af' lw 5 title 'true', $d "
              "using 1:3 with lines ls 2 title 'identified'\n",
          900, 400};
}

/// Responses of the best linear approximation and of the true product, which have the same shape: Bussgang's theorem
/// leaves one gain between them.
Picture bla_picture(const GiordanoPictures& shown) {
  const VectorXd frequency = logarithmic_frequencies(1.0, kFilterDecades, kFilterPoints);
  const auto response = [&](const LeafBlock& filter) {
    return bode_band(filter.block, filter.parameters, {}, frequency, 1.0);
  };
  const BodeBand first = response(leaf(shown.truth, "G1"));
  const BodeBand second = response(leaf(shown.truth, "G2"));
  const BodeBand bla = bode_band(shown.bla.model.chain, shown.bla.model.parameters, {}, frequency, 1.0);
  const VectorXd shape = first.magnitude_db + second.magnitude_db;
  const double gain = (bla.magnitude_db - shape).mean();
  return {
      "bla", "Best linear approximation and true product of the filters, its gain adjusted",
      data_block("d", {frequency, bla.magnitude_db, (shape.array() + gain).matrix(), bla.phase_deg,
                       first.phase_deg + second.phase_deg}) +
          "set logscale x\nset xrange [" + number(frequency[0]) +
          ":0.5]\nset multiplot layout 2,1\nset ylabel 'magnitude [dB]'\n"
          "plot $d using 1:3 with lines lc rgb '#9ca3af' lw 5 title 'true product', $d using 1:2 with lines ls 2 "
          "title 'best linear approximation'\nset xlabel 'frequency [1 / sample]'\nset ylabel 'phase [deg]'\nunset "
          "key\nplot $d using 1:5 with lines lc rgb '#9ca3af' lw 5, $d using 1:4 with lines ls 2\nunset multiplot\n",
      900, 480};
}

Picture errors_picture(const GiordanoPictures& shown) {
  std::string data;
  std::string panels = "set multiplot layout " + std::to_string(shown.errors.size()) +
                       ",1\nset xrange [0:" + std::to_string(kShownSamples - 1) + "]\nset lmargin 11\nunset key\n";
  const VectorXd samples = VectorXd::LinSpaced(kShownSamples, 0.0, static_cast<double>(kShownSamples - 1));
  for (std::size_t k = 0; k < shown.errors.size(); ++k) {
    const std::string name = "e" + std::to_string(k);
    data += data_block(name, {samples, shown.errors[k].error.head(kShownSamples) / shown.noise});
    panels += "set title " + plot_text(shown.errors[k].name) + "\n";
    if (k + 1 == shown.errors.size()) panels += "set xlabel 'sample'\n";
    panels += "set ylabel 'error / noise'\nplot $" + name + " using 1:2 with lines ls 3\n";
  }
  return {"errors", "Errors of the steps as signals, the first samples", data + panels + "unset multiplot\n", 900, 760};
}

}  // namespace

std::vector<Picture> giordano2015_pictures(const GiordanoPictures& shown) {
  std::vector<Picture> pictures = {figure_2(shown), figure_3(shown),    figure_4(shown),
                                   figure_5(shown), bla_picture(shown), errors_picture(shown)};
  for (Picture& picture : pictures) picture.script = kFigureStyles + picture.script;
  return pictures;
}

}  // namespace blockid::cli
