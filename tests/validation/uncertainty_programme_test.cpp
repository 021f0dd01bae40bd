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

}  // namespace
}  // namespace blockid::testing
