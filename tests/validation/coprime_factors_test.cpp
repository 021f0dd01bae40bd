// Coprime factors and the signals of the uncertainty: values of an independent computation, identities, errors.
#include "crowder_loop.hpp"

#include "data/message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace blockid::testing {
namespace {

using Eigen::VectorXd;

/// Each sample is rounded some ten times at 1e-16 of signals below 4, and the filters pass that on with an absolute sum
/// of their impulse responses, which the test of the tolerance sums, below 250: below 1e-12.
constexpr double kTolerance = 1e-12;

TEST(CoprimeFactors, PublishedLoopGivesTheValuesOfAnIndependentPrototype) {
  const CrowderLoop crowder;
  const VectorXd r = normal_reference(501);
  EXPECT_NEAR(r[0], -0.19258034021082279, kTolerance);
  EXPECT_NEAR(r[1], -1.020844986803900, kTolerance);
  EXPECT_NEAR(r[499], 2.227050575176636, kTolerance);
  const ClosedLoopRecord record = simulate_closed_loop(crowder.plant, crowder.controller, r, VectorXd::Zero(501));
  EXPECT_NEAR(record.u[199], -0.7802877034313961, kTolerance);
  EXPECT_NEAR(record.y[199], 0.1584039497430480, kTolerance);
  const UncertaintySignals ok = uncertainty_signals(crowder.ok(), record.u, record.y);
  EXPECT_NEAR(ok.v[0], -0.004367722115981463, kTolerance);
  EXPECT_NEAR(ok.v[199], -0.002164184770979002, kTolerance);
  EXPECT_NEAR(ok.w[1], -0.0004735259772220557, kTolerance);
  EXPECT_NEAR(ok.w[199], 0.06658709308437652, kTolerance);
  EXPECT_NEAR(ok.v[499], 0.07741894292541648, kTolerance);
  EXPECT_NEAR(ok.w[499], -0.01705856958210325, kTolerance);
  EXPECT_NEAR(ok.w.cwiseAbs().maxCoeff(), 0.17608503594122, kTolerance);
  const UncertaintySignals trivial = uncertainty_signals(crowder.trivial(), record.u, record.y);
  EXPECT_NEAR(trivial.w.cwiseAbs().maxCoeff(), 0.143137813080956, kTolerance);
  EXPECT_NEAR(trivial.w[199], 0.04455400228454101, kTolerance);
}

// An error made in u or y passes the filters from u and y to v and w.
TEST(CoprimeFactors, RoundingIsPassedOnLessThan250Times) {
  const UncertainLoop loop = CrowderLoop{}.ok();
  const VectorXd zero = VectorXd::Zero(501);
  const VectorXd impulse = VectorXd::Unit(501, 0);
  for (const UncertaintySignals& response :
       {uncertainty_signals(loop, impulse, zero), uncertainty_signals(loop, zero, impulse)}) {
    EXPECT_LT(response.v.cwiseAbs().sum(), 250.0);
    EXPECT_LT(response.w.cwiseAbs().sum(), 250.0);
  }
}

TEST(CoprimeFactors, ReferenceGivesTheSameInput) {
  const CrowderLoop crowder;
  const VectorXd r = normal_reference(501);
  const ClosedLoopRecord record = simulate_closed_loop(crowder.plant, crowder.controller, r, VectorXd::Zero(501));
  const UncertaintySignals signals = uncertainty_signals(crowder.ok(), record.u, record.y);
  EXPECT_LT((uncertainty_input(crowder.ok(), r) - signals.v).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_LT(reference_error(crowder.controller, record.u, record.y, r), kTolerance);
  const VectorXd clipped = record.u.cwiseMin(1.0);
  EXPECT_GT(reference_error(crowder.controller, clipped, record.y, r), 0.1);
}

// A record that begins in mid-experiment, under a controller without poles: only the samples that its delays reach
// before the record do not fit.
TEST(CoprimeFactors, RecordThatBeginsLateFailsTheReferenceInItsFirstSamplesOnly) {
  const DiscreteTransferFunction controller{polynomial({1.5, 0.0, -1.0}), polynomial({1.0})};
  const DiscreteTransferFunction plant{polynomial({0.0, 0.3}), polynomial({1.0, -0.9})};
  const VectorXd r = normal_reference(200);
  const ClosedLoopRecord record = simulate_closed_loop(plant, controller, r, VectorXd::Zero(200));
  const auto error = [&](Eigen::Index first) {
    return reference_error(controller, record.u.tail(150), record.y.tail(150), r.tail(150), first);
  };
  EXPECT_NEAR(error(0), std::max(std::abs(record.y[48]), std::abs(record.y[49])), kTolerance);
  EXPECT_NEAR(error(1), std::abs(record.y[49]), kTolerance);
  EXPECT_LT(error(2), kTolerance);
  EXPECT_EQ(error(150), 0.0);
  EXPECT_THAT(message_of([&] { static_cast<void>(error(-1)); }), ::testing::HasSubstr("at least 0, got -1"));
}

// Delta Vbar = [Ts q (1 - p q) - b q (1 - q)] / [(1 - q)^2 + Ts q (c1 + c0 q)], with the true plant in the sensitivity.
TEST(CoprimeFactors, TrueUncertaintyMapsInputToOutput) {
  const CrowderLoop crowder;
  const UncertaintySignals signals = crowder_signals(crowder.ok());
  const double ts = crowder.ts;
  const DiscreteTransferFunction delta{polynomial({0.0, ts - crowder.b, crowder.b - ts * crowder.p}),
                                       polynomial({1.0, -2.0 + ts * (1.0 + ts / 2.0), 1.0 + ts * (-1.0 + ts / 2.0)})};
  const DiscreteTransferFunction inverse{crowder.ok().weight.denominator, crowder.ok().weight.numerator};
  EXPECT_LT((filter(delta, filter(inverse, signals.v)) - signals.w).cwiseAbs().maxCoeff(), kTolerance);
}

// (8), (9) as printed, with the model in the sensitivity: (1 - p q) / (1 - q) [Ts q (1 - p q) - b q (1 - q)] /
// [(1 - p q)(1 - q) + b q (c1 + c0 q)]. w is missed by nearly half of its largest sample, 0.176.
TEST(CoprimeFactors, PrintedUncertaintyDoesNot) {
  const CrowderLoop crowder;
  const UncertaintySignals signals = crowder_signals(crowder.ok());
  const VectorXd& c = crowder.controller.numerator;
  const DiscreteTransferFunction model{
      polynomial({0.0, crowder.ts - crowder.b, crowder.b - crowder.ts * crowder.p}),
      polynomial({1.0, -1.0 - crowder.p + crowder.b * c[0], crowder.p + crowder.b * c[1]})};
  const DiscreteTransferFunction inverse{crowder.ok().weight.denominator, crowder.ok().weight.numerator};
  const DiscreteTransferFunction integrator{polynomial({1.0, -crowder.p}), polynomial({1.0, -1.0})};
  const VectorXd got = filter(integrator, filter(model, filter(inverse, signals.v)));
  EXPECT_NEAR((got - signals.w).cwiseAbs().maxCoeff(), 0.080, 5e-4);
}

// The plant (Nhat + Dc V Delta) (Dhat - Nc V Delta)^-1 for V = 0.3 and Delta = 0.8 q^-1, multiplied out by hand:
// with Dhat = 1, Nhat = b q / (1 - p q), Dc = (1 - q) / (1 - p q), Nc = (c1 + c0 q) / (1 - p q), g = 0.24,
// P = [b q + g q (1 - q)] / [(1 - p q) - g q (c1 + c0 q)].
TEST(CoprimeFactors, UncertainLoopIsTheLoopOfItsPlant) {
  const CrowderLoop crowder;
  UncertainLoop loop = crowder.ok();
  loop.weight = {polynomial({0.3}), polynomial({1.0})};
  const double g = 0.24;
  const VectorXd& c = crowder.controller.numerator;
  const DiscreteTransferFunction plant{polynomial({0.0, crowder.b + g, -g}),
                                       polynomial({1.0, -crowder.p - g * c[0], -g * c[1]})};
  const VectorXd r = normal_reference(300);
  const VectorXd d = 0.1 * normal_reference(300, 2);
  const UncertainRecord uncertain = simulate_uncertain_loop(loop, {polynomial({0.0, 0.8}), polynomial({1.0})}, r, d);
  const ClosedLoopRecord direct = simulate_closed_loop(plant, crowder.controller, r, d);
  EXPECT_LT((uncertain.record.u - direct.u).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_LT((uncertain.record.y - direct.y).cwiseAbs().maxCoeff(), kTolerance);
  const UncertaintySignals signals = uncertainty_signals(loop, direct.u, direct.y);
  EXPECT_LT((uncertain.signals.v - signals.v).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_LT((uncertain.signals.w - signals.w).cwiseAbs().maxCoeff(), kTolerance);
  const VectorXd quiet = simulate_closed_loop(plant, crowder.controller, r, 0.0 * d).y;
  EXPECT_GT((quiet - direct.y).cwiseAbs().maxCoeff(), 0.01);
}

TEST(CoprimeFactors, IntegratorGetsAStableDenominator) {
  const CrowderLoop crowder;
  const CoprimeFactors factors = coprime_factors(crowder.controller, 0.9);
  ASSERT_EQ(factors.stable.size(), 2);
  EXPECT_DOUBLE_EQ(factors.stable[0], 1.0);
  EXPECT_NEAR(factors.stable[1], -0.9, 1e-15);
  EXPECT_EQ(coprime_factors(crowder.model, 0.9).stable, crowder.model.denominator);
}

TEST(CoprimeFactors, MistakesAreNamed) {
  using ::testing::HasSubstr;
  const CrowderLoop crowder;
  UncertainLoop loop = crowder.ok();
  loop.weight.numerator = polynomial({0.0, 1.0});
  EXPECT_THAT(message_of([&] { check(loop); }), HasSubstr("biproper"));
  loop.weight.numerator = polynomial({1.0, -2.0});
  EXPECT_THAT(message_of([&] { check(loop); }), HasSubstr("zeros inside the unit circle"));
  loop = crowder.ok();
  loop.weight.denominator = polynomial({1.0, -1.5});
  EXPECT_THAT(message_of([&] { check(loop); }), HasSubstr("poles inside the unit circle"));
  loop = crowder.ok();
  loop.controller = coprime_factors({polynomial({-1.0}), polynomial({1.0, -1.0})}, 0.9);
  EXPECT_THAT(message_of([&] { check(loop); }), HasSubstr("stabilises the model"));
  const VectorXd zero = VectorXd::Zero(10);
  EXPECT_THAT(message_of([&] { uncertainty_signals(crowder.ok(), zero, zero); }), HasSubstr("v is zero"));
  EXPECT_THAT(message_of([&] { uncertainty_signals(crowder.ok(), zero, VectorXd::Zero(9)); }),
              HasSubstr("10 samples, got 9"));
  EXPECT_THAT(message_of([&] {
                simulate_uncertain_loop(crowder.ok(), {polynomial({1.0}), polynomial({1.0, -1.0})}, zero, zero);
              }),
              HasSubstr("poles inside the unit circle"));
  EXPECT_THAT(message_of([&] { coprime_factors(crowder.controller, 1.0); }),
              HasSubstr("inside the unit circle, got 1"));
  EXPECT_THAT(message_of([&] { filter({polynomial({1.0}), polynomial({0.0, 1.0})}, zero); }), HasSubstr("not zero"));
}

}  // namespace
}  // namespace blockid::testing
