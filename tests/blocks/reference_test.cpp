// Blocks against numpy and scipy; reference/make_reference.py wrote the numbers.
#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/piecewise_linear.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/testing/block_conformance.hpp>

#include <gmock/gmock.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>

#include "support/source_dir.hpp"

namespace blockid::testing {
namespace {

using Quantities = std::map<std::string, std::vector<double>>;

// Rows case,quantity,index,value below two lines of heading.
std::map<std::string, Quantities> reference(const std::string& name) {
  std::ifstream file(source_dir() / "tests/blocks/reference" / (name + ".csv"));
  EXPECT_TRUE(file) << name;
  std::map<std::string, Quantities> cases;
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line.substr(0, 7), "# numpy");
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string which, quantity, index, text;
    std::getline(fields, which, ',');
    std::getline(fields, quantity, ',');
    std::getline(fields, index, ',');
    std::getline(fields, text);
    double value = 0.0;
    EXPECT_EQ(std::from_chars(text.data(), text.data() + text.size(), value).ec, std::errc()) << line;
    std::vector<double>& values = cases[which][quantity];
    EXPECT_EQ(std::to_string(values.size()), index) << line;
    values.push_back(value);
  }
  EXPECT_FALSE(cases.empty()) << name;
  return cases;
}

Eigen::VectorXd vector(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values));
}

std::vector<std::complex<double>> roots(const std::vector<double>& real, const std::vector<double>& imag) {
  std::vector<std::complex<double>> result;
  for (std::size_t k = 0; k < real.size(); ++k) result.emplace_back(real[k], imag[k]);
  return result;
}

void expect_close(const Eigen::VectorXd& expected, const Eigen::VectorXd& got, double tolerance,
                  const std::string& what) {
  ASSERT_EQ(expected.size(), got.size()) << what;
  Index worst = 0;
  const double scale = std::max(1.0, expected.cwiseAbs().maxCoeff());
  const double error = (expected - got).cwiseAbs().maxCoeff(&worst) / scale;
  EXPECT_LE(error, tolerance) << what << "[" << worst << "]: expected " << expected[worst] << ", got " << got[worst];
}

TEST(ReferenceTest, RationalIsLfilterFromItsState) {
  for (auto& [name, q] : reference("lfilter")) {
    const Rational block(std::ssize(q["b"]) - 1, std::ssize(q["a"]) - 1);
    Eigen::VectorXd theta(block.parameter_count());
    theta << vector(q["b"]), vector(q["a"]).tail(block.na());
    const detail::ApplyRun run = detail::apply_record(block, theta, vector(q["zi"]), vector(q["u"]));
    // Rounding of 80 samples, amplified by the poles of the tenth order filter in direct form.
    expect_close(vector(q["y"]), run.y, 1e-11, name + " y");
    expect_close(vector(q["zf"]), run.x, 1e-11, name + " state");
    for (std::size_t k = 0; k < q["omega"].size(); ++k) {
      const std::complex<double> g = block.frequency_response(detail::view(theta), q["omega"][k]);
      EXPECT_NEAR(g.real(), q["real"][k], 1e-9) << name << " at " << q["omega"][k];
      EXPECT_NEAR(g.imag(), q["imag"][k], 1e-9) << name << " at " << q["omega"][k];
    }
  }
}

TEST(ReferenceTest, BiquadsAreSosfilt) {
  for (auto& [name, q] : reference("sosfilt")) {
    for (const bool stable : {false, true}) {
      const Biquads block((std::ssize(q["poles_real"]) + 1) / 2, stable);
      const Eigen::VectorXd theta = block.from_roots(q["gain"][0], roots(q["zeros_real"], q["zeros_imag"]),
                                                     roots(q["poles_real"], q["poles_imag"]));
      const detail::ApplyRun run =
          detail::apply_record(block, theta, Eigen::VectorXd::Zero(block.state_count()), vector(q["u"]));
      // Sections paired in another order round otherwise; tanh and its inverse cost digits near the unit circle.
      expect_close(vector(q["y"]), run.y, 1e-12, name + (stable ? " stable" : ""));
    }
  }
}

TEST(ReferenceTest, SplineIsBSplineWithTangentsBeyondTheEnds) {
  for (auto& [name, q] : reference("bspline")) {
    const Spline block(q["knots"]);
    const Eigen::VectorXd u = vector(q["u"]);
    const TangentMatrix one = TangentMatrix::Ones(u.size(), 1);
    const detail::TangentRun run =
        detail::push_record(block, vector(q["c"]), {}, u, one, OwnColumns::parameters, {kMaxTileRows}, 0.0);
    expect_close(vector(q["y"]), run.y, 1e-13, name + " y");
    // Slopes of the narrow intervals lose the digits of their width.
    expect_close(vector(q["slope"]), run.columns.col(0), 1e-12, name + " slope");
  }
}

TEST(ReferenceTest, PiecewiseLinearIsInterp) {
  for (auto& [name, q] : reference("interp")) {
    const PiecewiseLinear block(q["knots"]);
    expect_close(vector(q["y"]), detail::apply_record(block, vector(q["v"]), {}, vector(q["u"])).y, 1e-13, name);
  }
}

TEST(ReferenceTest, PolynomialIsChebvalOnItsRange) {
  for (auto& [name, q] : reference("chebval")) {
    const Polynomial block(std::ssize(q["c"]) - 1, {q["range"][0], q["range"][1]});
    // Beyond the range T_25 reaches 1e3, and so do the rounding errors of the mapped input.
    expect_close(vector(q["y"]), detail::apply_record(block, vector(q["c"]), {}, vector(q["u"])).y, 1e-12, name);
    if (q["powers"].empty()) continue;
    // Powers on a range that is not centred cancel: 2^degree roundings.
    expect_close(vector(q["powers"]), block.to_powers(vector(q["c"])), 1e-10, name + " powers");
    expect_close(vector(q["c"]), block.from_powers(vector(q["powers"])), 1e-10, name + " from powers");
  }
}

}  // namespace
}  // namespace blockid::testing
