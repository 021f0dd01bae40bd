// CSDP, another solver by another method, as the oracle of the convex programme. Skipped where it is not installed.
#include "closed_loop_noise.hpp"

#include "data/message.hpp"

#include <blockid/validation/csdp_back_end.hpp>
#include <blockid/validation/noise_free_bound.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

/// CSDP ends at a relative gap of 1e-8, ours at 1e-7.
constexpr double kTolerance = 1e-6;

class Csdp : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!csdp_available()) GTEST_SKIP() << "CSDP is not installed (Debian: libsdp-dev)";
  }
};

double alpha_by_csdp(const UncertaintyProgramme& programme, double gamma) {
  const CsdpSolution solution = solve_with_csdp(hankel_form(programme, gamma));
  EXPECT_EQ(solution.code, 0);
  return solution.dual;
}

// min y_1 + y_2 such that [y_1 1; 1 y_2] is positive semidefinite and y_1 >= 2: y = (2, 1/2).
TEST_F(Csdp, SmallProgramme) {
  SemidefiniteProgramme programme;
  programme.blocks = {{2, false}, {1, true}};
  programme.cost = VectorXd::Ones(2);
  programme.constant = {{0, 0, 1, -1.0}, {1, 0, 0, 2.0}};
  programme.matrices = {{{0, 0, 0, 1.0}, {1, 0, 0, 1.0}}, {{0, 1, 1, 1.0}}};
  const CsdpSolution solution = solve_with_csdp(programme);
  EXPECT_EQ(solution.code, 0);
  EXPECT_NEAR(solution.dual, 2.5, kTolerance);
  EXPECT_NEAR(solution.primal, 2.5, kTolerance);
  ASSERT_EQ(solution.y.size(), 2);
  EXPECT_NEAR(solution.y[0], 2.0, 1e-4);
  EXPECT_NEAR(solution.y[1], 0.5, 1e-4);
}

TEST_F(Csdp, AgreesOnRecordsFromRestAndWithPast) {
  const CrowderLoop crowder;
  for (const UncertainLoop& loop : {crowder.ok(), crowder.tight(), crowder.trivial()}) {
    const UncertaintySignals signals = crowder_signals(loop);
    const double gamma = 1e-3 * signals.w.cwiseAbs().maxCoeff();
    for (const auto& [first, past, count] : {std::array<Index, 3>{0, 0, 50}, {40, 40, 40}, {90, 50, 30}}) {
      const UncertaintyProgramme programme =
          uncertainty_programme(cut_window(signals.v, signals.w, first, count, past));
      const double ours = smallest_alpha(programme, gamma).value;
      EXPECT_NEAR(ours, alpha_by_csdp(programme, gamma), kTolerance * ours) << first << " " << past << " " << count;
    }
  }
}

TEST_F(Csdp, AgreesWithHundredParameters) {
  const UncertaintySignals signals = crowder_signals(CrowderLoop{}.ok());
  const double gamma = 1e-3 * signals.w.cwiseAbs().maxCoeff();
  const UncertaintyProgramme programme = uncertainty_programme(cut_window(signals.v, signals.w, 0, 100, 0));
  EXPECT_NEAR(smallest_alpha(programme, gamma).value, alpha_by_csdp(programme, gamma), kTolerance);
}

TEST_F(Csdp, AgreesOnTwoExperimentsWithGapsAndShapes) {
  const CrowderLoop crowder;
  const NoisySignals one = noisy_signals(crowder.tight(), crowder.plant, normal_reference(40), 0.05, 3);
  const NoisySignals two = noisy_signals(crowder.tight(), crowder.plant, normal_reference(60, 2), 0.05, 4);
  UncertaintyWindow first{one.v, one.w, VectorXd::LinSpaced(40, 1.0, 2.0)};
  first.w[7] = std::numeric_limits<double>::quiet_NaN();
  const std::vector<UncertaintyWindow> windows = {first, cut_window(two.v, two.w, 20, 40, 20)};
  const UncertaintyProgramme programme = uncertainty_programme(windows);
  const double gamma = std::max(one.noise(), two.noise());
  const double ours = smallest_alpha(programme, gamma).value;
  EXPECT_NEAR(ours, alpha_by_csdp(programme, gamma), kTolerance * ours);
}

/// The matrix inequality of corollary 2 as printed, with its parenthesis put right: min alpha such that
/// [alpha I, Y'; Y, I] is positive semidefinite, Y = (T_w - T_rho) (T_v'T_v)^-1/2.
SemidefiniteProgramme printed_corollary_2(const VectorXd& v, const VectorXd& w, bool free_rho) {
  const Index n = v.size();
  const MatrixXd tv = lower_toeplitz(v);
  const MatrixXd root = Eigen::SelfAdjointEigenSolver<MatrixXd>(tv.transpose() * tv).operatorInverseSqrt();
  SemidefiniteProgramme programme;
  programme.blocks = {{2 * n, false}};
  const auto add = [n](std::vector<SemidefiniteEntry>& matrix, const MatrixXd& y) {
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) matrix.push_back({0, i, n + j, y(j, i)});
    }
  };
  add(programme.constant, -lower_toeplitz(w) * root);
  for (Index i = 0; i < n; ++i) programme.constant.push_back({0, n + i, n + i, -1.0});
  std::vector<SemidefiniteEntry> alpha;
  for (Index i = 0; i < n; ++i) alpha.push_back({0, i, i, 1.0});
  programme.matrices.push_back(alpha);
  for (Index k = 0; free_rho && k < n; ++k) {
    std::vector<SemidefiniteEntry> matrix;
    add(matrix, -lower_toeplitz(VectorXd::Unit(n, k)) * root);
    programme.matrices.push_back(matrix);
  }
  programme.cost = VectorXd::Unit(static_cast<Index>(programme.matrices.size()), 0);
  return programme;
}

// An initial response that nothing ties to Delta explains every record: rho = w makes alpha zero. Without it, alpha is
// the square of the bound.
TEST_F(Csdp, PrintedCorollary2IsEmpty) {
  VectorXd v = normal_reference(12, 6);
  v[0] = 4.0;  // T_v well conditioned
  const VectorXd w = normal_reference(12, 7);
  const double bound = noise_free_bound(v, w);
  EXPECT_GT(bound, 0.5);
  EXPECT_NEAR(std::sqrt(solve_with_csdp(printed_corollary_2(v, w, false)).dual), bound, kTolerance * bound);
  EXPECT_NEAR(solve_with_csdp(printed_corollary_2(v, w, true)).dual, 0.0, kTolerance);
}

TEST_F(Csdp, IsStoppedAtTheTimeLimit) {
  const UncertaintySignals signals = crowder_signals(CrowderLoop{}.ok());
  const UncertaintyProgramme programme = uncertainty_programme(cut_window(signals.v, signals.w, 0, 200, 0));
  EXPECT_THAT(message_of([&] { solve_with_csdp(hankel_form(programme, 1e-3), 0.01); }), HasSubstr("within 0.01 s"));
}

TEST(SemidefiniteProgrammes, MistakesAreNamed) {
  SemidefiniteProgramme good;
  good.blocks = {{2, false}, {1, true}};
  good.cost = VectorXd::Ones(1);
  good.matrices = {{{0, 0, 0, 1.0}}};
  const auto message = [&](const auto& spoil) {
    SemidefiniteProgramme bad = good;
    spoil(bad);
    return message_of([&] { solve_with_csdp(bad); });
  };
  EXPECT_THAT(message([](auto& p) { p.cost = VectorXd::Ones(2); }), HasSubstr("as many matrices as costs"));
  EXPECT_THAT(message([](auto& p) { p.cost[0] = std::nan(""); }), HasSubstr("finite costs"));
  EXPECT_THAT(message([](auto& p) { p.blocks[1].size = 0; }), HasSubstr("size 1 or more, got 0"));
  EXPECT_THAT(message([](auto& p) { p.constant = {{2, 0, 0, 1.0}}; }), HasSubstr("block below 2, got 2"));
  EXPECT_THAT(message([](auto& p) { p.constant = {{0, 1, 0, 1.0}}; }), HasSubstr("upper triangle"));
  EXPECT_THAT(message([](auto& p) { p.constant = {{0, 0, 2, 1.0}}; }), HasSubstr("size 2, got (0, 2)"));
  EXPECT_THAT(message([](auto& p) { p.matrices[0] = {{0, 0, 0, std::nan("")}}; }), HasSubstr("finite entries"));
  EXPECT_THAT(message([](auto& p) { p.constant = {{0, 0, 0, 1.0}, {0, 0, 0, 1.0}}; }), HasSubstr("given twice"));
  const UncertaintyProgramme one{MatrixXd::Ones(1, 1), VectorXd::Ones(1)};
  EXPECT_THAT(message_of([&] { hankel_form(one, -1.0); }), HasSubstr("at least 0, got -1"));
  EXPECT_THAT(message_of([&] { hankel_form({MatrixXd::Ones(1, 1), VectorXd::Ones(2)}, 1.0); }), HasSubstr("rows"));
}

}  // namespace
}  // namespace blockid::testing
