// The convex programme of the uncertainty: values of an independent prototype, closed forms, certificates, laws.
#include "crowder_loop.hpp"

#include <blockid/data/error.hpp>
#include <blockid/validation/hankel_products.hpp>
#include <blockid/validation/noise_free_bound.hpp>
#include <blockid/validation/uncertainty_programme.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// w on `count` samples from `start` (from one), v with `past` samples before.
UncertaintyWindow window_of(const UncertaintySignals& signals, Index start, Index past, Index count) {
  return {signals.v.segment(start - 1 - past, past + count), signals.w.segment(start - 1, count), {}};
}

struct Case {
  const char* set;
  Index start;
  Index past;
  double relative_gamma;
  double alpha;
};

UncertaintyProgramme programme_of(const std::string& set, Index start, Index past, Index count = 200) {
  const CrowderLoop crowder;
  const UncertainLoop loop = set == "ok" ? crowder.ok() : set == "tight" ? crowder.tight() : crowder.trivial();
  return uncertainty_programme(window_of(crowder_signals(loop), start, past, count));
}

double size_of(const std::string& set) {
  const CrowderLoop crowder;
  return crowder_signals(set == "eq10" ? crowder.trivial() : crowder.ok()).w.cwiseAbs().maxCoeff();
}

// Independent prototype in Python, checked there against CSDP; printed to six or seven digits, hence 2e-6.
TEST(UncertaintyProgramme, SmallestAlphaOfAnIndependentPrototype) {
  const std::vector<Case> cases = {
      {"ok", 1, 0, 1e-3, .9096003},      {"ok", 10, 9, 1e-3, .911368},   {"ok", 50, 49, 1e-3, .921483},
      {"ok", 300, 0, 1e-3, 4.512640},    {"ok", 300, 50, 1e-3, .927526}, {"ok", 1, 0, 1e-2, .878169},
      {"ok", 50, 49, 1e-2, .891993},     {"ok", 300, 0, 1e-2, 3.635406}, {"tight", 1, 0, 1e-3, 1.061200},
      {"tight", 300, 0, 1e-3, 5.264746}, {"eq10", 1, 0, 1e-3, 1.044826}, {"eq10", 50, 49, 1e-3, 1.073548}};
  for (const Case& c : cases) {
    SCOPED_TRACE(::testing::Message() << c.set << " from " << c.start << ", past " << c.past << ", "
                                      << c.relative_gamma);
    const double gamma = c.relative_gamma * size_of(c.set);
    const UncertaintyProgramme programme = programme_of(c.set, c.start, c.past);
    const ProgrammeSolution solution = smallest_alpha(programme, gamma);
    EXPECT_EQ(solution.status, ProgrammeStatus::converged) << solution.iterations;
    EXPECT_NEAR(solution.value, c.alpha, 2e-6 * std::max(1.0, c.alpha)) << solution.lower_bound;
    EXPECT_LE(toeplitz_norm(solution.h), solution.value * (1.0 + 1e-9));
    EXPECT_LE((programme.w - programme.a * solution.h).cwiseAbs().maxCoeff(), gamma * (1.0 + 1e-9));
    const double certified = certified_alpha(programme, gamma, solution.certificate);
    EXPECT_LE(certified, solution.value);
    EXPECT_GE(certified, solution.value * (1.0 - 1e-6));
  }
}

// gamma_min(1) / max|w| to 1e-6, of the same prototype.
TEST(UncertaintyProgramme, SmallestGammaOfAnIndependentPrototype) {
  const std::vector<Case> cases = {{"ok", 300, 0, 0.05993976, 1.0},    {"ok", 300, 20, 0.00678708, 1.0},
                                   {"tight", 1, 0, 0.01743925, 1.0},   {"tight", 50, 49, 0.0216764, 1.0},
                                   {"tight", 300, 0, 0.09858499, 1.0}, {"tight", 300, 50, 0.02735806, 1.0},
                                   {"eq10", 1, 0, 0.01314233, 1.0},    {"eq10", 50, 49, 0.0221713, 1.0}};
  for (const Case& c : cases) {
    SCOPED_TRACE(::testing::Message() << c.set << " from " << c.start << ", past " << c.past);
    const UncertaintyProgramme programme = programme_of(c.set, c.start, c.past);
    const ProgrammeSolution solution = smallest_gamma(programme, c.alpha);
    EXPECT_NEAR(solution.value / size_of(c.set), c.relative_gamma, 1e-6);
    EXPECT_GE(solution.lower_bound, solution.value * (1.0 - 1e-5));
    EXPECT_NEAR(certified_gamma(programme, c.alpha, solution.certificate), solution.lower_bound,
                1e-9 * solution.lower_bound);
    EXPECT_LE(toeplitz_norm(solution.h), c.alpha * (1.0 + 1e-9));
    EXPECT_LE((programme.w - programme.a * solution.h).cwiseAbs().maxCoeff(), solution.value * (1.0 + 1e-9));
  }
}

TEST(UncertaintyProgramme, NoNoiseIsNeededByAGoodModel) {
  const ProgrammeSolution solution = smallest_gamma(programme_of("ok", 1, 0), 1.0);
  EXPECT_EQ(solution.status, ProgrammeStatus::converged);
  EXPECT_LT(solution.value, 1e-9 * size_of("ok"));
}

UncertaintyProgramme simple(const VectorXd& v, const VectorXd& w) { return uncertainty_programme({v, w, {}}); }

TEST(UncertaintyProgramme, ClosedForms) {
  // One sample: alpha = (|w| - gamma) / |v|.
  EXPECT_NEAR(smallest_alpha(simple(VectorXd::Constant(1, 2.0), VectorXd::Constant(1, -3.0)), 0.5).value, 1.25, 1e-6);
  // T_h of ones after an impulse, lowered by gamma everywhere: the norm is linear in h.
  for (const Index n : {2, 5, 40}) {
    const double expected = 0.9 / (2.0 * std::sin(std::numbers::pi / (4.0 * static_cast<double>(n) + 2.0)));
    const double got = smallest_alpha(simple(VectorXd::Unit(n, 0), VectorXd::Ones(n)), 0.1).value;
    // Lowering all samples alike is one choice among many.
    EXPECT_LE(got, expected * (1.0 + 1e-6)) << n;
    EXPECT_GE(got, noise_corrected_bound(VectorXd::Unit(n, 0), VectorXd::Ones(n), 0.1)) << n;
  }
  // No v: all of w must be noise.
  const ProgrammeSolution silent = smallest_gamma(simple(VectorXd::Zero(4), VectorXd::LinSpaced(4, 1.0, 4.0)), 1.0);
  EXPECT_NEAR(silent.value, 4.0, 4e-7);
}

TEST(UncertaintyProgramme, OutputBeforeInputExceedsTheCap) {
  VectorXd v = VectorXd::Zero(20);
  v[10] = 1.0;
  const UncertaintyProgramme programme = simple(v, VectorXd::Unit(20, 3));
  const ProgrammeSolution solution = smallest_alpha(programme, 0.1);
  EXPECT_EQ(solution.status, ProgrammeStatus::cap_exceeded);
  EXPECT_EQ(solution.value, std::numeric_limits<double>::infinity());
  EXPECT_GT(solution.lower_bound, 1024.0);
  EXPECT_GE(certified_gamma(programme, 1024.0, solution.certificate), 0.1);
}

TEST(UncertaintyProgramme, CertificatesHoldForAnyMultipliers) {
  const UncertaintyProgramme programme = programme_of("ok", 1, 0, 40);
  const double gamma = 1e-2 * size_of("ok");
  const ProgrammeSolution solution = smallest_alpha(programme, gamma);
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    DualCertificate other = solution.certificate;
    other.lambda += 0.05 * other.lambda.cwiseAbs().maxCoeff() * normal_reference(40, seed);
    EXPECT_LE(certified_alpha(programme, gamma, other), solution.value * (1.0 + 1e-12)) << seed;
  }
  DualCertificate indefinite = solution.certificate;
  indefinite.x1 = -indefinite.x1;
  EXPECT_THROW(certified_alpha(programme, gamma, indefinite), Error);
}

TEST(UncertaintyProgramme, ScalesWithItsSignals) {
  const UncertaintyWindow window = window_of(crowder_signals(CrowderLoop{}.ok()), 30, 29, 40);
  const double gamma = 1e-2 * size_of("ok");
  const double alpha = smallest_alpha(uncertainty_programme(window), gamma).value;
  for (const double c : {1e-6, 1e6}) {
    const UncertaintyWindow both{c * window.v, c * window.w, {}};
    EXPECT_NEAR(smallest_alpha(uncertainty_programme(both), c * gamma).value, alpha, 1e-7 * alpha) << c;
  }
  const UncertaintyWindow louder{2.0 * window.v, window.w, {}};
  EXPECT_NEAR(smallest_alpha(uncertainty_programme(louder), gamma).value, alpha / 2.0, 1e-7 * alpha);
  const UncertaintyWindow turned{window.v, -window.w, {}};
  EXPECT_NEAR(smallest_alpha(uncertainty_programme(turned), gamma).value, alpha, 1e-7 * alpha);
}

TEST(UncertaintyProgramme, TradeOffIsConvexWithTheSlopeOfTheDual) {
  const UncertaintyProgramme programme = programme_of("tight", 1, 0, 60);
  const double size = size_of("tight");
  const auto alpha = [&](double gamma) { return smallest_alpha(programme, gamma).value; };
  const double a = alpha(0.01 * size);
  const double b = alpha(0.02 * size);
  const double c = alpha(0.03 * size);
  EXPECT_GT(a, b);
  EXPECT_GT(b, c);
  EXPECT_LE(b, 0.5 * (a + c) * (1.0 + 1e-7));
  // gamma*(alpha*(gamma)) = gamma.
  EXPECT_NEAR(smallest_gamma(programme, b).value, 0.02 * size, 1e-5 * size);
  // Central difference: the curve is piecewise smooth, its second difference bounds the error.
  const double slope = smallest_alpha(programme, 0.02 * size).slope;
  EXPECT_GE(slope, (b - a) / (0.01 * size) * (1.0 + 1e-4));
  EXPECT_LE(slope, (c - b) / (0.01 * size) * (1.0 - 1e-4));
}

TEST(UncertaintyProgramme, MoreDataNeverNeedsLess) {
  const UncertaintySignals signals = crowder_signals(CrowderLoop{}.ok());
  const double gamma = 1e-2 * size_of("ok");
  const UncertaintyWindow longer = window_of(signals, 1, 0, 80);
  UncertaintyWindow missing = longer;
  for (const Index t : {3, 20, 21, 50}) missing.w[t] = std::numeric_limits<double>::quiet_NaN();
  const double all = smallest_alpha(uncertainty_programme(longer), gamma).value;
  EXPECT_LE(smallest_alpha(uncertainty_programme(missing), gamma).value, all * (1.0 + 1e-7));
  EXPECT_LE(smallest_alpha(uncertainty_programme(window_of(signals, 1, 0, 50)), gamma).value, all * (1.0 + 1e-7));
  // A second experiment under another noise bound.
  const VectorXd r = normal_reference(80, 9);
  const CrowderLoop crowder;
  const ClosedLoopRecord record = simulate_closed_loop(crowder.plant, crowder.controller, r, VectorXd::Zero(80));
  const UncertaintySignals second = uncertainty_signals(crowder.ok(), record.u, record.y);
  const std::vector<UncertaintyWindow> two = {longer, {second.v, second.w, VectorXd::Constant(80, 0.5)}};
  EXPECT_GE(smallest_alpha(uncertainty_programme(two), gamma).value, all * (1.0 - 1e-7));
}

TEST(UncertaintyProgramme, ShapeOfTheNoiseScalesTheRows) {
  const UncertaintyWindow window = window_of(crowder_signals(CrowderLoop{}.ok()), 1, 0, 40);
  const double gamma = 1e-2 * size_of("ok");
  UncertaintyWindow shaped = window;
  shaped.shape = VectorXd::Constant(40, 2.0);
  EXPECT_NEAR(smallest_alpha(uncertainty_programme(shaped), gamma).value,
              smallest_alpha(uncertainty_programme(window), 2.0 * gamma).value, 1e-6);
}

// Sums written out, O(n^4).
TEST(UncertaintyProgramme, SchurComplementIsTheSumOfTraces) {
  const Index n = 7;
  const auto symmetric = [&](std::uint32_t seed) {
    const VectorXd values = normal_reference(n * n, seed);
    const MatrixXd m = values.reshaped(n, n);
    return MatrixXd(m + m.transpose());
  };
  const MatrixXd x1 = symmetric(1);
  const MatrixXd w1 = symmetric(2);
  const MatrixXd x2 = symmetric(3);
  const MatrixXd w2 = symmetric(4);
  const MatrixXd s = hankel_schur_complement(x1, w1, x2, w2);
  for (Index k = 0; k < n; ++k) {
    const MatrixXd ek = hankel(VectorXd::Unit(n, k));
    for (Index l = 0; l < n; ++l) {
      const MatrixXd el = hankel(VectorXd::Unit(n, l));
      // A few hundred products of numbers below 10.
      EXPECT_NEAR(s(k, l), (ek * x1 * el * w1).trace() + (ek * x2 * el * w2).trace(), 1e-11);
    }
    EXPECT_NEAR(hankel_adjoint(x1)[k], (ek * x1).trace(), 1e-13);
  }
}

// The matrix inequality as printed, with an initial response that nothing couples to Delta: rho = w makes it zero. In
// ours the response to the past is part of A h.
TEST(UncertaintyProgramme, MistakesAreNamed) {
  const VectorXd one = VectorXd::Ones(1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(uncertainty_programme(std::span<const UncertaintyWindow>()), Error);
  EXPECT_THROW(uncertainty_programme({one, VectorXd::Ones(2), {}}), Error);
  EXPECT_THROW(uncertainty_programme({one * nan, one, {}}), Error);
  EXPECT_THROW(uncertainty_programme({one, one * nan, {}}), Error);
  EXPECT_THROW(uncertainty_programme({one, one, VectorXd::Zero(1)}), Error);
  EXPECT_THROW(smallest_alpha(simple(one, one), 0.0), Error);
  EXPECT_THROW(smallest_gamma(simple(one, one), 0.0), Error);
  EXPECT_EQ(smallest_alpha(simple(one, one), 2.0).value, 0.0);
}

}  // namespace
}  // namespace blockid::testing
