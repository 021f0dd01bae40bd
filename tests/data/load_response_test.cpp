// Frequency responses from tables.
#include "blockid/data/load_response.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <fstream>
#include <numbers>

#include "blockid/data/mat.hpp"
#include "mat_writer.hpp"
#include "message.hpp"
#include "support/temp_dir.hpp"

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Complex = std::complex<double>;

constexpr double kTurn = 2.0 * std::numbers::pi;
/// A few roundings of numbers near one.
constexpr double kRounding = 1e-14;

class LoadResponseTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(csv_) << "f,re,im,mag,db,deg,rad,sd,odd\n"
                           "1,3,4,5,13.979400086720377,53.13010235415598,0.9272952180016122,0.1,1\n"
                           "10,0,-2,2,6.020599913279624,-90,-1.5707963267948966,0.2,-1\n";
    testing::MatWriter writer(mat_, MAT_FT_MAT5);
    writer.add("w", Eigen::Vector2d(1, 10));
    writer.add_complex("G", Eigen::Vector2cd(Complex(3, 4), Complex(0, -2)));
    writer.add_complex("three", Eigen::Vector3cd(Complex(3, 4), Complex(0, -2), Complex(1, 1)));
    writer.add("real", Eigen::Vector2d(3, -2));
    writer.add_text("text", "no numbers");
  }

  ResponseSpec spec() const {
    ResponseSpec result;
    result.path = csv_;
    result.frequency = "f";
    return result;
  }

  static void expect_values(const FrequencyResponse& g, double unit) {
    ASSERT_EQ(g.response.size(), 2);
    EXPECT_DOUBLE_EQ(g.omega_rad_s[0], unit);
    EXPECT_DOUBLE_EQ(g.omega_rad_s[1], 10.0 * unit);
    EXPECT_LT(std::abs(g.response[0] - Complex(3, 4)), 5 * kRounding);
    EXPECT_LT(std::abs(g.response[1] - Complex(0, -2)), 5 * kRounding);
    EXPECT_EQ(g.sample_time_s, 0.0);
  }

  testing::TempDir dir_;
  std::filesystem::path csv_ = dir_ / "response.csv";
  std::filesystem::path mat_ = dir_ / "response.mat";
};

TEST_F(LoadResponseTest, EveryFormIsTheSameResponse) {
  ResponseSpec cartesian = spec();
  cartesian.real = "re";
  cartesian.imaginary = "im";
  cartesian.deviation = "sd";
  expect_values(load_frequency_response(cartesian), kTurn);
  EXPECT_EQ(load_frequency_response(cartesian).standard_deviation, Eigen::Vector2d(0.1, 0.2));
  ResponseSpec polar = spec();
  polar.magnitude = "mag";
  polar.phase = "deg";
  expect_values(load_frequency_response(polar), kTurn);
  polar.magnitude = "db";
  polar.magnitude_unit = MagnitudeUnit::decibels;
  polar.phase = "rad";
  polar.phase_unit = AngleUnit::radians;
  polar.frequency_unit = FrequencyUnit::radians_per_second;
  expect_values(load_frequency_response(polar), 1.0);
  ResponseSpec complex = spec();
  complex.path = mat_;
  complex.frequency = "w";
  complex.frequency_unit = FrequencyUnit::radians_per_second;
  complex.response = "G";
  expect_values(load_frequency_response(complex), 1.0);
}

TEST_F(LoadResponseTest, RealVariablesHaveNoImaginaryPart) {
  EXPECT_EQ(MatFile(mat_).complex_vector("real"), Eigen::Vector2cd(Complex(3, 0), Complex(-2, 0)));
}

TEST_F(LoadResponseTest, RefusesNoneSeveralAndHalfForms) {
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(spec())),
              AllOf(HasSubstr("response.csv"), HasSubstr("in 0 forms")));
  ResponseSpec twice = spec();
  twice.real = "re";
  twice.imaginary = "im";
  twice.magnitude = "mag";
  twice.phase = "deg";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(twice)), HasSubstr("in 2 forms"));
  ResponseSpec half = spec();
  half.real = "re";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(half)), HasSubstr("real and imaginary part"));
  half = spec();
  half.phase = "deg";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(half)), HasSubstr("magnitude and phase"));
}

TEST_F(LoadResponseTest, RefusesWhatIsNoResponse) {
  ResponseSpec bad = spec();
  bad.response = "re";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(bad)), HasSubstr("a complex variable needs a MAT file"));
  bad = spec();
  bad.magnitude = "odd";
  bad.phase = "deg";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(bad)), AllOf(HasSubstr("index 1"), HasSubstr("ratio >= 0")));
  bad = spec();
  bad.frequency = "im";
  bad.real = "re";
  bad.imaginary = "im";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(bad)),
              AllOf(HasSubstr("response.csv"), HasSubstr("frequency at index 1")));
  bad.path = mat_;
  bad.frequency = "w";
  bad.real.reset();
  bad.imaginary.reset();
  bad.response = "three";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(bad)), HasSubstr("'three' has 3 entries, 'w' 2"));
  bad.response = "text";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(bad)), HasSubstr("expected complex or real numbers"));
  bad.path = dir_ / "nowhere.csv";
  EXPECT_THAT(BLOCKID_MESSAGE(load_frequency_response(bad)), HasSubstr("nowhere.csv"));
}

}  // namespace
}  // namespace blockid
