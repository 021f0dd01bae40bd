#include <blockid/estimators/recursive_trends.hpp>
#include <blockid/estimators/trend_fit.hpp>

#include "data/message.hpp"
#include "support/signals.hpp"

#include <blockid/problems/janiszowski.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <vector>

namespace blockid {
namespace {

using problems::servo_response;
using ::testing::HasSubstr;
using testing::Noise;

constexpr double kD = 1e-3;
// Noise-free data inside the model: what rounding of differences of order m leaves, D^-2 times 1e-16 here.
constexpr double kExact = 1e-6;

Record noise_free(const Eigen::VectorXd& u, double sample_time_s = kD) {
  Record record;
  record.u = u;
  record.y = servo_response(u, sample_time_s).velocity_mm_s;
  record.sample_time_s = sample_time_s;
  return record;
}

TrendStructure without_b1(TrendScheme scheme) { return {scheme, 2, {1, 0}, {0}, 0}; }

TEST(Trends, operators_are_those_of_the_paper_for_order_two) {
  const double D = 0.5;
  using Eigen::Vector3d;
  // Goodwin: (1-q)^2, D q(1-q), D^2 q^2.
  EXPECT_EQ(output_trend(TrendScheme::goodwin, 2, 2, D), Vector3d(1, -2, 1));
  EXPECT_EQ(output_trend(TrendScheme::goodwin, 2, 1, D), D * Vector3d(0, 1, -1));
  EXPECT_EQ(output_trend(TrendScheme::goodwin, 2, 0, D), D * D * Vector3d(0, 0, 1));
  EXPECT_EQ(input_trend(TrendScheme::goodwin, 2, 1, D), D * Vector3d(0, 1, -1));
  EXPECT_EQ(input_trend(TrendScheme::goodwin, 2, 0, D), D * D * Vector3d(0, 0, 1));
  // Modified Tustin: 4(1-q)^2, 2D(1-q^2), D^2(1+q)^2; inputs 4D q(1-q), 2D^2 q(1+q).
  EXPECT_EQ(output_trend(TrendScheme::tustin, 2, 2, D), 4 * Vector3d(1, -2, 1));
  EXPECT_EQ(output_trend(TrendScheme::tustin, 2, 1, D), 2 * D * Vector3d(1, 0, -1));
  EXPECT_EQ(output_trend(TrendScheme::tustin, 2, 0, D), D * D * Vector3d(1, 2, 1));
  EXPECT_EQ(input_trend(TrendScheme::tustin, 2, 1, D), 4 * D * Vector3d(0, 1, -1));
  EXPECT_EQ(input_trend(TrendScheme::tustin, 2, 0, D), 2 * D * D * Vector3d(0, 1, 1));
}

TEST(Trends, operators_times_powers_of_s_are_those_of_the_substitution) {
  // With q^-1 = z: output operators of power i are s(z)^i times that of power 0.
  const std::complex<double> z = std::polar(1.0, -0.7);
  const double D = 0.01;
  const auto value = [&](const Eigen::VectorXd& p) {
    std::complex<double> sum = 0.0;
    for (Index k = p.size() - 1; k >= 0; --k) sum = sum * z + p[k];
    return sum;
  };
  const std::complex<double> delta = (1.0 - z) / (D * z);
  const std::complex<double> tustin = 2.0 * (1.0 - z) / (D * (1.0 + z));
  for (Index order = 1; order <= 6; ++order) {
    const std::complex<double> g0 = value(output_trend(TrendScheme::goodwin, order, 0, D));
    const std::complex<double> t0 = value(output_trend(TrendScheme::tustin, order, 0, D));
    for (Index power = 0; power <= order; ++power) {
      const double exponent = static_cast<double>(power);
      const std::complex<double> g = value(output_trend(TrendScheme::goodwin, order, power, D));
      const std::complex<double> t = value(output_trend(TrendScheme::tustin, order, power, D));
      EXPECT_NEAR(std::abs(g / (g0 * std::pow(delta, exponent)) - 1.0), 0.0, 1e-11);
      EXPECT_NEAR(std::abs(t / (t0 * std::pow(tustin, exponent)) - 1.0), 0.0, 1e-11);
      if (power == order) continue;
      const std::complex<double> input = value(input_trend(TrendScheme::tustin, order, power, D));
      EXPECT_NEAR(std::abs(input / (t * 2.0 * z / (1.0 + z)) - 1.0), 0.0, 1e-11);
    }
  }
}

TEST(Trends, full_goodwin_fit_is_the_exact_delta_form_whatever_the_input) {
  for (const std::uint64_t seed : {1, 2}) {
    const TrendFit fit = fit_trends(noise_free(Noise(seed).white(1500)), full_trends(TrendScheme::goodwin, 1, 2));
    EXPECT_NEAR(fit.a[1], 20.19734, 20 * kExact);
    EXPECT_NEAR(fit.a[0], 396.01333, 396 * kExact);
    EXPECT_NEAR(fit.b[1], 496.667, 1e-3);
    EXPECT_NEAR(fit.b[0], 990033.33, 1e6 * kExact);
    EXPECT_EQ(fit.rank, 4);
  }
}

struct Errors {
  double xi;
  double w0;
  double gain;
};

// Relative errors of damping, natural frequency and gain, in percent.
Errors errors_of(const TrendFit& fit) {
  const double w0 = std::sqrt(fit.a[0]);
  return {100.0 * std::abs(fit.a[1] / (2.0 * w0) / 0.5 - 1.0), 100.0 * std::abs(w0 / 20.0 - 1.0),
          100.0 * std::abs(fit.b[0] / fit.a[0] / 2500.0 - 1.0)};
}

Errors two_tone_errors(TrendScheme scheme, double sample_time_s) {
  const Index n = static_cast<Index>(std::llround(1.0 / sample_time_s));
  return errors_of(fit_trends(noise_free(problems::two_tones(n, sample_time_s), sample_time_s), without_b1(scheme)));
}

TEST(Trends, discretisation_errors_fall_with_the_sample_time_and_with_its_square) {
  // Reference: a numerical prototype, to the digits that it printed.
  EXPECT_NEAR(two_tone_errors(TrendScheme::goodwin, 1e-3).xi, 5.84, 0.01);
  EXPECT_NEAR(two_tone_errors(TrendScheme::tustin, 1e-3).xi, 0.0200, 2e-4);
  EXPECT_NEAR(two_tone_errors(TrendScheme::tustin, 1e-3).w0, 0.0033, 1e-4);
  EXPECT_NEAR(two_tone_errors(TrendScheme::goodwin, 4e-3).xi, 21.2, 0.1);
  EXPECT_NEAR(two_tone_errors(TrendScheme::tustin, 4e-3).xi, 0.317, 1e-3);
  for (const double D : {2e-3, 1e-3}) {
    const double goodwin =
        two_tone_errors(TrendScheme::goodwin, D).xi / two_tone_errors(TrendScheme::goodwin, 0.5 * D).xi;
    const double tustin = two_tone_errors(TrendScheme::tustin, D).xi / two_tone_errors(TrendScheme::tustin, 0.5 * D).xi;
    EXPECT_GE(goodwin, 1.9);
    EXPECT_LE(goodwin, 2.0);
    EXPECT_GE(tustin, 3.95);
    EXPECT_LE(tustin, 4.05);
  }
}

TEST(Trends, discretisation_errors_have_all_digits_of_the_prototype) {
  struct Row {
    TrendScheme scheme;
    double sample_time_s;
    Errors printed;
    Errors half_digit;
  };
  const TrendScheme goodwin = TrendScheme::goodwin;
  const TrendScheme tustin = TrendScheme::tustin;
  const std::vector<Row> rows = {{goodwin, 4e-3, {21.2, 0.16, 2.3}, {0.05, 0.005, 0.05}},
                                 {tustin, 4e-3, {0.317, 0.052, 0.007}, {8e-4, 5e-4, 5e-4}},
                                 {goodwin, 2e-3, {11.3, 0.036, 0.50}, {0.05, 5e-4, 5e-3}},
                                 {tustin, 2e-3, {0.080, 0.013, 0.0014}, {5e-4, 5e-4, 5e-5}},
                                 {goodwin, 1e-3, {5.84, 0.009, 0.09}, {5e-3, 5e-4, 5e-3}},
                                 {tustin, 1e-3, {0.0200, 0.0033, 0.0003}, {5e-5, 5e-5, 5e-5}},
                                 {goodwin, 0.5e-3, {2.96, 0.002, 0.0015}, {5e-3, 5e-4, 5e-5}},
                                 {tustin, 0.5e-3, {0.0050, 0.0008, 7e-5}, {5e-5, 5e-5, 5e-6}}};
  for (const Row& row : rows) {
    SCOPED_TRACE((row.scheme == goodwin ? "goodwin " : "tustin ") + std::to_string(1e3 * row.sample_time_s) + " ms");
    const Errors found = two_tone_errors(row.scheme, row.sample_time_s);
    EXPECT_NEAR(found.xi, row.printed.xi, row.half_digit.xi);
    EXPECT_NEAR(found.w0, row.printed.w0, row.half_digit.w0);
    EXPECT_NEAR(found.gain, row.printed.gain, row.half_digit.gain);
  }
}

TEST(Trends, columns_of_unit_norm_are_well_conditioned) {
  const TrendFit fit = fit_trends(noise_free(problems::two_tones(1000, kD)), without_b1(TrendScheme::goodwin));
  // cond(X'X) = cond(X)^2.
  EXPECT_NEAR(fit.condition * fit.condition, 3.50, 0.01);
}

TEST(Trends, recursion_equals_the_batch) {
  Record record = noise_free(Noise(3).white(600));
  record.y += Noise(4).white(600, 0.5);
  for (const TrendScheme scheme : {TrendScheme::goodwin, TrendScheme::tustin}) {
    const TrendStructure structure = full_trends(scheme, 1, 2);
    const TrendFit batch = fit_trends(record, structure);
    const Eigen::MatrixXd history = trend_history(record.u, record.y, structure, kD);
    const Eigen::Vector4d expected(batch.a[1], batch.a[0], batch.b[1], batch.b[0]);
    const Eigen::Vector4d reached = history.row(599).transpose();
    EXPECT_LE(((reached - expected).array() / expected.array()).abs().maxCoeff(), 1e-8);
    EXPECT_TRUE(history.topRows(5).array().isNaN().all());
  }
}

TEST(Trends, predicted_errors_are_those_of_the_difference_equation) {
  // Brute force: y(k) from the past and the fitted coefficients, equation (10).
  Record record = noise_free(Noise(5).white(200));
  record.y += Noise(6).white(200, 0.01);
  const TrendStructure structure = without_b1(TrendScheme::tustin);
  const TrendFit fit = fit_trends(record, structure);
  double squared = 0.0;
  double absolute = 0.0;
  for (Index k = 2; k < 200; ++k) {
    double alpha = 0.0;
    double rest = 0.0;
    for (Index i = 0; i <= 2; ++i) {
      const Eigen::VectorXd r = output_trend(TrendScheme::tustin, 2, i, kD);
      alpha += fit.a[i] * r[0];
      rest -= fit.a[i] * (r[1] * record.y[k - 1] + r[2] * record.y[k - 2]);
    }
    const Eigen::VectorXd p = input_trend(TrendScheme::tustin, 2, 0, kD);
    rest += fit.b[0] * (p[0] * record.u[k] + p[1] * record.u[k - 1] + p[2] * record.u[k - 2]);
    const double error = record.y[k] - rest / alpha;
    squared += error * error;
    absolute += std::abs(error);
  }
  EXPECT_NEAR(fit.squared_error, squared, 1e-8 * squared);
  EXPECT_NEAR(fit.absolute_error, absolute, 1e-8 * absolute);
}

TEST(Trends, the_criterion_finds_the_delay) {
  constexpr Index kDelay = 7;
  Record record = noise_free(Noise(7).white(800));
  Eigen::VectorXd late = Eigen::VectorXd::Zero(800);
  late.tail(800 - kDelay) = record.u.head(800 - kDelay);
  record.y = servo_response(late, kD).velocity_mm_s + Noise(8).white(800, 1e-3);
  for (const TrendCriterion criterion : {TrendCriterion::squared, TrendCriterion::absolute}) {
    const TrendFit fit = fit_trends_with_delay(record, full_trends(TrendScheme::goodwin, 1, 2), 12, criterion);
    EXPECT_EQ(fit.structure.delay, kDelay);
  }
}

TEST(Trends, a_missing_coefficient_stays_zero_and_an_integrator_is_found) {
  // Position: x''' + 20 x'' + 400 x' = 1e6 u, so power 0 of A(s) is left out.
  Record record = noise_free(problems::two_tones(3000, kD));
  record.y = servo_response(record.u, kD).position_mm;
  const TrendFit fit = fit_trends(record, {TrendScheme::tustin, 3, {2, 1}, {0}, 0});
  EXPECT_EQ(fit.a[0], 0.0);
  EXPECT_EQ(fit.b[1], 0.0);
  // Discretisation errors of order (D |s|)^2 = 0.6 % at 12 Hz bound what can be asked.
  EXPECT_NEAR(fit.a[2], 20.0, 0.12);
  EXPECT_NEAR(fit.a[1], 400.0, 2.4);
  const Eigen::VectorXcd roots = poles(fit);
  EXPECT_EQ(roots.cwiseAbs().minCoeff(), 0.0);
  EXPECT_FALSE(is_stable(fit));
}

TEST(Trends, poles_are_the_roots_of_the_denominator) {
  TrendFit fit;
  fit.structure.order = 3;
  // (s + 1) (s + 100) (s + 1e4)
  fit.a = Eigen::Vector4d(1e6, 1.0101e6 + 0.0, 10101.0, 1.0);
  fit.a[1] = 1.0 * 100.0 + 1.0 * 1e4 + 100.0 * 1e4;
  Eigen::VectorXd sorted = poles(fit).real();
  std::sort(sorted.begin(), sorted.end());
  EXPECT_NEAR(sorted[0], -1e4, 1e-6);
  EXPECT_NEAR(sorted[1], -100.0, 1e-8);
  EXPECT_NEAR(sorted[2], -1.0, 1e-8);
  EXPECT_TRUE(is_stable(fit));
}

TEST(Trends, simulation_of_the_true_coefficients_is_the_plant) {
  TrendFit fit;
  fit.structure = full_trends(TrendScheme::tustin, 1, 2, 3);
  fit.a = Eigen::Vector3d(400.0, 20.0, 1.0);
  fit.b = Eigen::Vector2d(1e6, 0.0);
  const Eigen::VectorXd u = Noise(16).white(300);
  Eigen::VectorXd late = Eigen::VectorXd::Zero(300);
  late.tail(297) = u.head(297);
  const Eigen::VectorXd expected = servo_response(late, kD).velocity_mm_s;
  EXPECT_LE((simulate(fit, u, kD) - expected).norm(), 1e-11 * expected.norm());
  // Two integrators: the step response is t^2 / 2.
  fit.structure.delay = 0;
  fit.a = Eigen::Vector3d(0.0, 0.0, 1.0);
  fit.b = Eigen::Vector2d(1.0, 0.0);
  EXPECT_NEAR(simulate(fit, Eigen::VectorXd::Ones(11), 0.1)[10], 0.5, 1e-12);
}

TEST(Trends, rows_with_a_missing_output_are_left_out) {
  Record record = noise_free(Noise(10).white(400));
  record.weights = Eigen::VectorXd::Ones(400);
  record.weights[100] = 0.0;
  record.y[100] = std::numeric_limits<double>::quiet_NaN();
  const TrendFit fit = fit_trends(record, full_trends(TrendScheme::goodwin, 1, 2));
  EXPECT_EQ(fit.rows, 400 - 2 - 3);
  EXPECT_NEAR(fit.a[0], 396.01333, 396 * kExact);
}

TEST(Trends, weights_decide_between_contradicting_records) {
  DataSet data(noise_free(Noise(11).white(500)));
  Record wrong = noise_free(Noise(12).white(500));
  wrong.y *= 3.0;
  wrong.weights = Eigen::VectorXd::Constant(500, 1e-6);
  data.records.push_back(wrong);
  const TrendFit fit = fit_trends(data, full_trends(TrendScheme::goodwin, 1, 2));
  EXPECT_NEAR(fit.b[0], 990033.33, 1e6 * kExact);
}

TEST(Trends, forgetting_follows_a_plant_that_changes) {
  const Eigen::VectorXd u = Noise(13).white(4000);
  Eigen::VectorXd y = servo_response(u, kD).velocity_mm_s;
  // From sample 2000 on twice the gain: the same motion, driven twice as hard.
  Eigen::VectorXd doubled = u;
  doubled.tail(2000) *= 2.0;
  y = servo_response(doubled, kD).velocity_mm_s;
  const TrendStructure structure = full_trends(TrendScheme::goodwin, 1, 2);
  const Eigen::MatrixXd history = trend_history(u, y, structure, kD, 0.98);
  EXPECT_NEAR(history(1990, 3), 990033.33, 10.0);
  EXPECT_NEAR(history(3999, 3), 2.0 * 990033.33, 10.0);
  const Eigen::MatrixXd all = trend_history(u, y, structure, kD);
  EXPECT_GT(std::abs(all(3999, 3) / (2.0 * 990033.33) - 1.0), 0.05);
}

TEST(Trends, convergence_and_settling_read_off_a_history) {
  Eigen::MatrixXd history(5, 2);
  history << 1.0, 4.0, 2.0, 4.0, 2.0, 5.0, 2.1, 5.0, 2.0, 5.0;
  // Steps 1..4: max(1/2, 0), max(0, 1/5), max(0.1/2.1, 0), max(0.1/2, 0).
  EXPECT_NEAR(convergence(history, 1, 5), (0.5 + 0.2 + 0.1 / 2.1 + 0.05) / 4.0, 1e-15);
  EXPECT_EQ(settling_sample(history, 0.1), 2);
  EXPECT_EQ(settling_sample(history, 0.01), 4);
  EXPECT_THAT(testing::message_of([&] { convergence(history, 0, 5); }), HasSubstr("expected 1 <= first < last <= 5"));
}

TEST(Trends, too_many_coefficients_lose_rank_and_say_so) {
  // A sine excites two directions of the input only.
  const Record record =
      noise_free(Eigen::VectorXd::NullaryExpr(4000, [](Index k) { return std::sin(0.05 * static_cast<double>(k)); }));
  Record steady = slice(record, 2000, 4000);
  const TrendFit fit = fit_trends(steady, full_trends(TrendScheme::goodwin, 2, 3));
  EXPECT_LT(fit.rank, 6);
  EXPECT_TRUE(std::isinf(fit.condition));
}

TEST(Trends, refuses_bad_structures_and_data) {
  const Record record = noise_free(Noise(14).white(50));
  const auto refused = [&](const TrendStructure& structure) {
    return testing::message_of([&] { fit_trends(record, structure); });
  };
  EXPECT_THAT(refused({TrendScheme::tustin, 0, {}, {0}, 0}), HasSubstr("order of at least 1, got 0"));
  EXPECT_THAT(refused({TrendScheme::tustin, 2, {2}, {0}, 0}), HasSubstr("powers of A(s) must lie in 0..1"));
  EXPECT_THAT(refused({TrendScheme::tustin, 2, {1}, {0, 0}, 0}), HasSubstr("power 0 of B(s) is given twice"));
  EXPECT_THAT(refused({TrendScheme::tustin, 2, {1}, {}, 0}), HasSubstr("at least one power of B(s)"));
  EXPECT_THAT(refused({TrendScheme::tustin, 2, {1}, {0}, -1}), HasSubstr("delay of at least 0 samples, got -1"));
  EXPECT_THAT(refused({TrendScheme::tustin, 2, {1, 0}, {0}, 46}), HasSubstr("at least 3 complete rows"));
  EXPECT_THAT(testing::message_of([] { full_trends(TrendScheme::tustin, 2, 2); }), HasSubstr("0 <= nb < order"));
  Record constant = record;
  constant.u.setOnes();
  EXPECT_THAT(testing::message_of([&] { fit_trends(constant, without_b1(TrendScheme::tustin)); }),
              HasSubstr("constant"));
  DataSet two(record);
  two.records.push_back(noise_free(Noise(15).white(50), 2e-3));
  EXPECT_THAT(testing::message_of([&] { fit_trends(two, without_b1(TrendScheme::tustin)); }),
              HasSubstr("one sample time in all records, got 0.001 s and 0.002 s"));
}

}  // namespace
}  // namespace blockid
