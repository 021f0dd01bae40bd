// Uncertainties with several inputs and outputs: closed form, programme, their laws, CSDP and one channel as oracles.
#include "closed_loop_noise.hpp"

#include "data/message.hpp"

#include <blockid/validation/correlation.hpp>
#include <blockid/validation/csdp_back_end.hpp>
#include <blockid/validation/mimo_programme.hpp>
#include <blockid/validation/noise_free_bound.hpp>
#include <blockid/validation/uncertainty_programme.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <limits>

namespace blockid::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

MatrixXd noise(Index rows, Index count, std::uint32_t seed) {
  return normal_reference(rows * count, seed).reshaped(rows, count);
}

MatrixXd rotation(Index size, std::uint32_t seed) {
  return Eigen::HouseholderQR<MatrixXd>(noise(size, size, seed)).householderQ();
}

/// w_t = 0.9 U diag(q^-1, ..., 1) v_t: an all-pass of gain 0.9 whose first channel is delayed by one sample.
MatrixXd all_pass_response(const MatrixXd& v) {
  MatrixXd delayed = v;
  delayed.row(0).tail(v.cols() - 1) = v.row(0).head(v.cols() - 1);
  delayed(0, 0) = 0.0;
  return 0.9 * rotation(v.rows(), 7) * delayed;
}

TEST(MimoBound, BlockToeplitzMatrixConvolves) {
  const MatrixXd v = noise(2, 5, 1);
  const VectorXd x = normal_reference(5, 2);
  const VectorXd got = block_toeplitz(v) * x;
  for (Index t = 0; t < 5; ++t) {
    VectorXd expected = VectorXd::Zero(2);
    for (Index k = 0; k <= t; ++k) expected += v.col(k) * x[t - k];
    EXPECT_LT((got.segment(2 * t, 2) - expected).norm(), 1e-14);
  }
}

TEST(MimoBound, OneChannelIsTheScalarBound) {
  const UncertaintySignals signals = crowder_signals(CrowderLoop{}.tight(), 60);
  const double expected = noise_free_bound(signals.v, signals.w);
  EXPECT_NEAR(mimo_noise_free_bound(signals.v.transpose(), signals.w.transpose()), expected, 1e-9 * expected);
  // A second input that is silent and a second output that is silent change nothing.
  MatrixXd v = MatrixXd::Zero(2, 60);
  MatrixXd w = MatrixXd::Zero(2, 60);
  v.row(1) = signals.v;
  w.row(0) = signals.w;
  EXPECT_NEAR(mimo_noise_free_bound(v, w), expected, 1e-9 * expected);
}

// From below, rising with the record; |Delta| = 0.9.
TEST(MimoBound, ApproachesTheNormFromBelow) {
  const MatrixXd v = noise(2, 120, 3);
  const MatrixXd w = all_pass_response(v);
  double before = 0.0;
  for (const Index count : {5, 20, 60, 120}) {
    const double bound = mimo_noise_free_bound(v.leftCols(count), w.leftCols(count));
    EXPECT_GE(bound, before * (1.0 - 1e-9));
    EXPECT_LE(bound, 0.9 * (1.0 + 1e-9));
    before = bound;
  }
  EXPECT_GT(before, 0.85);
}

TEST(MimoBound, RotationsOfInputsAndOutputsChangeNothing) {
  const MatrixXd v = noise(3, 40, 4);
  const MatrixXd w = noise(2, 40, 5);
  const double bound = mimo_noise_free_bound(v, w);
  EXPECT_NEAR(mimo_noise_free_bound(rotation(3, 1) * v, rotation(2, 2) * w), bound, 1e-9 * bound);
  EXPECT_NEAR(mimo_noise_free_bound(2.0 * v, 6.0 * w), 3.0 * bound, 1e-9 * bound);
}

// One input, two outputs: T_v alone is singular in double precision, tau keeps the bound below the norm.
TEST(MimoBound, OneInputAndTwoOutputsNeedTau) {
  const VectorXd v = normal_reference(150, 6);
  MatrixXd w = MatrixXd::Zero(2, 150);
  w.row(0) = 0.54 * v;
  w.row(1).tail(149) = 0.72 * v.head(149);  // gain 0.9 at all frequencies
  const double bound = mimo_noise_free_bound(v.transpose(), w);
  EXPECT_LE(bound, 0.9 * (1.0 + 1e-6));
  EXPECT_GT(bound, 0.89);
}

TEST(MimoProgramme, CorrelationsAreSumsOfShiftedProducts) {
  const Index n = 5;
  const std::vector<MatrixXd> m = {noise(n, n, 1), noise(n, n, 2), noise(n, n, 3), noise(n, n, 4)};
  const Correlation correlation(n);
  const auto spectrum = [&](std::size_t i) { return correlation.spectrum(m[i]); };
  const MatrixXd straight = correlation.sums(spectrum(0), spectrum(1), spectrum(2), spectrum(3));
  const MatrixXd crossed = correlation.crossed_sums(spectrum(0), spectrum(1), spectrum(2), spectrum(3));
  const auto sum = [&](const MatrixXd& p, const MatrixXd& q, Index k, Index l) {
    double s = 0.0;
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) {
        if (i + k < n && j + l >= 0 && j + l < n) s += p(i, j) * q(i + k, j + l);
      }
    }
    return s;
  };
  for (Index k = 0; k < n; ++k) {
    for (Index l = 0; l < n; ++l) {
      EXPECT_NEAR(straight(k, l), sum(m[0], m[1], k, l) + sum(m[2], m[3], k, l), 1e-12);
      EXPECT_NEAR(crossed(k, l), sum(m[0], m[1], k, -l) + sum(m[2], m[3], k, -l), 1e-12);
    }
  }
}

// The Hankel form has other variables and another cone; v(0) is large, so that T_v is regular.
TEST(MimoProgramme, OneChannelIsTheScalarProgramme) {
  VectorXd v = normal_reference(30, 8);
  v[0] = 5.0;
  const VectorXd w = normal_reference(30, 9);
  for (const Index past : {0, 10}) {
    const UncertaintyWindow window = cut_window(v, w, past, 30 - past, past);
    const ProgrammeSolution scalar = smallest_alpha(uncertainty_programme(window), 0.3);
    const MimoSolution mimo = smallest_mimo_alpha(window.v.transpose(), window.w.transpose(), 0.3);
    EXPECT_EQ(mimo.status, ProgrammeStatus::converged);
    EXPECT_NEAR(mimo.value, scalar.value, 1e-6 * scalar.value) << past;
    EXPECT_LE(mimo.lower_bound, mimo.value);
    EXPECT_GE(mimo.lower_bound, mimo.value * (1.0 - 1e-6));
  }
}

TEST(MimoProgramme, TinyNoiseGivesTheClosedForm) {
  const MatrixXd v = noise(2, 15, 10);
  const MatrixXd w = all_pass_response(v);
  const double closed = mimo_noise_free_bound(v, w);
  const MimoSolution solution = smallest_mimo_alpha(v, w, 1e-6 * w.cwiseAbs().maxCoeff());
  EXPECT_LE(solution.lower_bound, closed);
  // |T_e| of the noise is below 15 gamma; divided by the least singular value of T_v.
  const double least = block_toeplitz(v).jacobiSvd().singularValues().minCoeff();
  EXPECT_GE(solution.value, closed - 15.0 * 2.0 * 1e-6 * w.cwiseAbs().maxCoeff() / least);
}

// What it returns keeps what it promises: the output is within the noise, and needs no more than alpha.
TEST(MimoProgramme, OutputKeepsBothBounds) {
  const MatrixXd v = noise(2, 40, 11);
  const MatrixXd w = all_pass_response(v) + 0.05 * noise(2, 40, 12).cwiseMax(-1.0).cwiseMin(1.0);
  for (const Index past : {0, 15}) {
    const MatrixXd window = w.rightCols(40 - past);
    const MimoSolution solution = smallest_mimo_alpha(v, window, 0.05);
    EXPECT_EQ(solution.status, ProgrammeStatus::converged);
    EXPECT_LE((solution.output.rightCols(40 - past) - window).cwiseAbs().maxCoeff(), 0.05 * (1.0 + 1e-9));
    EXPECT_LE(mimo_noise_free_bound(v, solution.output), solution.value * (1.0 + 1e-9));
    EXPECT_LE(solution.lower_bound, 0.9);  // the truth: gain 0.9 and noise of at most 0.05
    EXPECT_GE(solution.lower_bound, solution.value * (1.0 - 1e-6));
  }
}

TEST(MimoProgramme, LessPastAndMoreDataNeedNoLess) {
  const MatrixXd v = noise(2, 30, 13);
  const MatrixXd w = all_pass_response(v);
  const auto alpha = [&](Index past, double gamma) {
    return smallest_mimo_alpha(v, w.rightCols(30 - past), gamma).value;
  };
  EXPECT_GE(alpha(0, 0.1), alpha(10, 0.1) * (1.0 - 1e-6));
  EXPECT_GE(alpha(10, 0.1), alpha(20, 0.1) * (1.0 - 1e-6));
  EXPECT_GE(alpha(0, 0.05), alpha(0, 0.1) * (1.0 - 1e-6));
  EXPECT_EQ(alpha(0, 10.0), 0.0);
}

/// min beta such that [beta T_v'T_v, T_z'; T_z, I] is positive semidefinite, |w - z| <= gamma, from rest.
SemidefiniteProgramme gram_form(const MatrixXd& v, const MatrixXd& w, double gamma) {
  const Index n = v.cols();
  const Index p = w.rows();
  const MatrixXd gram = block_toeplitz(v).transpose() * block_toeplitz(v);
  SemidefiniteProgramme form;
  form.blocks = {{(1 + p) * n, false}, {2 * p * n, true}};
  form.cost = VectorXd::Unit(p * n + 1, p * n);
  form.matrices.resize(static_cast<std::size_t>(p * n + 1));
  for (Index i = 0; i < p * n; ++i) form.constant.push_back({0, n + i, n + i, -1.0});
  for (Index k = 0; k < n; ++k) {
    for (Index a = 0; a < p; ++a) {
      const Index at = k * p + a;
      std::vector<SemidefiniteEntry>& matrix = form.matrices[static_cast<std::size_t>(at)];
      for (Index j = 0; j + k < n; ++j) matrix.push_back({0, j, n + (j + k) * p + a, 1.0});
      matrix.push_back({1, at, at, 1.0});
      matrix.push_back({1, p * n + at, p * n + at, -1.0});
      form.constant.push_back({1, at, at, w(a, k) - gamma});
      form.constant.push_back({1, p * n + at, p * n + at, -w(a, k) - gamma});
    }
  }
  for (Index j = 0; j < n; ++j) {
    for (Index i = 0; i <= j; ++i) form.matrices.back().push_back({0, i, j, gram(i, j)});
  }
  return form;
}

TEST(MimoProgramme, AgreesWithCsdp) {
  if (!csdp_available()) GTEST_SKIP() << "CSDP is not installed (Debian: libsdp-dev)";
  const MatrixXd v = noise(2, 20, 14);
  const MatrixXd w = noise(2, 20, 15);
  const double ours = smallest_mimo_alpha(v, w, 0.3).value;
  const CsdpSolution other = solve_with_csdp(gram_form(v, w, 0.3));
  EXPECT_EQ(other.code, 0);
  // Gaps of 1e-7 of alpha and 1e-8 of alpha^2.
  EXPECT_NEAR(ours, std::sqrt(other.dual), 1e-6 * ours);
}

/// min alpha such that [alpha I, T_H; T_H', alpha I] is positive semidefinite, |w_t - sum_k H_k v_{t-k}| <= gamma: the
/// matrices H_0..H_{n-1} (p, m) of Delta themselves, from rest or with a past.
SemidefiniteProgramme parameter_form(const MatrixXd& v, const MatrixXd& w, double gamma) {
  const Index n = v.cols();
  const Index m = v.rows();
  const Index p = w.rows();
  const Index past = n - w.cols();
  SemidefiniteProgramme form;
  form.blocks = {{(p + m) * n, false}, {2 * w.size(), true}};
  form.cost = VectorXd::Unit(p * m * n + 1, p * m * n);
  form.matrices.resize(static_cast<std::size_t>(p * m * n + 1));
  for (Index k = 0; k < n; ++k) {
    for (Index b = 0; b < m; ++b) {
      for (Index a = 0; a < p; ++a) {
        std::vector<SemidefiniteEntry>& matrix = form.matrices[static_cast<std::size_t>((k * m + b) * p + a)];
        for (Index j = 0; j + k < n; ++j) matrix.push_back({0, (j + k) * p + a, p * n + j * m + b, 1.0});
        for (Index t = std::max(past, k); t < n; ++t) {
          const Index row = (t - past) * p + a;
          matrix.push_back({1, row, row, v(b, t - k)});
          matrix.push_back({1, w.size() + row, w.size() + row, -v(b, t - k)});
        }
      }
    }
  }
  for (Index i = 0; i < (p + m) * n; ++i) form.matrices.back().push_back({0, i, i, 1.0});
  for (Index i = 0; i < w.size(); ++i) {
    form.constant.push_back({1, i, i, w.reshaped()[i] - gamma});
    form.constant.push_back({1, w.size() + i, w.size() + i, -w.reshaped()[i] - gamma});
  }
  return form;
}

// Other variables and another cone: outputs z that T_z'T_z <= alpha^2 T_v'T_v allows are those of some Delta.
TEST(MimoProgramme, OutputsAreThoseOfSomeUncertainty) {
  if (!csdp_available()) GTEST_SKIP() << "CSDP is not installed (Debian: libsdp-dev)";
  for (const Index past : {0, 5}) {
    for (const Index outputs : {1, 2}) {
      const MatrixXd v = noise(2, 14, 19);
      const MatrixXd w = noise(outputs, 14 - past, 20);
      const CsdpSolution other = solve_with_csdp(parameter_form(v, w, 0.3));
      EXPECT_EQ(other.code, 0);
      EXPECT_NEAR(smallest_mimo_alpha(v, w, 0.3).value, other.dual, 1e-6 * other.dual) << past << " " << outputs;
    }
  }
}

// The bound of the method, from the multiplier alone and by other sums; and of any other multiplier, which proves less.
TEST(MimoProgramme, CertificateIsEvaluatedOnceMore) {
  const MatrixXd v = noise(2, 30, 16);
  const MatrixXd w = all_pass_response(v) + 0.02 * noise(2, 30, 17).cwiseMax(-1.0).cwiseMin(1.0);
  for (const Index past : {0, 10}) {
    const MatrixXd window = w.rightCols(30 - past);
    const MimoSolution solution = smallest_mimo_alpha(v, window, 0.02);
    const double certified = certified_mimo_alpha(v, window, 0.02, solution.certificate);
    EXPECT_NEAR(certified, solution.lower_bound, 1e-12);
    EXPECT_GE(certified, solution.value * (1.0 - 1e-6));
    EXPECT_LT(certified_mimo_alpha(v, window, 0.03, solution.certificate), certified);
    const MatrixXd near = noise(90, 90, 18);
    const double least = 1e-3 * solution.certificate.norm() / near.squaredNorm();
    const double other = certified_mimo_alpha(v, window, 0.02, solution.certificate + least * near * near.transpose());
    EXPECT_LT(other, certified);
    EXPECT_GT(other, 0.1);
    EXPECT_THAT(message_of([&] { certified_mimo_alpha(v, window, 0.02, -solution.certificate); }),
                HasSubstr("positive definite"));
    EXPECT_THAT(message_of([&] { certified_mimo_alpha(v, window, 0.02, MatrixXd::Identity(3, 3)); }),
                HasSubstr("expected 90 rows"));
  }
  EXPECT_EQ(certified_mimo_alpha(v, w, 0.02, {}), 0.0);
}

TEST(MimoProgramme, StopsWhenTheSideOfTheTargetIsKnown) {
  const MatrixXd v = noise(2, 30, 16);
  const MatrixXd w = all_pass_response(v);
  const MimoSolution whole = smallest_mimo_alpha(v, w, 0.02);
  for (const double factor : {0.8, 1.2}) {
    const double target = factor * whole.value;
    const MimoSolution early = smallest_mimo_alpha(v, w, 0.02, {}, 1e-8, target);
    EXPECT_EQ(early.status, ProgrammeStatus::target_reached);
    EXPECT_LT(early.iterations, whole.iterations);
    EXPECT_TRUE(factor > 1.0 ? early.value <= target : early.lower_bound > target) << factor;
  }
}

TEST(MimoProgramme, MistakesAreNamed) {
  const MatrixXd one = MatrixXd::Ones(2, 3);
  EXPECT_THAT(message_of([&] { mimo_noise_free_bound(one, MatrixXd::Ones(1, 4)); }), HasSubstr("got 3 and 4"));
  EXPECT_THAT(message_of([&] { mimo_noise_free_bound(MatrixXd(), one); }), HasSubstr("got none"));
  EXPECT_THAT(message_of([&] { mimo_noise_free_bound(std::nan("") * one, one); }), HasSubstr("finite"));
  EXPECT_THAT(message_of([&] { mimo_noise_free_bound(one, one, 0.0); }), HasSubstr("tau"));
  EXPECT_EQ(mimo_noise_free_bound(0.0 * one, one), std::numeric_limits<double>::infinity());
  EXPECT_EQ(mimo_noise_free_bound(0.0 * one, 0.0 * one), 0.0);
  EXPECT_THAT(message_of([&] { smallest_mimo_alpha(one, MatrixXd::Ones(1, 4), 0.1); }), HasSubstr("got 3 and 4"));
  EXPECT_THAT(message_of([&] { smallest_mimo_alpha(one, one, 0.0); }), HasSubstr("above 0, got 0"));
  EXPECT_THAT(message_of([&] { smallest_mimo_alpha(0.0 * one, one, 0.1); }), HasSubstr("v is zero"));
}

}  // namespace
}  // namespace blockid::testing
