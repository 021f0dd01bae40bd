#include <blockid/estimators/polynomial_model.hpp>

#include "data/message.hpp"
#include "estimators/polynomial_systems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Rounding of a few hundred operations on numbers of size one.
constexpr double kRounding = 1e-12;

TEST(PolynomialModelTest, TakesThetaApart) {
  const PolynomialModel model = testing::box_jenkins_system();
  EXPECT_THAT(parameter_names(model.orders), ElementsAre("b0", "b1", "b2", "b3", "c1", "d1", "d2", "f1", "f2"));
  EXPECT_EQ(parameter_count(model.orders), 9);
  const Polynomials p = polynomials(model);
  EXPECT_EQ(p.a, Eigen::VectorXd::Ones(1));
  EXPECT_EQ(p.b, (Eigen::VectorXd(5) << 0.0, 1.0, 0.5, -0.2, 0.1).finished());
  EXPECT_EQ(p.c, (Eigen::VectorXd(2) << 1.0, 0.6).finished());
  EXPECT_EQ(p.d, (Eigen::VectorXd(3) << 1.0, -1.2, 0.5).finished());
  EXPECT_EQ(p.f, (Eigen::VectorXd(3) << 1.0, -1.4, 0.7).finished());
  EXPECT_EQ(polynomials(testing::arx_system()).a, (Eigen::VectorXd(3) << 1.0, -1.3, 0.6).finished());
}

TEST(PolynomialModelTest, SaysWhetherRootsLieInsideTheCircle) {
  const auto inside = [](std::initializer_list<double> p) {
    return has_roots_inside_circle(Eigen::Map<const Eigen::VectorXd>(p.begin(), static_cast<Index>(p.size())));
  };
  EXPECT_TRUE(inside({3.0}));
  EXPECT_TRUE(inside({1.0, 0.999}));
  EXPECT_FALSE(inside({1.0, -1.001}));
  EXPECT_FALSE(inside({1.0, -1.0}));
  EXPECT_TRUE(inside({2.0, -2.6, 1.2}));
  EXPECT_FALSE(inside({1.0, -2.1, 1.1}));
  // (1 - 0.9 x)^3 (1 + 0.5 x) and the same with 1.02 for 0.5.
  EXPECT_TRUE(inside({1.0, -2.2, 1.08, 0.486, -0.3645}));
  EXPECT_FALSE(inside({1.0, -1.68, -0.324, 1.7496, -0.74358}));
}

TEST(PolynomialModelTest, RandomRootsAreToldApart) {
  testing::Noise numbers(3);
  for (int draw = 0; draw < 200; ++draw) {
    Eigen::VectorXd p = Eigen::VectorXd::Ones(1);
    double largest = 0.0;
    for (int pair = 0; pair < 3; ++pair) {
      const double radius = 1.3 * numbers.uniform();
      const double angle = 3.0 * numbers.uniform();
      largest = std::max(largest, radius);
      const Eigen::Vector3d factor(1.0, -2.0 * radius * std::cos(angle), radius * radius);
      Eigen::VectorXd next = Eigen::VectorXd::Zero(p.size() + 2);
      for (Index k = 0; k < p.size(); ++k) next.segment(k, 3) += p[k] * factor;
      p = next;
    }
    EXPECT_EQ(has_roots_inside_circle(p), largest < 1.0) << "largest radius " << largest;
  }
}

TEST(PolynomialModelTest, FlagsWhatIsUnstable) {
  PolynomialModel model = testing::box_jenkins_system();
  EXPECT_TRUE(is_stable(model));
  EXPECT_TRUE(has_stationary_noise(model));
  EXPECT_TRUE(has_stable_predictor(model));
  const auto with = [&](Index place, double value) {
    PolynomialModel changed = model;
    changed.theta[place] = value;
    return changed;
  };
  const PolynomialModel c = with(4, 1.5);
  EXPECT_TRUE(is_stable(c) && has_stationary_noise(c));
  EXPECT_FALSE(has_stable_predictor(c));
  const PolynomialModel d = with(6, 1.1);
  EXPECT_TRUE(is_stable(d) && has_stable_predictor(d));
  EXPECT_FALSE(has_stationary_noise(d));
  const PolynomialModel f = with(8, 1.1);
  EXPECT_FALSE(is_stable(f));
  EXPECT_FALSE(has_stable_predictor(f));
  EXPECT_TRUE(has_stationary_noise(f));
  PolynomialModel a = testing::arx_system();
  a.theta[1] = 1.2;
  EXPECT_FALSE(is_stable(a));
  EXPECT_FALSE(has_stationary_noise(a));
  EXPECT_TRUE(has_stable_predictor(a));
}

// sum_k h_k e^{-jwk} of an impulse response that has died away.
std::complex<double> transform(const Eigen::VectorXd& h, double omega) {
  std::complex<double> sum = 0.0;
  for (Index k = 0; k < h.size(); ++k) sum += h[k] * std::polar(1.0, -omega * static_cast<double>(k));
  return sum;
}

TEST(PolynomialModelTest, ResponsesAreThoseOfTheSimulation) {
  constexpr Index kLength = 400;
  const Eigen::VectorXd pulse = Eigen::VectorXd::Unit(kLength, 0);
  const Eigen::VectorXd nothing = Eigen::VectorXd::Zero(kLength);
  for (const PolynomialModel& model : {testing::arx_system(), testing::armax_system(), testing::box_jenkins_system()}) {
    const Eigen::VectorXd g = testing::simulated(model, pulse, nothing).record.y;
    const Eigen::VectorXd h = testing::simulated(model, nothing, pulse).record.y;
    EXPECT_LT((simulate(model, pulse) - g).norm(), kRounding);
    EXPECT_LT((noise_impulse_response(model, kLength) - h).norm(), kRounding);
    for (const double omega : {0.0, 0.3, 1.7, 3.1}) {
      // Poles of radius 0.84 leave 0.84^400 = 5e-31.
      EXPECT_LT(std::abs(response(model, omega) - transform(g, omega)), kRounding * std::abs(response(model, omega)));
      EXPECT_LT(std::abs(noise_response(model, omega) - transform(h, omega)),
                kRounding * std::abs(noise_response(model, omega)));
    }
  }
}

TEST(PolynomialModelTest, DeterministicPartKeepsMeans) {
  PolynomialModel model = testing::box_jenkins_system();
  model.u_mean = 3.0;
  model.y_mean = -2.0;
  const Eigen::VectorXd u = testing::Noise(4).white(100).array() + 3.0;
  const Model chain = deterministic_part(model);
  EXPECT_THAT(chain.chain.parameter_names(), ::testing::Contains("G.b3"));
  EXPECT_LT((simulate(chain, u) - testing::simulated(model, u, Eigen::VectorXd::Zero(100)).record.y).norm(), kRounding);
}

TEST(PolynomialModelTest, ErrorsSayWhatIsExpected) {
  EXPECT_THAT(testing::message_of([] { check(PolynomialOrders{.na = 1, .nd = -1}); }),
              AllOf(HasSubstr(">= 0"), HasSubstr("na=1"), HasSubstr("nd=-1")));
  PolynomialModel model = testing::arx_system();
  model.theta.conservativeResize(3);
  EXPECT_THAT(testing::message_of([&] { check(model); }), HasSubstr("expected 4 parameters, got 3"));
  model = testing::arx_system();
  model.theta[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(testing::message_of([&] { check(model); }), AllOf(HasSubstr("b0"), HasSubstr("not finite")));
  model = testing::arx_system();
  model.y_mean = std::numeric_limits<double>::infinity();
  EXPECT_THAT(testing::message_of([&] { check(model); }), HasSubstr("finite means"));
  model = testing::arx_system();
  model.sample_time_s = 0.0;
  EXPECT_THAT(testing::message_of([&] { check(model); }), HasSubstr("sample time > 0"));
  EXPECT_THAT(testing::message_of([] { noise_impulse_response(testing::arx_system(), 0); }),
              HasSubstr("at least one sample"));
}

}  // namespace
}  // namespace blockid
