// Loops of several inputs and outputs: realisations, factors, Bezout's identity, signals; one channel as the oracle.
#include "mimo_loops.hpp"

#include "data/message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <complex>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

/// Filters of some ten states with signals of size one, whose rounding the loops pass on by less than some 100.
constexpr double kTolerance = 1e-11;

double largest(const MatrixXd& m) { return m.size() == 0 ? 0.0 : m.cwiseAbs().maxCoeff(); }

MatrixXd stacked(const MatrixXd& above, const MatrixXd& below) {
  MatrixXd both(above.rows() + below.rows(), above.cols());
  both << above, below;
  return both;
}

/// G H.
DiscreteStateSpace product(const DiscreteStateSpace& g, const DiscreteStateSpace& h) {
  const Index n = g.states() + h.states();
  DiscreteStateSpace s{MatrixXd::Zero(n, n), MatrixXd(n, h.inputs()), MatrixXd(g.outputs(), n), g.d * h.d};
  s.a.topLeftCorner(g.states(), g.states()) = g.a;
  s.a.topRightCorner(g.states(), h.states()) = g.b * h.c;
  s.a.bottomRightCorner(h.states(), h.states()) = h.a;
  s.b << g.b * h.d, h.b;
  s.c << g.c, g.d * h.c;
  return s;
}

/// G + factor H.
DiscreteStateSpace sum(const DiscreteStateSpace& g, const DiscreteStateSpace& h, double factor) {
  const Index n = g.states() + h.states();
  DiscreteStateSpace s{MatrixXd::Zero(n, n), stacked(g.b, h.b), MatrixXd(g.outputs(), n), g.d + factor * h.d};
  s.a.topLeftCorner(g.states(), g.states()) = g.a;
  s.a.bottomRightCorner(h.states(), h.states()) = h.a;
  s.c << g.c, factor * h.c;
  return s;
}

DiscreteStateSpace inverse(const DiscreteStateSpace& s) {
  const MatrixXd d = s.d.inverse();
  return {s.a - s.b * d * s.c, s.b * d, -d * s.c, d};
}

TEST(DiscreteStateSpace, RealisesTransferFunctions) {
  const DiscreteTransferFunction g{polynomial({0.0, 2.0, -0.3}), polynomial({2.0, -1.0, 0.4, 0.1})};
  const DiscreteTransferFunction h{polynomial({1.0, 0.5, 0.2, 0.1}), polynomial({1.0, -0.9})};
  const MatrixXd u = normal_matrix(2, 60, 1);
  const MatrixXd y = filter(transfer_matrix({{g, h}}), u);
  const VectorXd expected = filter(g, VectorXd(u.row(0))) + filter(h, VectorXd(u.row(1)));
  EXPECT_LT(largest(y - expected.transpose()), kTolerance);
}

// One integrator behind the sum of two inputs, seen by two outputs, is one state, though four entries have it.
TEST(DiscreteStateSpace, MinimalHasNoSuperfluousStates) {
  const DiscreteTransferFunction integrator = first_order(1.0, 1.0);
  const DiscreteStateSpace s = transfer_matrix({{integrator, integrator}, {integrator, integrator}});
  EXPECT_EQ(s.states(), 1);
  const MatrixXd u = normal_matrix(2, 40, 2);
  const VectorXd expected = filter(integrator, VectorXd(u.colwise().sum()));
  EXPECT_LT(largest(filter(s, u).row(0) - expected.transpose()), kTolerance);
  EXPECT_LT(largest(filter(s, u).row(1) - expected.transpose()), kTolerance);
  const DiscreteStateSpace plant = observer_loop().plant;
  const DiscreteStateSpace twice = sum(plant, plant, 1.0);
  EXPECT_EQ(minimal(twice).states(), plant.states());
  const MatrixXd v = normal_matrix(3, 20, 3);
  EXPECT_LT(largest(filter(minimal(twice), v) - 2.0 * filter(plant, v)), 1e-9);
}

// det(z - A - B F) = (z - pole)^4 (z - 0.5), at points away from the poles: the poles themselves are of multiplicity 4.
TEST(DiscreteStateSpace, FeedbackMovesTheUnstablePolesOnly) {
  const DiscreteStateSpace g = observer_loop().plant;
  const double pole = 0.3;
  const MatrixXd moved = g.a + g.b * stabilising_feedback(g.a, g.b, pole);
  for (const std::complex<double> z : {std::complex<double>(1.0, 0.0), {-1.0, 0.5}, {0.0, 2.0}, {0.7, -0.7}}) {
    const Eigen::MatrixXcd pencil = z * MatrixXd::Identity(5, 5) - moved;
    const std::complex<double> expected = std::pow(z - pole, 4) * (z - 0.5);
    EXPECT_LT(std::abs(pencil.determinant() - expected), 1e-9 * std::abs(expected)) << z;
  }
  const MatrixXd stable = 0.5 * orthogonal(4, 4);
  EXPECT_TRUE(stabilising_feedback(stable, normal_matrix(4, 2, 5), 0.3).isZero(0.0));
}

class Factors : public ::testing::TestWithParam<MimoLoop (*)()> {
 protected:
  const MimoLoop loop_ = GetParam()();
};

TEST_P(Factors, AreStableAndMultiplyToTheSystem) {
  for (const DiscreteStateSpace& g : {loop_.plant, loop_.controller}) {
    const RightFactors right = right_factors(g, loop_.factor_pole);
    const LeftFactors left = left_factors(g, loop_.factor_pole);
    EXPECT_LT(spectral_radius(right.denominator), 0.95);
    EXPECT_LT(spectral_radius(left.denominator), 0.95);
    // The system may be unstable: what it makes of 25 samples of rounding is in units of its own response.
    const MatrixXd q = normal_matrix(g.inputs(), 25, 6);
    const double size = 1.0 + largest(filter(g, q)) * (1.0 + largest(filter(right.denominator, q)));
    EXPECT_LT(largest(filter(g, filter(right.denominator, q)) - filter(right.numerator, q)), 1e-12 * size);
    EXPECT_LT(largest(filter(left.denominator, filter(g, q)) - filter(left.numerator, q)), 1e-12 * size);
    EXPECT_GT(largest(filter(right.numerator, q)), 0.1);
  }
}

// [D~c, N~c; -N~, D~] [Dhat, -Nc; Nhat, Dc] = diag(M, L) with M and L units: stable, and so are their inverses.
TEST_P(Factors, KeepBezoutsIdentity) {
  const RightFactors p = right_factors(loop_.plant, loop_.factor_pole);
  const LeftFactors pl = left_factors(loop_.plant, loop_.factor_pole);
  const RightFactors c = right_factors(loop_.controller, loop_.factor_pole);
  const LeftFactors cl = left_factors(loop_.controller, loop_.factor_pole);
  const MatrixXd x = normal_matrix(loop_.plant.inputs(), 80, 7);
  const MatrixXd w = normal_matrix(loop_.plant.outputs(), 80, 8);
  const double size = largest(filter(cl.numerator, filter(c.denominator, w)));
  EXPECT_LT(largest(filter(cl.numerator, filter(c.denominator, w)) - filter(cl.denominator, filter(c.numerator, w))),
            kTolerance * (1.0 + size));
  EXPECT_LT(largest(filter(pl.denominator, filter(p.numerator, x)) - filter(pl.numerator, filter(p.denominator, x))),
            kTolerance * (1.0 + largest(filter(pl.numerator, filter(p.denominator, x)))));
  const DiscreteStateSpace m = sum(product(cl.denominator, p.denominator), product(cl.numerator, p.numerator), 1.0);
  const DiscreteStateSpace l = sum(product(pl.denominator, c.denominator), product(pl.numerator, c.numerator), 1.0);
  EXPECT_LT(spectral_radius(minimal(inverse(m))), 1.0 - 1e-3);
  EXPECT_LT(spectral_radius(minimal(inverse(l))), 1.0 - 1e-3);
  EXPECT_LT(largest(filter(inverse(m), filter(m, x)) - x), 1e-9);
  EXPECT_LT(largest(filter(inverse(l), filter(l, w)) - w), 1e-9);
}

// The formula with left factors, computed as it is written, from signals that no loop has made.
TEST_P(Factors, SignalsAreThoseOfTheLeftFactors) {
  const RightFactors p = right_factors(loop_.plant, loop_.factor_pole);
  const LeftFactors pl = left_factors(loop_.plant, loop_.factor_pole);
  const RightFactors c = right_factors(loop_.controller, loop_.factor_pole);
  const LeftFactors cl = left_factors(loop_.controller, loop_.factor_pole);
  const MatrixXd u = normal_matrix(loop_.plant.inputs(), 100, 9);
  const MatrixXd y = normal_matrix(loop_.plant.outputs(), 100, 10);
  const MimoSignals signals = uncertainty_signals(loop_, u, y);
  const MatrixXd x = filter(inverse(loop_.weight), signals.v);
  const MatrixXd first = filter(cl.denominator, u) + filter(cl.numerator, y);
  const MatrixXd second = filter(pl.denominator, y) - filter(pl.numerator, u);
  const MatrixXd mx = filter(cl.denominator, filter(p.denominator, x)) + filter(cl.numerator, filter(p.numerator, x));
  const MatrixXd lw =
      filter(pl.denominator, filter(c.denominator, signals.w)) + filter(pl.numerator, filter(c.numerator, signals.w));
  EXPECT_LT(largest(mx - first), 1e-9 * (1.0 + largest(first)));
  EXPECT_LT(largest(lw - second), 1e-9 * (1.0 + largest(second)));
}

// A loop with a known uncertainty: u and y give back the reference, v of the reference and w = Delta v + delta.
TEST_P(Factors, RecordsGiveBackReferenceAndUncertainty) {
  const Index m = loop_.plant.inputs();
  const Index p = loop_.plant.outputs();
  const DiscreteStateSpace delta = all_pass_uncertainty(p, m, 0.3, 11);
  const MatrixXd r = normal_matrix(m, 120, 12);
  const MatrixXd d = 0.1 * normal_matrix(p, 120, 13);
  const MimoUncertainRecord run = simulate_uncertain_loop(loop_, delta, r, d);
  const double size = 1.0 + largest(run.record.u) + largest(run.record.y);
  // The observer's controller is unstable in itself: 120 samples of its open response.
  const double open = std::pow(std::max(1.0, spectral_radius(loop_.controller)), 120.0);
  EXPECT_LT(reference_error(loop_.controller, run.record.u, run.record.y, r), 1e-11 * size * open);
  const MimoSignals signals = uncertainty_signals(loop_, run.record.u, run.record.y);
  EXPECT_LT(largest(signals.v - uncertainty_input(loop_, r)), 1e-10 * size);
  EXPECT_LT(largest(signals.w - filter(delta, signals.v) - run.delta), 1e-10 * size);
  EXPECT_LT(largest(signals.v - run.signals.v), 1e-10 * size);
  EXPECT_LT(largest(signals.w - run.signals.w), 1e-10 * size);
  EXPECT_GT(largest(run.delta), 1e-3);
}

// (Nhat + Dc Delta V) (Dhat - Nc Delta V)^-1 multiplied out, in a loop that is simulated sample by sample.
TEST_P(Factors, UncertainLoopIsTheLoopOfItsPlant) {
  const Index m = loop_.plant.inputs();
  const Index p = loop_.plant.outputs();
  const DiscreteStateSpace delta = all_pass_uncertainty(p, m, 0.3, 14);
  const RightFactors g = right_factors(loop_.plant, loop_.factor_pole);
  const RightFactors c = right_factors(loop_.controller, loop_.factor_pole);
  const DiscreteStateSpace spread = product(delta, loop_.weight);
  const DiscreteStateSpace numerator = sum(g.numerator, product(c.denominator, spread), 1.0);
  const DiscreteStateSpace denominator = sum(g.denominator, product(c.numerator, spread), -1.0);
  const DiscreteStateSpace plant = product(numerator, inverse(denominator));
  const MatrixXd r = normal_matrix(m, 60, 15);
  const MatrixXd d = 0.1 * normal_matrix(p, 60, 16);
  const MimoRecord direct = simulate_closed_loop(plant, loop_.controller, r, d);
  const MimoRecord record = simulate_uncertain_loop(loop_, delta, r, d).record;
  // The plant has hidden modes that cancel, unstable ones among them: their rounding grows for 60 samples.
  const double size = 1.0 + largest(direct.u) + largest(direct.y);
  EXPECT_LT(largest(record.u - direct.u), 1e-6 * size);
  EXPECT_LT(largest(record.y - direct.y), 1e-6 * size);
  const MimoRecord nominal = simulate_closed_loop(loop_.plant, loop_.controller, r, d);
  EXPECT_GT(largest(nominal.y - direct.y), 1e-2);
}

TEST_P(Factors, ATrueModelLeavesNothing) {
  const MatrixXd r = normal_matrix(loop_.plant.inputs(), 100, 17);
  const MimoRecord record =
      simulate_closed_loop(loop_.plant, loop_.controller, r, MatrixXd::Zero(loop_.plant.outputs(), 100));
  const MimoSignals signals = uncertainty_signals(loop_, record.u, record.y);
  EXPECT_LT(largest(signals.w), 1e-10 * (1.0 + largest(record.u) + largest(record.y)));
  EXPECT_GT(largest(signals.v), 0.1);
}

INSTANTIATE_TEST_SUITE_P(MimoLoops, Factors, ::testing::Values(&integral_loop, &observer_loop, &tall_loop),
                         [](const auto& p) { return loop_name(p.index); });

struct OneChannel {
  UncertainLoop scalar;
  MimoLoop matrix;
};

OneChannel one_channel(const DiscreteTransferFunction& plant, const DiscreteTransferFunction& controller,
                       const DiscreteTransferFunction& weight, double pole) {
  return {{coprime_factors(plant, pole), coprime_factors(controller, pole), weight},
          {state_space(plant), state_space(controller), state_space(weight), pole}};
}

void expect_same(const OneChannel& loop) {
  const MatrixXd r = normal_matrix(1, 200, 18);
  const MatrixXd d = 0.05 * normal_matrix(1, 200, 19);
  const DiscreteTransferFunction delta{polynomial({-0.2, 0.4}), polynomial({1.0, -0.5})};
  const UncertainRecord scalar = simulate_uncertain_loop(loop.scalar, delta, r.transpose(), d.transpose());
  const MimoUncertainRecord matrix = simulate_uncertain_loop(loop.matrix, state_space(delta), r, d);
  const double size = 1.0 + largest(matrix.record.u) + largest(matrix.record.y);
  EXPECT_LT(largest(matrix.record.u - scalar.record.u.transpose()), 1e-10 * size);
  EXPECT_LT(largest(matrix.record.y - scalar.record.y.transpose()), 1e-10 * size);
  EXPECT_LT(largest(matrix.delta - scalar.delta.transpose()), 1e-10 * size);
  const UncertaintySignals expected = uncertainty_signals(loop.scalar, scalar.record.u, scalar.record.y);
  const MimoSignals got = uncertainty_signals(loop.matrix, scalar.record.u.transpose(), scalar.record.y.transpose());
  EXPECT_LT(largest(got.v - expected.v.transpose()), 1e-10 * size);
  EXPECT_LT(largest(got.w - expected.w.transpose()), 1e-10 * size);
  EXPECT_EQ(uncertainty_memory(loop.matrix), uncertainty_memory(loop.scalar));
}

TEST(MimoLoop, OneChannelIsTheScalarLoop) {
  const CrowderLoop crowder;
  expect_same(one_channel(crowder.model, crowder.controller, crowder.ok().weight, crowder.p));
  // A pole outside the circle, and a double integrator, each under a controller that places all poles.
  expect_same(one_channel(first_order(1.0, 1.3), {polynomial({0.9}), polynomial({1.0})},
                          {polynomial({0.2, -0.05}), polynomial({1.0, -0.3})}, 0.6));
  expect_same(one_channel({polynomial({0.0, 0.5, 0.5}), polynomial({1.0, -2.0, 1.0})},
                          {polynomial({1.2, -1.0}), polynomial({1.0, 0.2})}, {polynomial({0.2}), polynomial({1.0})},
                          0.6));
}

TEST(MimoLoop, SaturationShowsInTheReference) {
  const MimoLoop loop = integral_loop();
  const MatrixXd r = normal_matrix(2, 80, 20);
  const MimoRecord record = simulate_closed_loop(loop.plant, loop.controller, r, MatrixXd::Zero(2, 80));
  EXPECT_LT(reference_error(loop.controller, record.u, record.y, r), kTolerance);
  EXPECT_GT(reference_error(loop.controller, record.u.cwiseMin(1.0), record.y, r), 0.1);
}

TEST(MimoLoop, MistakesAreNamed) {
  const MimoLoop good = integral_loop();
  const MatrixXd two = MatrixXd::Zero(2, 10);
  const auto of = [&](const auto& change) {
    MimoLoop loop = good;
    change(loop);
    return message_of([&] { check(loop); });
  };
  EXPECT_THAT(of([](MimoLoop& l) { l.controller.c *= -1.0; }), HasSubstr("expected a controller that stabilises"));
  EXPECT_THAT(of([](MimoLoop& l) { l.weight.d.setOnes(); }), HasSubstr("biproper"));
  EXPECT_THAT(of([](MimoLoop& l) { l.weight.a *= 3.0; }), HasSubstr("weight: expected"));
  EXPECT_THAT(of([](MimoLoop& l) { l.weight.c *= 20.0; }), HasSubstr("zeros inside the unit circle"));
  EXPECT_THAT(of([](MimoLoop& l) { l.weight = static_gain(MatrixXd::Identity(3, 3)); }),
              HasSubstr("weight: expected 2 inputs and outputs"));
  EXPECT_THAT(of([](MimoLoop& l) { l.controller = static_gain(MatrixXd::Ones(1, 2)); }),
              HasSubstr("controller: expected 2 inputs and 2 outputs"));
  EXPECT_THAT(of([](MimoLoop& l) { l.plant.b.resize(1, 2); }), HasSubstr("plant: expected A (n, n)"));
  EXPECT_THAT(of([](MimoLoop& l) { l.plant.a(0, 0) = std::nan(""); }), HasSubstr("finite"));
  EXPECT_THAT(of([](MimoLoop& l) { l.factor_pole = 1.0; }), HasSubstr("inside the unit circle, got 1"));
  EXPECT_THAT(message_of([&] { uncertainty_signals(good, two, two); }), HasSubstr("v is zero"));
  EXPECT_THAT(message_of([&] { uncertainty_signals(good, two, MatrixXd::Zero(2, 9)); }),
              HasSubstr("output: expected 2 channels of 10 samples, got 2 of 9"));
  EXPECT_THAT(message_of([&] { uncertainty_signals(good, MatrixXd::Zero(1, 10), two); }),
              HasSubstr("input: expected 2 channels of 10 samples, got 1 of 10"));
  EXPECT_THAT(message_of([&] { simulate_uncertain_loop(good, static_gain(MatrixXd::Ones(1, 2)), two, two); }),
              HasSubstr("uncertainty: expected 2 inputs and 2 outputs, got 2 and 1"));
  DiscreteStateSpace growing = all_pass_uncertainty(2, 2, 0.5, 1);
  growing.a *= 3.0;
  EXPECT_THAT(message_of([&] { simulate_uncertain_loop(good, growing, two, two); }),
              HasSubstr("inside the unit circle"));
  EXPECT_THAT(message_of([&] { uncertainty_memory(good, 1.0); }), HasSubstr("between 0 and 1"));
  EXPECT_THAT(message_of([&] { transfer_matrix({{first_order(1.0, 0.5)}, {}}); }), HasSubstr("expected rows of 1"));
  EXPECT_THAT(message_of([&] { filter(good.plant, MatrixXd::Zero(3, 5)); }), HasSubstr("expected 2 inputs, got 3"));
  // An integrator that no input reaches: nothing can move it.
  EXPECT_THAT(message_of([] { stabilising_feedback(MatrixXd::Identity(2, 2), MatrixXd::Ones(2, 1), 0.5); }),
              HasSubstr("no input reaches"));
}

// The integrator of a controller that its output does not show stays in the loop.
TEST(MimoLoop, HiddenModesAreNoStableLoop) {
  MimoLoop loop = integral_loop();
  loop.controller.c.setZero();
  EXPECT_THAT(message_of([&] { check(loop); }), HasSubstr("closed-loop pole of modulus 1"));
}

}  // namespace
}  // namespace blockid::testing
