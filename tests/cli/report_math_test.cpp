// Correlations, spectra, bands and envelopes against what they must be.
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/report/bode_band.hpp>
#include <blockid/cli/report/envelope.hpp>
#include <blockid/cli/report/histogram.hpp>
#include <blockid/problems/gaussian.hpp>
#include <blockid/validation/spectrum.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace blockid;
using namespace blockid::cli;
using blockid::problems::Gaussian;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Index>(values.size()));
}

TEST(Spectrum, MeanSquareIsTheIntegral) {
  Gaussian gaussian(7);
  const VectorXd x = 3.0 * gaussian.vector(200000);
  const double sample_time_s = 1e-3;
  const Spectrum s = welch(x, sample_time_s, 1024);
  ASSERT_EQ(s.frequency_hz.size(), 513);
  EXPECT_DOUBLE_EQ(s.frequency_hz[512], 500.0);
  const double step = s.frequency_hz[1];
  EXPECT_NEAR(s.density.sum() * step, 9.0, 0.1);
  // White: 2 sigma^2 Ts everywhere.
  EXPECT_NEAR(s.density.segment(100, 200).mean(), 2.0 * 9.0 * sample_time_s, 2e-4);
}

TEST(Spectrum, SineStandsAtItsFrequencyWithItsPower) {
  const double sample_time_s = 0.01;
  VectorXd x(10000);
  for (Index t = 0; t < x.size(); ++t) {
    x[t] = 5.0 + 2.0 * std::sin(2.0 * std::numbers::pi * 12.5 * sample_time_s * static_cast<double>(t));
  }
  const Spectrum s = welch(x, sample_time_s, 512);
  Index place = 0;
  s.density.maxCoeff(&place);
  EXPECT_NEAR(s.frequency_hz[place], 12.5, 1e-9);
  EXPECT_NEAR(s.density.sum() * s.frequency_hz[1], 2.0, 1e-2);
}

TEST(Spectrum, CrossSpectrumShowsTheFilter) {
  Gaussian gaussian(9);
  const VectorXd u = gaussian.vector(100000);
  Model model = make_model(Rational(1, 1));
  model.parameters = vector({0.5, 0.2, -0.7});
  const VectorXd y = simulate(model, u);
  const CrossSpectrum s = welch_cross(u, y, 1.0, 512);
  for (const Index k : {20, 100, 200}) {
    const std::complex<double> g = s.cross_density[k] / s.input_density[k];
    const std::complex<double> truth =
        *model.chain.frequency_response({model.parameters.data(), 3}, 2.0 * std::numbers::pi * s.frequency_hz[k]);
    EXPECT_NEAR(std::abs(g - truth), 0.0, 0.02 * std::abs(truth));
  }
}

TEST(Spectrum, SegmentsSuitTheRecord) {
  EXPECT_EQ(segment_length(100), 64);
  EXPECT_EQ(segment_length(8 * 256), 256);
  EXPECT_EQ(segment_length(10'000'000), 4096);
}

TEST(BodeBand, AgreesWithMonteCarlo) {
  const AnyBlock block = Rational(1, 2);
  const VectorXd theta = vector({0.4, 0.1, -1.2, 0.5});
  MatrixXd root(4, 4);
  root << 4, 0, 0, 0, -1, 3, 0, 0, 1, 1, 2, 0, 0, -1, 1, 1;
  root *= 1e-3;
  const MatrixXd covariance = root * root.transpose();
  const VectorXd frequencies = vector({1.0, 50.0, 120.0, 400.0});
  const double sample_time_s = 1e-3;
  const BodeBand band = bode_band(block, theta, covariance, frequencies, sample_time_s);

  Gaussian gaussian(11);
  constexpr int kDraws = 20000;
  VectorXd magnitude_square = VectorXd::Zero(4);
  VectorXd phase_square = VectorXd::Zero(4);
  for (int draw = 0; draw < kDraws; ++draw) {
    const VectorXd moved = theta + root * gaussian.vector(4);
    const BodeBand one = bode_band(block, moved, MatrixXd(), frequencies, sample_time_s);
    magnitude_square += (one.magnitude_db - band.magnitude_db).cwiseAbs2();
    phase_square += (one.phase_deg - band.phase_deg).cwiseAbs2();
  }
  for (Index k = 0; k < 4; ++k) {
    const double magnitude = std::sqrt(magnitude_square[k] / kDraws);
    const double phase = std::sqrt(phase_square[k] / kDraws);
    EXPECT_NEAR(band.magnitude_deviation_db[k], magnitude, 0.04 * magnitude) << k;
    EXPECT_NEAR(band.phase_deviation_deg[k], phase, 0.04 * phase) << k;
  }
}

TEST(BodeBand, OfTheDelayIsItsPhase) {
  const BodeBand band =
      bode_band(Rational(0, 0, 3), vector({2.0}), MatrixXd(), VectorXd::LinSpaced(10, 50.0, 500.0), 1e-3);
  EXPECT_NEAR(band.magnitude_db[1], 20.0 * std::log10(2.0), 1e-12);
  EXPECT_NEAR(band.phase_deg[1], -108.0, 1e-9);
  EXPECT_NEAR(band.phase_deg[9], -540.0, 1e-9) << "unwrapped";
  EXPECT_EQ(band.magnitude_deviation_db.norm(), 0.0);
}

TEST(BodeBand, FrequenciesEndAtNyquist) {
  const VectorXd f = logarithmic_frequencies(1e-3, 3.0, 4);
  EXPECT_NEAR(f[0], 0.5, 1e-12);
  EXPECT_NEAR(f[1], 5.0, 1e-12);
  EXPECT_EQ(f[3], 500.0);
}

TEST(CurveBand, IsExactForFunctionsThatAreLinearInTheirParameters) {
  const Spline spline(4, SignalRange{-1.0, 1.0});
  const VectorXd theta = spline.coefficients_of([](double u) { return u * u; });
  const MatrixXd covariance = 1e-4 * MatrixXd::Identity(theta.size(), theta.size());
  // At the first knot the spline is its first coefficient.
  const CurveBand band = curve_band(spline, theta, covariance, vector({-1.0, 0.0, 1.0}));
  EXPECT_NEAR(band.f[0], 1.0, 1e-12);
  EXPECT_NEAR(band.deviation[0], 0.01, 1e-9);
  EXPECT_NEAR(band.deviation[2], 0.01, 1e-9);
  EXPECT_LT(band.deviation[1], 0.01);
}

TEST(Envelope, KeepsEveryPeakAndHasNoGaps) {
  VectorXd x = VectorXd::Zero(1003);
  x[517] = 4.0;
  x[519] = -3.0;
  x[900] = std::nan("");
  const Envelope e = envelope(x, 100);
  ASSERT_LE(e.lower.size(), 100);
  EXPECT_EQ(e.upper.maxCoeff(), 4.0);
  EXPECT_EQ(e.lower.minCoeff(), -3.0);
  EXPECT_TRUE(e.lower.allFinite());
  EXPECT_TRUE((e.lower.array() <= e.upper.array()).all());
  EXPECT_EQ(e.position[0], 5.0) << "buckets of 11 samples";
  // A ramp: each bucket begins where the one before ended.
  const Envelope ramp = envelope(VectorXd::LinSpaced(1000, 0.0, 999.0), 100);
  for (Index k = 1; k < ramp.lower.size(); ++k) EXPECT_EQ(ramp.lower[k], ramp.upper[k - 1]);
}

TEST(Envelope, ShortRecordsStayWhole) {
  const VectorXd x = vector({3, 1, 2});
  const Envelope e = envelope(x, 400);
  EXPECT_EQ(e.upper.size(), 3);
  EXPECT_EQ(e.position, vector({0, 1, 2}));
  EXPECT_EQ(envelope(vector({std::nan(""), std::nan("")}), 1).lower.size(), 1);
}

TEST(WorstStretch, IsFound) {
  VectorXd e = VectorXd::Constant(1000, 0.1);
  e[700] = 5.0;
  const Index begin = worst_stretch(e, 100);
  EXPECT_LE(begin, 700);
  EXPECT_GT(begin + 100, 700);
  EXPECT_EQ(worst_stretch(e, 5000), 0);
}

TEST(Histogram, CountsEverySample) {
  const Histogram h = histogram(vector({0, 0.4, 1, 1.2, 2}), 2);
  EXPECT_EQ(h.centre, vector({0.5, 1.5}));
  EXPECT_EQ(h.width, 1.0);
  EXPECT_DOUBLE_EQ(h.share[0], 0.4);
  EXPECT_DOUBLE_EQ(h.share[1], 0.6);
  EXPECT_EQ(histogram(vector({7, 7}), 5).share.sum(), 1.0);
}

TEST(LeafBlocks, PathsOffsetsAndSignals) {
  Model model = make_model(parse("A=rational(nb=0,na=1) | [B=gain + C=(D=gain | f=polynomial(degree=1))]"));
  const std::vector<std::string> names = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) model.parameters[k] = 0.1 * static_cast<double>(k + 1);
  const std::vector<LeafBlock> leaves = leaf_blocks(model);
  ASSERT_EQ(leaves.size(), 4u);
  for (const LeafBlock& leaf : leaves) {
    for (Index k = 0; k < leaf.parameters.size(); ++k) {
      EXPECT_EQ(names[static_cast<std::size_t>(leaf.offset + k)],
                leaf.path + "." + leaf.block.parameter_names()[static_cast<std::size_t>(k)]);
      EXPECT_EQ(leaf.parameters[k], model.parameters[leaf.offset + k]);
    }
  }
  const VectorXd u = vector({1, -1, 2, 0.5});
  const std::vector<VectorXd> inputs = leaf_inputs(model, u);
  ASSERT_EQ(inputs.size(), 4u);
  EXPECT_EQ(inputs[0], u);
  EXPECT_EQ(inputs[1], inputs[2]) << "branches share their input";
  EXPECT_TRUE(inputs[3].isApprox(leaves[2].parameters[0] * inputs[2]));
}

TEST(LinearRoots, OfRationalFirAndBiquads) {
  const std::optional<LinearRoots> rational = linear_roots(Rational(1, 2, 1), vector({2.0, -1.0, -1.2, 0.45}));
  ASSERT_TRUE(rational);
  ASSERT_EQ(rational->zeros.size(), 1u);
  EXPECT_NEAR(rational->zeros[0].real(), 0.5, 1e-12);
  ASSERT_EQ(rational->poles.size(), 2u);
  EXPECT_NEAR(std::abs(rational->poles[0].imag()), 0.3, 1e-12);
  EXPECT_NEAR(natural_frequency_hz(rational->poles[0], 0.01),
              std::abs(std::log(std::complex<double>(0.6, 0.3))) / (2.0 * std::numbers::pi * 0.01), 1e-9);

  const AnyBlock biquads = parse("biquads(sections=1)").children().front().block;
  const std::optional<LinearRoots> sections = linear_roots(biquads, vector({3.0, 0.0, 0.0, -1.2, 0.45}));
  ASSERT_TRUE(sections);
  EXPECT_EQ(sections->zeros.size(), 0u) << "zeros at the origin are left out";
  EXPECT_EQ(sections->poles.size(), 2u);
  EXPECT_FALSE(linear_roots(parse("polynomial(degree=2)").children().front().block, vector({1.0, 2.0, 3.0})));
  EXPECT_EQ(dc_gain(Rational(0, 1), vector({1.0, -0.5})), 2.0);
}

}  // namespace
