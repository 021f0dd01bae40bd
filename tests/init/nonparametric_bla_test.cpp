#include <blockid/init/nonparametric_bla.hpp>

#include "data/message.hpp"
#include "estimators/systems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <vector>

namespace blockid {
namespace {

using Eigen::VectorXcd;
using Eigen::VectorXd;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::Noise;

// A number further than this many standard deviations from the truth has a probability of 7e-6.
constexpr double kDeviations = 4.5;
constexpr Index kPeriod = 256;
constexpr Index kLines = 80;

using System = std::function<VectorXd(const VectorXd&)>;

System linear_system() {
  return [](const VectorXd& u) { return simulate(testing::linear(), u); };
}

// A filter, then v + 0.1 v^3.
System cubic_system() {
  return [](const VectorXd& u) {
    const VectorXd v = simulate(testing::linear(), u);
    return VectorXd(v.array() + 0.1 * v.array().cube());
  };
}

// A filter, then v^2.
System even_system() {
  return [](const VectorXd& u) { return VectorXd(simulate(testing::linear(), u).array().square()); };
}

// One period of sum_k a cos(2 pi k t / N + phi_k), k = 1 .. kLines, mean square 1, random phases.
VectorXd multisine(Noise& numbers) {
  VectorXd u = VectorXd::Zero(kPeriod);
  for (Index k = 1; k <= kLines; ++k) {
    const double phase = 2.0 * std::numbers::pi * numbers.uniform();
    for (Index t = 0; t < kPeriod; ++t) {
      const double turn = 2.0 * std::numbers::pi * static_cast<double>(k * t % kPeriod) / kPeriod;
      u[t] += std::sqrt(2.0 / kLines) * std::cos(turn + phase);
    }
  }
  return u;
}

// One period of transient, then `periods` of them; white noise at the output.
DataSet periodic_data(const System& system, Index realisations, Index periods, double noise, std::uint64_t seed) {
  Noise numbers(seed);
  DataSet data;
  for (Index m = 0; m < realisations; ++m) {
    Record record;
    record.u = multisine(numbers).replicate(periods + 1, 1);
    record.y = system(record.u) + numbers.white(record.u.size(), noise);
    record.period = kPeriod;
    data.records.push_back(record);
  }
  return data;
}

PeriodicBlaOptions without_transient() {
  PeriodicBlaOptions options;
  options.transient_periods = 1;
  return options;
}

VectorXcd true_response(const Model& model, const VectorXd& omega) {
  VectorXcd g(omega.size());
  for (Index k = 0; k < g.size(); ++k) {
    const std::vector<double> theta(model.parameters.begin(), model.parameters.end());
    g[k] = *model.chain.frequency_response(theta, omega[k]);
  }
  return g;
}

// sum_k of F chi-square numbers with 2 nu degrees of freedom each, over its expectation: deviation 1 / sqrt(nu F).
void expect_one(double ratio, Index nu, Index lines, const char* what) {
  EXPECT_NEAR(ratio, 1.0, kDeviations / std::sqrt(static_cast<double>(nu * lines))) << what;
}

TEST(PeriodicBlaTest, VariancesOfALinearSystemAreThoseOfTheNoise) {
  constexpr double kNoise = 0.5;
  constexpr Index kRealisations = 6;
  constexpr Index kPeriods = 4;
  const DataSet data = periodic_data(linear_system(), kRealisations, kPeriods, kNoise, 1);
  const NonparametricBla bla = periodic_bla(data, without_transient());
  ASSERT_EQ(bla.response.response.size(), kLines);
  EXPECT_EQ(bla.periods, kPeriods);
  EXPECT_EQ(bla.realisations, kRealisations);
  EXPECT_EQ(bla.noise_dof, kRealisations * (kPeriods - 1));
  EXPECT_EQ(bla.total_dof, kRealisations - 1);
  EXPECT_NO_THROW(check(bla.response));
  EXPECT_NEAR(bla.response.omega_rad_s[4], 2.0 * std::numbers::pi * 5.0 / kPeriod, 1e-12);
  EXPECT_NEAR(bla.input_power.sum(), 1.0, 1e-9);
  // E |V_k|^2 = N s^2, |U_k|^2 = N^2 / (2 kLines).
  const double theory = kNoise * kNoise * 2.0 * kLines / kPeriod / (kRealisations * kPeriods);
  expect_one(bla.noise_variance.mean() / theory, bla.noise_dof, kLines, "noise variance");
  expect_one(bla.total_variance.mean() / theory, bla.total_dof, kLines, "total variance");
  const VectorXcd error = bla.response.response - true_response(testing::linear(), bla.response.omega_rad_s);
  expect_one(error.cwiseAbs2().mean() / theory, 1, kLines, "error of G");

  const NonlinearityVerdict verdict = nonlinearity(bla);
  EXPECT_EQ(verdict.kind, Nonlinearity::none);
  EXPECT_LT(std::abs(verdict.powers.distortion), kDeviations * verdict.powers.distortion_deviation);
  // The noise at the lines excited.
  expect_one(verdict.powers.noise / (kNoise * kNoise * 2.0 * kLines / kPeriod), bla.noise_dof, kLines, "noise power");
  const double linear = bla.input_power.dot(true_response(testing::linear(), bla.response.omega_rad_s).cwiseAbs2());
  EXPECT_NEAR(verdict.powers.linear, linear, 0.05 * linear);
  EXPECT_FALSE(bla_vanishes(bla).vanishes);
}

TEST(PeriodicBlaTest, LeavesOutWhatTheDataCannotGive) {
  const NonparametricBla one = periodic_bla(periodic_data(linear_system(), 1, 3, 0.1, 2), without_transient());
  EXPECT_EQ(one.noise_dof, 2);
  EXPECT_EQ(one.total_variance.size() + one.distortion_variance.size() + one.rest_power.size(), 0);
  EXPECT_EQ((one.response.standard_deviation - one.noise_variance.cwiseSqrt()).norm(), 0.0);
  EXPECT_EQ(nonlinearity(one).kind, Nonlinearity::unknown);
  EXPECT_THAT(BLOCKID_MESSAGE(bla_vanishes(one)), HasSubstr("total variance"));
  const NonparametricBla once = periodic_bla(periodic_data(linear_system(), 3, 1, 0.1, 3), without_transient());
  EXPECT_EQ(once.total_dof, 2);
  EXPECT_EQ(once.noise_variance.size() + once.distortion_variance.size(), 0);
  EXPECT_EQ(once.rest_power.size(), kLines);
  EXPECT_EQ(nonlinearity(once).kind, Nonlinearity::unknown);
  EXPECT_FALSE(bla_vanishes(once).vanishes);
}

// G_m at line k of one realisation by the definition of the transform.
std::complex<double> response_at(const Record& record, Index k) {
  std::complex<double> u;
  std::complex<double> y;
  for (Index t = 0; t < kPeriod; ++t) {
    const std::complex<double> turn = std::polar(1.0, -2.0 * std::numbers::pi * static_cast<double>(k * t) / kPeriod);
    u += turn * record.u[kPeriod + t];
    y += turn * record.y[kPeriod + t];
  }
  return y / u;
}

TEST(PeriodicBlaTest, DistortionOfACubicIsThatOfAMonteCarloExperiment) {
  constexpr Index kRuns = 400;
  constexpr Index kExperiments = 16;
  constexpr Index kRealisations = 10;
  const DataSet runs = periodic_data(cubic_system(), kRuns, 1, 0.0, 4);
  double expected = 0.0;
  VectorXcd mean(kLines);
  for (Index k = 1; k <= kLines; ++k) {
    VectorXcd g(kRuns);
    for (Index m = 0; m < kRuns; ++m) g[m] = response_at(runs.records[static_cast<std::size_t>(m)], k);
    mean[k - 1] = g.mean();
    // Amplitudes are equal and the input's mean square is 1.
    expected += (g.array() - g.mean()).abs2().sum() / (kRuns - 1.0) / kLines;
  }
  VectorXd found(kExperiments);
  VectorXd misfit(kExperiments);
  for (Index i = 0; i < kExperiments; ++i) {
    const DataSet data = periodic_data(cubic_system(), kRealisations, 3, 0.3, static_cast<std::uint64_t>(50 + i));
    const NonparametricBla bla = periodic_bla(data, without_transient());
    const NonlinearityVerdict verdict = nonlinearity(bla);
    found[i] = verdict.powers.distortion;
    EXPECT_EQ(verdict.kind, Nonlinearity::strong);
    EXPECT_LT(verdict.p_value, 1e-6);
    EXPECT_NEAR(verdict.distortion_db, 10.0 * std::log10(found[i] / verdict.powers.linear), 1e-9);
    EXPECT_NEAR(verdict.powers.rest, found[i] + verdict.powers.noise, 1e-9 * verdict.powers.rest);
    EXPECT_FALSE(bla_vanishes(bla).vanishes);
    misfit[i] = (bla.response.response - mean).cwiseAbs2().cwiseQuotient(bla.total_variance).mean();
  }
  // The lines share their distortion, so that the spread is taken from the experiments themselves.
  const auto spread_of = [](const VectorXd& x) {
    return std::sqrt((x.array() - x.mean()).square().sum() / (kExperiments - 1.0));
  };
  const double spread = spread_of(found);
  EXPECT_NEAR(found.mean(), expected,
              kDeviations * spread * std::sqrt(1.0 / kExperiments + 1.0 * kRealisations / kRuns));
  EXPECT_LT(spread, 0.5 * expected);
  // The BLA is that of the Monte-Carlo experiment: F(2, 2 nu) numbers of mean nu / (nu - 1).
  constexpr double kNu = kRealisations - 1.0;
  EXPECT_NEAR(misfit.mean(), (1.0 + 1.0 * kRealisations / kRuns) * kNu / (kNu - 1.0),
              kDeviations * spread_of(misfit) / std::sqrt(1.0 * kExperiments));
  EXPECT_LT(spread_of(misfit), 0.5);
}

TEST(PeriodicBlaTest, AnEvenNonlinearityHasNone) {
  const NonparametricBla bla = periodic_bla(periodic_data(even_system(), 8, 2, 0.1, 6), without_transient());
  const VanishingBla test = bla_vanishes(bla);
  EXPECT_TRUE(test.vanishes) << test.p_value;
  EXPECT_EQ(test.degrees_of_freedom, 2 * kLines);
  EXPECT_LT(test.explained, 0.1);
  EXPECT_EQ(nonlinearity(bla).kind, Nonlinearity::strong);
}

// How often a test at 10 % sees what is not there, of `runs`: a binomial number.
void expect_tenth(Index count, Index runs) {
  const double n = static_cast<double>(runs);
  EXPECT_NEAR(static_cast<double>(count), 0.1 * n, kDeviations * std::sqrt(0.09 * n));
}

TEST(VanishingBlaTest, FalseAlarmsAreAsOftenAsStated) {
  constexpr Index kRuns = 300;
  constexpr Index kSamples = 400;
  Index periodic = 0;
  Index arbitrary = 0;
  const System nothing = [](const VectorXd& u) { return VectorXd(0.0 * u); };
  for (Index run = 0; run < kRuns; ++run) {
    const auto seed = static_cast<std::uint64_t>(1000 + run);
    if (!bla_vanishes(periodic_bla(periodic_data(nothing, 3, 1, 1.0, seed)), 0.1).vanishes) ++periodic;
    Record record;
    Noise numbers(seed);
    record.u = numbers.white(kSamples);
    record.y = numbers.white(kSamples);
    LocalPolynomialOptions options;
    options.spacing = 5;
    if (!bla_vanishes(local_polynomial_bla(record, options), 0.1).vanishes) ++arbitrary;
  }
  expect_tenth(periodic, kRuns);
  expect_tenth(arbitrary, kRuns);
}

TEST(PeriodicBlaTest, LinesAreThoseExcitedOrThoseAsked) {
  DataSet data = periodic_data(linear_system(), 2, 2, 0.1, 7);
  PeriodicBlaOptions options = without_transient();
  options.lines = {3, 5, 40};
  const NonparametricBla some = periodic_bla(data, options);
  const NonparametricBla all = periodic_bla(data, without_transient());
  ASSERT_EQ(some.response.response.size(), 3);
  EXPECT_EQ(some.response.response[2], all.response.response[39]);
  options.lines = {3, 100};
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(data, options)), AllOf(HasSubstr("line 100"), HasSubstr("not excited")));
  options.lines = {128};
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(data, options)), HasSubstr("1 .. 127"));
  options.lines = {5, 5};
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(data, options)), HasSubstr("increasing"));
}

TEST(PeriodicBlaTest, MistakesAreNamed) {
  const DataSet data = periodic_data(linear_system(), 2, 2, 0.1, 8);
  DataSet wrong = data;
  wrong.records[1].period = 0;
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(wrong)), HasSubstr("no period"));
  wrong.records[1].period = 128;
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(wrong)), AllOf(HasSubstr("128"), HasSubstr("256")));
  wrong = data;
  wrong.records[0].weights = VectorXd::Ones(wrong.records[0].y.size());
  wrong.records[0].weights[7] = 0.0;
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(wrong)), HasSubstr("missing"));
  PeriodicBlaOptions options;
  options.transient_periods = 3;
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(data, options)), HasSubstr("3 whole periods"));
  options.transient_periods = 2;
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(data.records[0], options)),
              AllOf(HasSubstr("two periods"), HasSubstr("two realisations")));
  options.transient_periods = -1;
  EXPECT_THAT(BLOCKID_MESSAGE(periodic_bla(data, options)), HasSubstr("-1"));
  EXPECT_THAT(BLOCKID_MESSAGE(nonlinearity(periodic_bla(data), 1.5)), HasSubstr("1.5"));
}

TEST(LocalPolynomialBlaTest, VariancesOfALinearSystemAreThoseOfTheNoise) {
  constexpr double kNoise = 0.5;
  constexpr Index kSamples = 8100;
  const Record record = testing::simulated_record(testing::linear(), kSamples, kNoise, 9);
  // Two records as one data set, and a length with large prime factors.
  DataSet pair(record);
  pair.records.push_back(testing::simulated_record(testing::linear(), kSamples + 11, kNoise, 10));
  for (const DataSet& data : {DataSet(record), pair}) {
    const NonparametricBla bla = local_polynomial_bla(data);
    const Index lines = bla.response.response.size();
    ASSERT_GT(lines, 200);
    EXPECT_GE(bla.total_dof, 12);
    EXPECT_EQ(bla.independent_step, 1);
    EXPECT_EQ(bla.noise_variance.size(), 0);
    EXPECT_NO_THROW(check(bla.response));
    EXPECT_NEAR(bla.input_power.sum(), 1.0, 0.06);
    // White noise in the share of the lines that the windows cover: 2 / N of its power each.
    const Index width = (bla.total_dof + 3 * (bla.realisations + 1)) / bla.realisations;
    const double covered = 2.0 * static_cast<double>(lines * width) / static_cast<double>(kSamples);
    expect_one(bla.rest_power.sum() / (kNoise * kNoise * covered), bla.total_dof, lines, "rest power");
    const VectorXcd error = bla.response.response - true_response(testing::linear(), bla.response.omega_rad_s);
    // F(2, 2 nu) numbers: mean nu / (nu - 1), variance below twice that of the exponential distribution.
    const double nu = static_cast<double>(bla.total_dof);
    const double mean = error.cwiseAbs2().cwiseQuotient(bla.total_variance).mean();
    EXPECT_NEAR(mean, nu / (nu - 1.0), kDeviations * std::sqrt(2.0 / static_cast<double>(lines)));
    EXPECT_FALSE(bla_vanishes(bla).vanishes);
    EXPECT_EQ(nonlinearity(bla).kind, Nonlinearity::unknown);
  }
}

TEST(LocalPolynomialBlaTest, TheRestOfACubicIsItsDistortion) {
  // f(u) = u + 0.3 u^3, u ~ N(0, 1): BLA 1.9, distortion 0.3 (u^3 - 3 u) of power 0.09 * 6 = 0.54, white.
  constexpr Index kSamples = 65536;
  Record record;
  record.u = Noise(11).white(kSamples);
  record.y = record.u.array() + 0.3 * record.u.array().cube();
  const NonparametricBla bla = local_polynomial_bla(record);
  const double lines = static_cast<double>(bla.response.response.size());
  const double nu = static_cast<double>(bla.total_dof);
  const BlaPowers p = powers(bla);
  // The power of the distortion varies with the realisation, too: var (d^2) / N = (E d^4 - 0.54^2) / N, with
  // E (u^3 - 3 u)^4 = 3348.
  const double deviation =
      std::sqrt(0.54 * 0.54 / (lines * nu) + (0.0081 * 3348.0 - 0.54 * 0.54) / static_cast<double>(kSamples));
  EXPECT_NEAR(p.rest, 0.54, kDeviations * deviation);
  EXPECT_NEAR(std::abs(bla.response.response.mean()), 1.9, 0.05);
  EXPECT_NEAR(p.linear, 1.9 * 1.9, 0.15);
}

TEST(LocalPolynomialBlaTest, AnEvenNonlinearityHasNone) {
  Record record;
  record.u = Noise(12).white(16384);
  record.y = even_system()(record.u) + Noise(13).white(16384, 0.1);
  const VanishingBla test = bla_vanishes(local_polynomial_bla(record));
  EXPECT_TRUE(test.vanishes) << test.p_value;
  EXPECT_LT(test.explained, 0.05);
  record.y += 0.3 * record.u;
  EXPECT_FALSE(bla_vanishes(local_polynomial_bla(record)).vanishes);
}

TEST(LocalPolynomialBlaTest, OverlappingWindowsAreKnownAsSuch) {
  const Record record = testing::simulated_record(testing::linear(), 2000, 0.5, 14);
  LocalPolynomialOptions options;
  options.spacing = 1;
  const NonparametricBla dense = local_polynomial_bla(record, options);
  const NonparametricBla sparse = local_polynomial_bla(record);
  EXPECT_EQ(dense.response.response[0], sparse.response.response[0]);
  EXPECT_EQ(dense.response.response[dense.independent_step], sparse.response.response[1]);
  EXPECT_NEAR(bla_vanishes(dense).statistic, bla_vanishes(sparse).statistic, 1e-6 * bla_vanishes(sparse).statistic);
  EXPECT_NEAR(powers(dense).rest, powers(sparse).rest, 0.2 * powers(sparse).rest);
}

TEST(LocalPolynomialBlaTest, MistakesAreNamed) {
  Record record = testing::simulated_record(testing::linear(), 30, 0.1, 15);
  EXPECT_THAT(BLOCKID_MESSAGE(local_polynomial_bla(record)), AllOf(HasSubstr("30 samples"), HasSubstr("19")));
  record = testing::simulated_record(testing::linear(), 300, 0.1, 16);
  record.u.setConstant(1.0);
  EXPECT_THAT(BLOCKID_MESSAGE(local_polynomial_bla(record)), HasSubstr("1"));
  LocalPolynomialOptions options;
  options.degrees_of_freedom = 0;
  EXPECT_THAT(
      BLOCKID_MESSAGE(local_polynomial_bla(testing::simulated_record(testing::linear(), 300, 0.1, 17), options)),
      HasSubstr("degrees of freedom"));
}

}  // namespace
}  // namespace blockid
