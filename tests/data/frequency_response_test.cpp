#include "blockid/data/frequency_response.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "message.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace std::complex_literals;

FrequencyResponse delay(double samples, Eigen::Index count) {
  FrequencyResponse g;
  g.sample_time_s = 0.1;
  g.omega_rad_s = Eigen::VectorXd::LinSpaced(count, 0.0, std::numbers::pi / g.sample_time_s);
  g.response = (-1i * g.omega_rad_s.array().cast<std::complex<double>>() * samples * g.sample_time_s).exp();
  return g;
}

TEST(FrequencyResponseTest, DelayHasUnitMagnitudeAndLinearPhase) {
  const FrequencyResponse g = delay(7.0, 200);
  check(g);
  EXPECT_LE(magnitude_db(g).cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::VectorXd expected = -7.0 * 0.1 * g.omega_rad_s * 180.0 / std::numbers::pi;
  EXPECT_LE((phase_deg(g) - expected).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(FrequencyResponseTest, DecibelsOfPowersOfTen) {
  FrequencyResponse g;
  g.omega_rad_s = Eigen::Vector3d(1, 2, 3);
  g.response = Eigen::Vector3cd(10.0, -0.1i, 0.0);
  check(g);
  EXPECT_NEAR(magnitude_db(g)[0], 20.0, 1e-13);
  EXPECT_NEAR(magnitude_db(g)[1], -20.0, 1e-13);
  EXPECT_EQ(magnitude_db(g)[2], -std::numeric_limits<double>::infinity());
  EXPECT_NEAR(phase_deg(g)[1], -90.0, 1e-13);
}

TEST(FrequencyResponseTest, UnwrappingCrossesTheNegativeRealAxis) {
  FrequencyResponse g;
  g.omega_rad_s = Eigen::Vector2d(1, 2);
  g.response = Eigen::Vector2cd(-1.0 + 0.1i, -1.0 - 0.1i);
  const double beyond = 180.0 / std::numbers::pi * std::atan(0.1);
  EXPECT_NEAR(phase_deg(g)[0], 180.0 - beyond, 1e-12);
  EXPECT_NEAR(phase_deg(g)[1], 180.0 + beyond, 1e-12);
}

TEST(FrequencyResponseTest, ErrorsSayWhichEntry) {
  const FrequencyResponse good = delay(1.0, 5);
  EXPECT_THAT(BLOCKID_MESSAGE(check(FrequencyResponse{})), HasSubstr("empty"));
  FrequencyResponse g = good;
  g.response.conservativeResize(4);
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), AllOf(HasSubstr("5 frequencies"), HasSubstr("4 responses")));
  g = good;
  g.standard_deviation = Eigen::VectorXd::Ones(3);
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), HasSubstr("3 standard deviations"));
  g.standard_deviation = Eigen::VectorXd::Ones(5);
  g.standard_deviation[1] = -1.0;
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), AllOf(HasSubstr("standard deviation at index 1"), HasSubstr("-1")));
  g = good;
  g.response[3] = {0.0, std::nan("")};
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), HasSubstr("non-finite response at index 3"));
  g = good;
  g.omega_rad_s[2] = g.omega_rad_s[1];
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), AllOf(HasSubstr("frequency at index 2"), HasSubstr("predecessor")));
  g = good;
  g.omega_rad_s[0] = -1.0;
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), AllOf(HasSubstr("frequency at index 0"), HasSubstr(">= 0")));
  g = good;
  g.sample_time_s = 0.2;
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), AllOf(HasSubstr("index 3"), HasSubstr("Nyquist")));
  g.sample_time_s = 0.0;
  EXPECT_NO_THROW(check(g));
  g.sample_time_s = -0.1;
  EXPECT_THAT(BLOCKID_MESSAGE(check(g)), HasSubstr("sample time is -0.1"));
}

}  // namespace
}  // namespace blockid
