#include <blockid/estimators/static_parameters.hpp>

#include <blockid/estimators/refit.hpp>

#include "data/message.hpp"
#include "estimators/dense_twin.hpp"
#include "estimators/systems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::model_of;

std::vector<std::string> affine_names(const std::string& text) {
  const AnyBlock chain = parse(text);
  std::vector<std::string> names;
  for (const Index k : affine_parameters(chain)) names.push_back(chain.parameter_names()[static_cast<std::size_t>(k)]);
  return names;
}

TEST(AffineParametersTest, LastStaticBlockOfARow) {
  EXPECT_THAT(affine_names("G=rational(nb=1,na=1) | f=polynomial(degree=1) | H=rational(nb=1,na=1)"),
              ElementsAre("f.c0", "f.c1"));
  EXPECT_THAT(affine_names("f=polynomial(degree=1) | G=gain | g=polynomial(degree=1)"), ElementsAre("g.c0", "g.c1"));
  EXPECT_THAT(affine_names("f=polynomial(degree=1)"), ElementsAre("f.c0", "f.c1"));
}

TEST(AffineParametersTest, NoneWhereTheLastIsNotAffine) {
  EXPECT_THAT(affine_names("f=polynomial(degree=1) | s=saturation"), IsEmpty());
  EXPECT_THAT(affine_names("G=rational(nb=1,na=1)"), IsEmpty());
  EXPECT_THAT(affine_names("G=fir(nb=1) | t=tanh_network(units=1) | H=fir(nb=1)"), IsEmpty());
}

TEST(AffineParametersTest, EachBranchOfASumAndNestedRows) {
  EXPECT_THAT(
      affine_names("[A=fir(nb=0) | f=polynomial(degree=0) + s=saturation + g=polynomial(degree=0)] | H=fir(nb=1)"),
      ElementsAre("parallel1.series1.f.c0", "parallel1.g.c0"));
}

TEST(AffineParametersTest, NestedRow) {
  EXPECT_THAT(affine_names("A=gain | (B=gain | (f=polynomial(degree=0) | C=gain) | D=gain) | E=gain"),
              ElementsAre(HasSubstr("f.c0")));
}

TEST(AffineParametersTest, NumbersThatOnlyAffineParametersFollow) {
  // theta_1 is both coefficients of f, theta_2 a coefficient of f and one of H.
  EXPECT_THAT(affine_names("tied((G=fir(nb=0) | f=polynomial(degree=3) | H=fir(nb=0)),to=[0,1,1,2,3,2])"),
              ElementsAre("tied1.f.c0", "tied1.f.c3"));
}

class FitStaticTest : public ::testing::TestWithParam<const char*> {};

// J'J of the affine columns squares a condition number below 1e3.
constexpr double kSolve = 1e-9;

TEST_P(FitStaticTest, IsTheDenseLeastSquaresSolution) {
  Model model = make_model(parse(GetParam()));
  const std::vector<Index> affine = affine_parameters(model.chain);
  ASSERT_FALSE(affine.empty());
  for (Index k = 0; k < model.parameters.size(); ++k)
    model.parameters[k] += 0.1 * std::sin(1.0 + static_cast<double>(k));
  testing::Noise numbers(3);
  Record record;
  record.u = numbers.white(300);
  record.y = numbers.white(300);
  record.weights = numbers.white(300).cwiseAbs();
  record.weights.segment(40, 5).setZero();
  record.y.segment(40, 5).setConstant(std::numeric_limits<double>::quiet_NaN());
  const DataSet data(record);
  const PredictionOptions options{InitialState::zero, 9, 1};

  const StaticFit fitted = fit_static(model, data, options);
  ASSERT_TRUE(fitted.finite);
  const testing::Dense dense = testing::dense_residuals(model.chain, data, options, model.parameters);
  const Eigen::MatrixXd columns = dense.jacobian(Eigen::all, affine);
  // Minimal norm in the scaled columns: the constants of two branches are one direction.
  const Eigen::VectorXd norms = columns.colwise().norm();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
  qr.setThreshold(1e-7);
  qr.compute(columns * norms.cwiseInverse().asDiagonal());
  const Eigen::VectorXd step = norms.cwiseInverse().asDiagonal() * qr.solve(-dense.r);
  Eigen::VectorXd expected = model.parameters;
  expected(affine) += step;
  EXPECT_LT((fitted.model.parameters - expected).norm(), kSolve * (1.0 + expected.norm()));
  const double sum = (dense.r + columns * step).squaredNorm();
  EXPECT_NEAR(fitted.rmse, std::sqrt(sum / (300.0 - 9.0 - 5.0)), kSolve);
  EXPECT_EQ(fitted.rank, qr.rank());
  if (fitted.rank == std::ssize(affine)) {
    EXPECT_LT(fitted.condition, 1e3);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Nested, FitStaticTest,
    ::testing::Values(
        "f=polynomial(degree=3)", "G=rational(nb=1,na=1) | f=spline(knots=3,range=[-2:2])",
        "G=rational(nb=1,na=1) | (f=polynomial(degree=2) | (k=gain | H=fir(nb=2)))",
        "[A=fir(nb=1) | f=polynomial(degree=2) + (g=piecewise_linear(knots=4,range=[-2:2]) | B=fir(nb=1))] | C=gain",
        "[s=saturation + f=polynomial(degree=2)]"));

TEST(FitStaticEdgeTest, DirectionsWithoutDataKeepTheirValues) {
  // The input never leaves [0, 1]: the hat of the knot -2 is never touched.
  Model model = model_of("f=piecewise_linear(knots=[-2, -1, 0, 1])", {7.0, 6.0, 0.0, 0.0});
  Record record;
  record.u = Eigen::VectorXd::LinSpaced(50, 0.0, 1.0);
  record.y = 3.0 * record.u;
  const StaticFit fitted = fit_static(model, record);
  EXPECT_EQ(fitted.rank, 2);
  EXPECT_TRUE(std::isinf(fitted.condition));
  EXPECT_EQ(fitted.model.parameters[0], 7.0);
  EXPECT_EQ(fitted.model.parameters[1], 6.0);
  EXPECT_NEAR(fitted.model.parameters[3], 3.0, kSolve);
  EXPECT_NEAR(fitted.rmse, 0.0, 1e-7);
}

TEST(FitStaticEdgeTest, NotFiniteIsAResultAndNothingAffineAnError) {
  const Model unstable = model_of("G=rational(nb=0,na=1) | f=polynomial(degree=1)", {1, -9, 0, 1});
  const Record record = testing::simulated_record(testing::linear(), 900, 0.1, 4);
  const StaticFit fitted = fit_static(unstable, record);
  EXPECT_FALSE(fitted.finite);
  EXPECT_EQ(fitted.model.parameters, unstable.parameters);
  EXPECT_TRUE(std::isinf(fitted.rmse));
  EXPECT_THAT(BLOCKID_MESSAGE(fit_static(testing::linear(), record)), HasSubstr("linear in its parameters"));
}

/// Ten intervals of 0.2 on [-1, 1] and one sample, the last, a thousandth of an interval inside the tenth: B_13 = 1e-9
/// there, so that least squares would multiply its noise by 1e9.
Record record_that_touches_a_foot() {
  testing::Noise numbers(7);
  Record record;
  record.u = 0.9 * Eigen::VectorXd::LinSpaced(500, -1.0, 1.0).array() - 0.1;
  record.u[499] = 0.8002;
  record.y = record.u.array().sin().matrix() + 0.01 * numbers.white(500);
  return record;
}

TEST(LocalBasesTest, CoefficientThatOneSampleTouchesAtItsFootKeepsItsValue) {
  const Model start = make_model(parse("f=spline(knots=11,range=[-1:1])"));
  const DataSet data(record_that_touches_a_foot());
  const StaticFit fitted = fit_static(start, data);
  ASSERT_TRUE(fitted.finite);
  EXPECT_EQ(fitted.model.parameters[12], start.parameters[12]);
  EXPECT_EQ(fitted.rank, 12);
  EXPECT_LT(fitted.rmse, 0.0105);
}

TEST(LocalBasesTest, UntouchedCoefficientsComeIntoLine) {
  // Nothing beyond 0.8 but that sample, nothing in [-0.4, 0.2]: what only these would touch is interpolated.
  DataSet data(record_that_touches_a_foot());
  Record& record = data.records.front();
  for (double& u : record.u) {
    if (u > -0.4 && u < 0.2) u = 0.3;
  }
  record.y = record.u.array().sin();
  Model model = make_model(parse("f=spline(knots=11,range=[-1:1]) | G=fir(nb=0)"));
  const Eigen::VectorXd g = model.parameters.head(13);  // y = u: the abscissae
  model.parameters.head(13) = g.array().square();
  const Model straight = with_untouched_straightened(model, data);
  const Eigen::VectorXd& c = straight.parameters;
  const auto line = [&](Index a, Index b, Index k) { return c[a] + (c[b] - c[a]) / (g[b] - g[a]) * (g[k] - g[a]); };
  EXPECT_NEAR(c[12], line(10, 11, 12), 1e-12);
  EXPECT_GT(std::abs(c[12] - model.parameters[12]), 0.01);
  // [-0.4, 0.2] are three pieces: no B-spline of four lies within them, all others are touched.
  EXPECT_EQ(c.head(12), model.parameters.head(12));
  EXPECT_EQ(c.tail(1), model.parameters.tail(1));
  EXPECT_LT((simulate(straight, record.u) - simulate(model, record.u)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(LocalBasesTest, GapsAreBridged) {
  Record record;
  record.u.resize(100);
  record.u.head(50) = Eigen::VectorXd::LinSpaced(50, -1.0, -0.65);
  record.u.tail(50) = Eigen::VectorXd::LinSpaced(50, 0.65, 1.0);
  record.y = record.u;
  Model model = make_model(parse("f=piecewise_linear(knots=11,range=[-1:1])"));
  model.parameters << 1, 2, 3, 9, 9, 9, 9, 9, 5, 7, 8;  // knots -0.4 .. 0.4 are not touched, -0.6 and 0.6 are
  const Model straight = with_untouched_straightened(model, record);
  Eigen::VectorXd expected = model.parameters;
  for (Index k = 3; k <= 7; ++k) expected[k] = 3.0 + static_cast<double>(k - 2) * (5.0 - 3.0) / 6.0;
  EXPECT_LT((straight.parameters - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(LocalBasesTest, EliminationKeepsSuchACoefficient) {
  Model start = make_model(parse("G=rational(nb=0,na=1) | f=spline(knots=11,range=[-1:1])"));
  start.parameters.head(2) << 1.0, 0.0;
  const DataSet data(record_that_touches_a_foot());
  RefitOptions options;
  options.static_parameters = StaticParameters::eliminated;
  options.frozen = {"G.b0", "G.a1"};
  const Model refitted = refit(fit_static(start, data).model, data, options).model;
  EXPECT_LT(refitted.parameters.tail(13).cwiseAbs().maxCoeff(), 2.0);
}

TEST(LocalBasesTest, SplinesAndPolylinesBehindWhichOnlyLinearBlocksStand) {
  const AnyBlock chain =
      parse("s=spline(knots=3) | G=fir(nb=1) | [f=spline(knots=[-1,0,2]) + g=polynomial(degree=2) | H=gain]");
  const std::vector<LocalBasis> bases = local_bases(chain);
  ASSERT_EQ(bases.size(), 1U);
  EXPECT_THAT(bases[0], ElementsAre(7, 8, 9, 10, 11));
}

}  // namespace
}  // namespace blockid
