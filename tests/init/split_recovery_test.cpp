// Known Wiener-Hammerstein systems, identified from input and output alone.
#include "estimators/systems.hpp"

#include <blockid/blocks/rational.hpp>
#include <blockid/estimators/fit.hpp>
#include <blockid/init/split.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

namespace blockid {
namespace {

using testing::Noise;

// Fraction of the output's deviation.
constexpr double kNoise = 0.01;
// Of the noise; the deviation of the rmse over 4000 samples is 1.1 %.
constexpr double kSuccess = 1.05;

// Filter of `order` with poles within 0.4 .. 0.85 and zeros within 0.7, in text and numbers.
struct Filter {
  Index order;
  Eigen::VectorXd theta;
};

Filter random_filter(Index order, Noise& numbers) {
  Eigen::VectorXd b = Eigen::VectorXd::Ones(1);
  Eigen::VectorXd a = Eigen::VectorXd::Ones(1);
  const auto times = [](Eigen::VectorXd& p, std::initializer_list<double> factor) {
    const Eigen::VectorXd f = Eigen::Map<const Eigen::VectorXd>(factor.begin(), static_cast<Index>(factor.size()));
    Eigen::VectorXd result = Eigen::VectorXd::Zero(p.size() + f.size() - 1);
    for (Index k = 0; k < p.size(); ++k) result.segment(k, f.size()) += p[k] * f;
    p = result;
  };
  if (order % 2 == 1) {
    times(a, {1.0, -(0.4 + 0.45 * numbers.uniform())});
    times(b, {1.0, -0.7 + 1.4 * numbers.uniform()});
  }
  for (Index k = 0; k < order / 2; ++k) {
    const double radius = 0.4 + 0.45 * numbers.uniform();
    times(a, {1.0, -2.0 * radius * std::cos(0.2 + 1.8 * numbers.uniform()), radius * radius});
    const double zero = 0.2 + 0.5 * numbers.uniform();
    times(b, {1.0, -2.0 * zero * std::cos(0.3 + 2.5 * numbers.uniform()), zero * zero});
  }
  Eigen::VectorXd theta(2 * order + 1);
  theta << b, a.tail(order);
  return {order, theta};
}

Eigen::VectorXd filtered(const Filter& filter, const Eigen::VectorXd& u) {
  Model model = make_model(Rational(filter.order, filter.order));
  model.parameters = filter.theta;
  const Eigen::VectorXd y = simulate(model, u);
  return y / std::sqrt((y.array() - y.mean()).square().mean());
}

double apply(const std::string& f, double v) {
  if (f == "tanh") return std::tanh(1.5 * v);
  if (f == "polynomial") return v + 0.4 * v * v - 0.15 * v * v * v;
  if (f == "saturation") return std::clamp(v, -0.8, 1.1);
  return v > 0.4 ? v - 0.4 : (v < -0.3 ? v + 0.3 : 0.0);  // dead_zone
}

struct Case {
  Index order;
  std::string f;
  std::string block;
  std::uint64_t seed;
};

class WienerHammersteinRecovery : public ::testing::TestWithParam<Case> {};

TEST_P(WienerHammersteinRecovery, ReachesTheNoise) {
  const Case& wanted = GetParam();
  constexpr Index kSamples = 4000;
  Noise numbers(wanted.seed);
  const Filter first = random_filter(wanted.order, numbers);
  const Filter second = random_filter(wanted.order, numbers);
  Record record;
  record.u = numbers.white(kSamples);
  const Eigen::VectorXd v = filtered(first, record.u).unaryExpr([&](double x) { return apply(wanted.f, x); });
  record.y = 2.0 * filtered(second, v) + numbers.white(kSamples, 2.0 * kNoise);
  const std::string filter =
      "rational(nb=" + std::to_string(wanted.order) + ",na=" + std::to_string(wanted.order) + ")";
  FitOptions options;
  options.threads = 2;
  const FitResult result =
      fit(parse("G1=" + filter + " | f=" + wanted.block + " | G2=" + filter), record, exhaustive_split(), options);
  EXPECT_LT(result.report.rmse, kSuccess * 2.0 * kNoise) << result.trials.front().candidate.how;
  EXPECT_GT(result.report.rmse, 0.9 * 2.0 * kNoise);
}

INSTANTIATE_TEST_SUITE_P(Known, WienerHammersteinRecovery,
                         ::testing::Values(Case{2, "polynomial", "polynomial(degree=3)", 1},
                                           Case{3, "polynomial", "polynomial(degree=3)", 2},
                                           Case{2, "tanh", "tanh_network(units=1)", 3},
                                           Case{3, "tanh", "spline(knots=14)", 4},
                                           Case{2, "saturation", "saturation", 5},
                                           Case{3, "saturation", "saturation", 6}, Case{2, "dead_zone", "dead_zone", 7},
                                           Case{2, "tanh", "spline(knots=14)", 8}),
                         [](const auto& instance) {
                           return instance.param.f + "_" + std::to_string(instance.param.order) + "_" +
                                  instance.param.block.substr(0, instance.param.block.find('('));
                         });

// f acts at four times the rate, as in a circuit: the plain chain folds its harmonics back, the oversampled one does
// not.
struct FineCase {
  std::string f;
  Eigen::VectorXd theta;
};

class OversampledRecovery : public ::testing::TestWithParam<FineCase> {};

AnyBlock around(const std::string& f) { return parse("G1=rational(nb=2,na=2) | f=" + f + " | G2=rational(nb=2,na=2)"); }

double identified_rmse(const std::string& f, const Record& record) {
  FitOptions options;
  options.threads = 2;
  return fit(around(f), record, exhaustive_split(), options).report.rmse;
}

double deviation(const Eigen::VectorXd& y) { return std::sqrt((y.array() - y.mean()).square().mean()); }

TEST_P(OversampledRecovery, ReachesTheNoiseThatThePlainChainMisses) {
  constexpr Index kSamples = 4000;
  Noise numbers(21);
  const Filter first = random_filter(2, numbers);
  const Filter second = random_filter(2, numbers);
  const std::string fine = "oversampled(" + GetParam().f + ",factor=4)";
  Record record;
  record.u = numbers.white(kSamples);
  Model filter = make_model(Rational(2, 2));
  filter.parameters = first.theta;
  const double gain = 1.0 / deviation(simulate(filter, record.u));
  Model system = make_model(around(fine));
  system.parameters << gain * first.theta.head(3), first.theta.tail(2), GetParam().theta, second.theta;
  record.y = simulate(system, record.u);
  const double noise = kNoise * deviation(record.y);
  record.y += numbers.white(kSamples, noise);
  const double rmse = identified_rmse(fine, record);
  EXPECT_LT(rmse, kSuccess * noise);
  EXPECT_GT(rmse, 0.9 * noise);
  const double plain = identified_rmse(GetParam().f, record);
  RecordProperty("plain_over_noise", std::to_string(plain / noise));
  EXPECT_GT(plain, 1.5 * noise);
}

INSTANTIATE_TEST_SUITE_P(Known, OversampledRecovery,
                         ::testing::Values(FineCase{"saturation", Eigen::Vector2d(-0.8, 1.1)},
                                           FineCase{"polynomial(degree=3,range=[-4:4])",
                                                    Eigen::Vector4d(0.5, 1.5, 2.0, -1.5)}),
                         [](const auto& instance) { return instance.param.f.substr(0, instance.param.f.find('(')); });

}  // namespace
}  // namespace blockid
