#include <blockid/estimators/predictor.hpp>

#include "blocks/custom_blocks.hpp"
#include "data/message.hpp"
#include "estimators/dense_twin.hpp"
#include "estimators/lag.hpp"
#include "estimators/systems.hpp"
#include "support/signals.hpp"

#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace blockid {
namespace {

using ::testing::AllOf;
using testing::Dense;
using testing::dense_residuals;
using ::testing::HasSubstr;
using testing::Lag;
using testing::model_of;
using testing::Noise;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Analytic tangents by tiles against Jets in one pass agree to 1e-10 by the blocks' laws.
constexpr double kTangent = 1e-10;
// Values by tiles against values in one pass, likewise 1e-11.
constexpr double kValue = 1e-11;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void set(Eigen::VectorXd& theta, const std::vector<double>& values) {
  theta = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
}

struct NamedModel {
  std::string name;
  Model model;
};

// One of each kind of composition.
std::vector<NamedModel> models() {
  std::vector<NamedModel> list;
  list.push_back({"linear", testing::linear()});
  list.push_back({"wiener_hammerstein", testing::wiener_hammerstein()});
  list.push_back({"parallel", testing::parallel_branches()});
  list.push_back({"spline", model_of("G=rational(nb=1,na=2,nk=2) | f=spline(knots=4,range=[-3:3])",
                                     {1.0, 0.5, -1.1, 0.4, -2.0, -1.0, -0.7, 0.4, 1.5, 1.2})});
  list.push_back({"nested", model_of("(A=fir(nb=2) | f=polynomial(degree=2)) | (k=gain | (B=rational(nb=1,na=1) | "
                                     "g=tanh_network(units=1)))",
                                     {1.0, 0.3, 0.1, 0.2, 0.5, 0.1, 0.8, 1.0, -0.4, -0.6, 0.1, 0.3, 1.0, 0.9, -0.2})});
  list.push_back(
      {"biquads",
       model_of("B=biquads(sections=2) | f=polynomial(degree=2) | [C=biquads(sections=1) + d=delay(samples=2)]",
                {0.7, 0.3, 0.1, -0.9, 0.4, -0.2, 0.3, 0.5, 0.2, 0.1, 0.9, 0.2, 1.1, 0.1, 0.2, -0.5, 0.3})});
  Model custom = make_model(Series({{"G", Rational(1, 1)}, {"c", testing::CustomLag{}}, {"t", testing::CustomTanh{}}}));
  set(custom.parameters, {1.0, 0.2, -0.5, 0.6, 0.9, 0.4, 1.5, 0.8});
  list.push_back({"custom", custom});
  Model lagging =
      make_model(Series({{"G", Rational(1, 1)}, {"l", Lag{}}, {"f", Polynomial(2)}, {"H", Rational(0, 2)}}));
  set(lagging.parameters, {1.0, 0.2, -0.5, 1.3, 0.2, 0.7, 0.3, 0.9, -0.6, 0.2});
  list.push_back({"latency", lagging});
  list.push_back({"oversampled", model_of("G=rational(nb=1,na=1) | "
                                          "f=oversampled(polynomial(degree=2,range=[-3:3]),factor=3,half_length=2) | "
                                          "H=rational(nb=0,na=1)",
                                          {1.0, 0.2, -0.5, 0.3, 1.2, 0.4, 0.9, -0.6})});
  list.push_back({"oversampled_chain", model_of("oversampled(G=rational(nb=1,na=1) | f=tanh_network(units=1) | "
                                                "H=rational(nb=0,na=1),factor=2,half_length=3)",
                                                {1.0, 0.2, -0.7, 0.1, 0.6, 0.8, 1.1, -0.3, 0.9, -0.6})});
  return list;
}

// A record of N samples whose output has nothing to do with the model, so that residuals are large.
Record arbitrary_record(Index samples, Index period, std::uint64_t seed) {
  Noise numbers(seed);
  Record record;
  record.u = numbers.white(samples);
  if (period > 0) {
    for (Index t = period; t < samples; ++t) record.u[t] = record.u[t - period];
  }
  record.y = numbers.white(samples);
  record.period = period;
  return record;
}

// Three records: plain, with uneven weights and missing samples, and one longer than a tile.
DataSet three_records(bool periodic) {
  Record weighted = arbitrary_record(101, periodic ? 20 : 0, 22);
  weighted.weights = Eigen::VectorXd::Ones(101);
  for (Index t = 0; t < 101; ++t) weighted.weights[t] = 0.25 * static_cast<double>(1 + t % 5);
  for (const Index t : {3, 4, 50, 100}) {
    weighted.weights[t] = 0.0;
    weighted.y[t] = kNan;
  }
  return std::vector<Record>{arbitrary_record(40, periodic ? 40 : 0, 21), weighted,
                             arbitrary_record(700, periodic ? 130 : 0, 23)};
}

Eigen::VectorXd unknowns(const Model& model, const Predictor& predictor) {
  Eigen::VectorXd p = 0.3 * Noise(31).white(predictor.unknown_count());
  p.head(model.parameters.size()) = model.parameters;
  return p;
}

// Every way to ask the predictor, against the dense twin.
void expect_dense(const Model& model, const DataSet& data, const PredictionOptions& options) {
  const Predictor predictor(model.chain, data, options);
  const Eigen::VectorXd p = unknowns(model, predictor);
  const Dense dense = dense_residuals(model.chain, data, options, p);
  const Index n = predictor.sample_count();
  const Index unknown_count = predictor.unknown_count();
  ASSERT_EQ(n, dense.r.size());
  const double scale = 1.0 + dense.r.cwiseAbs().maxCoeff();
  const Eigen::VectorXd norms = dense.jacobian.colwise().norm().transpose().cwiseMax(1e-6 * scale);

  Eigen::VectorXd r(n);
  ASSERT_TRUE(predictor.residuals(p, r.data()));
  EXPECT_LT((r - dense.r).cwiseAbs().maxCoeff(), kValue * scale);
  EXPECT_NEAR(predictor.sum_of_squares(p), dense.r.squaredNorm(), kValue * (1.0 + dense.r.squaredNorm()));

  Eigen::VectorXd r2 = Eigen::VectorXd::Constant(n, kNan);
  RowMajor jacobian = RowMajor::Constant(n, unknown_count, kNan);
  ASSERT_TRUE(predictor.jacobian(p, r2.data(), jacobian.data()));
  EXPECT_LT((r2 - dense.r).cwiseAbs().maxCoeff(), kValue * scale);
  for (Index k = 0; k < unknown_count; ++k) {
    EXPECT_LT((jacobian.col(k) - dense.jacobian.col(k)).norm(), kTangent * norms[k]) << "unknown " << k;
  }

  Eigen::MatrixXd rows(n, unknown_count + 1);
  rows << dense.jacobian, dense.r;
  const Eigen::MatrixXd expected = rows.transpose() * rows;
  Eigen::VectorXd inverse(unknown_count + 1);
  inverse << norms.cwiseInverse(), 1.0 / (1.0 + dense.r.norm());
  const auto distance = [&](const Eigen::MatrixXd& gram) {
    return (inverse.asDiagonal() * (gram - expected) * inverse.asDiagonal()).cwiseAbs().maxCoeff();
  };
  NormalEquations normal(unknown_count + 1);
  ASSERT_TRUE(predictor.accumulate(p, normal));
  EXPECT_LT(distance(normal.gram()), kTangent);
  QrTriangle triangle(unknown_count + 1);
  ASSERT_TRUE(predictor.accumulate(p, triangle));
  EXPECT_LT(distance(triangle.triangle().transpose() * triangle.triangle()), kTangent);
  // A second pass adds up.
  ASSERT_TRUE(predictor.accumulate(p, normal));
  EXPECT_LT(distance(0.5 * normal.gram()), kTangent);

  const Eigen::MatrixXd scores = predictor.score_batches(p, 16);
  const Eigen::VectorXd gradient = dense.jacobian.transpose() * dense.r;
  EXPECT_LT((inverse.head(unknown_count).asDiagonal() * (scores.colwise().sum().transpose() - gradient)).norm(),
            kTangent * scale * std::sqrt(static_cast<double>(n)));
  Index row = 0;
  Index batch = 0;
  for (const Record& record : data.records) {
    for (Index first = 0; first < record.u.size(); first += 16, ++batch) {
      const Index length = std::min<Index>(16, record.u.size() - first);
      const Eigen::VectorXd sum =
          dense.jacobian.middleRows(row + first, length).transpose() * dense.r.segment(row + first, length);
      EXPECT_LT((inverse.head(unknown_count).asDiagonal() * (scores.row(batch).transpose() - sum)).norm(),
                kTangent * scale * 16.0);
    }
    row += record.u.size();
  }
  EXPECT_EQ(batch, scores.rows());

  for (std::size_t i = 0; i < data.records.size(); ++i) {
    const std::vector<double> yhat =
        testing::dense_prediction<double>(model.chain, data.records[i], i, options, {p.begin(), p.end()});
    const Eigen::VectorXd found = predictor.predict(p, static_cast<Index>(i));
    ASSERT_EQ(found.size(), std::ssize(yhat));
    EXPECT_LT((found - Eigen::Map<const Eigen::VectorXd>(yhat.data(), found.size())).cwiseAbs().maxCoeff(),
              kValue * scale);
  }
}

struct Mode {
  std::string name;
  PredictionOptions options;
};

std::vector<Mode> modes() {
  return {{"rest", {InitialState::zero, 0, 1}},           {"warmup", {InitialState::zero, 37, 1}},
          {"estimated", {InitialState::estimated, 0, 1}}, {"estimated_warmup", {InitialState::estimated, 5, 1}},
          {"periodic", {InitialState::periodic, 0, 1}},   {"two_periods", {InitialState::periodic, 2, 2}}};
}

class PredictorTwin : public ::testing::TestWithParam<std::tuple<std::size_t, std::size_t>> {};

TEST_P(PredictorTwin, AgreesInEveryAnswer) {
  const NamedModel named = models()[std::get<0>(GetParam())];
  const Mode mode = modes()[std::get<1>(GetParam())];
  SCOPED_TRACE(named.name + ", " + mode.name);
  expect_dense(named.model, three_records(mode.options.initial_state == InitialState::periodic), mode.options);
}

INSTANTIATE_TEST_SUITE_P(All, PredictorTwin,
                         ::testing::Combine(::testing::Range<std::size_t>(0, models().size()),
                                            ::testing::Range<std::size_t>(0, modes().size())),
                         [](const auto& instance) {
                           return models()[std::get<0>(instance.param)].name + "_" +
                                  modes()[std::get<1>(instance.param)].name;
                         });

class PredictorLengths : public ::testing::TestWithParam<Index> {};

TEST_P(PredictorLengths, AroundTheTileSizes) {
  for (const std::size_t which : {std::size_t{1}, std::size_t{7}, std::size_t{8}}) {
    const NamedModel named = models()[which];
    SCOPED_TRACE(named.name);
    expect_dense(named.model, arbitrary_record(GetParam(), 0, 41), {InitialState::zero, 0, 1});
    expect_dense(named.model, arbitrary_record(GetParam(), 0, 42), {InitialState::estimated, 0, 1});
    expect_dense(named.model, arbitrary_record(GetParam(), GetParam(), 43), {InitialState::periodic, 0, 1});
  }
}

INSTANTIATE_TEST_SUITE_P(All, PredictorLengths, ::testing::Values(1, 2, 31, 32, 33, 511, 512, 513, 1025));

TEST(PredictorTest, DerivativesAreThoseOfFiniteDifferences) {
  // The one check in which no tangent code takes part.
  const Model model = testing::wiener_hammerstein();
  const DataSet data = three_records(false);
  const Predictor predictor(model.chain, data, {InitialState::estimated, 3, 1});
  const Eigen::VectorXd p = unknowns(model, predictor);
  const Index n = predictor.sample_count();
  Eigen::VectorXd r(n);
  RowMajor jacobian(n, p.size());
  ASSERT_TRUE(predictor.jacobian(p, r.data(), jacobian.data()));
  // Central differences: the error of second order and rounding balance near 1e-9 of the curvature's scale.
  constexpr double kStep = 1e-5;
  constexpr double kDifference = 1e-6;
  for (Index k = 0; k < p.size(); ++k) {
    Eigen::VectorXd plus(n);
    Eigen::VectorXd minus(n);
    ASSERT_TRUE(predictor.residuals(p + kStep * Eigen::VectorXd::Unit(p.size(), k), plus.data()));
    ASSERT_TRUE(predictor.residuals(p - kStep * Eigen::VectorXd::Unit(p.size(), k), minus.data()));
    const Eigen::VectorXd slope = (plus - minus) / (2.0 * kStep);
    EXPECT_LT((slope - jacobian.col(k)).norm(), kDifference * (1.0 + slope.norm())) << "unknown " << k;
  }
}

TEST(PredictorTest, CountsUnknownsAndSamples) {
  const Model model = testing::wiener_hammerstein();
  const DataSet data = three_records(false);
  const Predictor rest(model.chain, data, {InitialState::zero, 4, 1});
  EXPECT_EQ(rest.parameter_count(), 13);
  EXPECT_EQ(rest.unknown_count(), 13);
  EXPECT_EQ(rest.sample_count(), 841);
  // Three warm-ups of 4, and the missing samples 4, 50 and 100; sample 3 lies in a warm-up.
  EXPECT_EQ(rest.counted_samples(), 841 - 12 - 3);
  const Predictor estimated(model.chain, data, {InitialState::estimated, 4, 1});
  EXPECT_EQ(estimated.unknown_count(), 13 + 3 * model.chain.state_count());
}

TEST(PredictorTest, PeriodicIsTheSteadyState) {
  // Slowest pole |0.72| : 0.72^(2 * 130) is below rounding, so one and fifty run-in periods of 130 samples agree.
  const Model model = testing::wiener_hammerstein();
  const Record record = arbitrary_record(390, 130, 51);
  const Eigen::VectorXd steady = [&] {
    Eigen::VectorXd u(51 * 130);
    for (Index t = 0; t < u.size(); ++t) u[t] = record.u[t % 130];
    return Eigen::VectorXd(simulate(model, u).tail(130));
  }();
  const DataSet data(record);
  const Predictor predictor(model.chain, data, {InitialState::periodic, 0, 2});
  const Eigen::VectorXd yhat = predictor.predict(model.parameters, 0);
  for (Index period = 0; period < 3; ++period) {
    EXPECT_LT((yhat.segment(130 * period, 130) - steady).cwiseAbs().maxCoeff(), kValue * steady.cwiseAbs().maxCoeff());
  }
}

TEST(PredictorTest, EstimatedStatesActOnTheirOwnRecordOnly) {
  const Model model = testing::wiener_hammerstein();
  const DataSet data = three_records(false);
  const Predictor predictor(model.chain, data, {InitialState::estimated, 0, 1});
  Eigen::VectorXd p = unknowns(model, predictor);
  const Eigen::VectorXd before[] = {predictor.predict(p, 0), predictor.predict(p, 1), predictor.predict(p, 2)};
  p[13 + model.chain.state_count()] += 1.0;
  EXPECT_EQ(predictor.predict(p, 0), before[0]);
  EXPECT_GT((predictor.predict(p, 1) - before[1]).norm(), 1e-3);
  EXPECT_EQ(predictor.predict(p, 2), before[2]);
}

TEST(PredictorTest, LatencyIsTakenBack) {
  // The lag is last or only linear blocks at rest follow: its first zeros stir nothing.
  const Record record = arbitrary_record(600, 0, 61);
  const DataSet data(record);
  const std::vector<LabelledBlock> plain = {{"G", Rational(1, 1)}, {"f", Polynomial(2)}, {"k", Gain()}};
  const std::vector<LabelledBlock> at_end = {{"G", Rational(1, 1)}, {"f", Polynomial(2)}, {"l", Lag{}}};
  const std::vector<LabelledBlock> at_start = {{"l", Lag{}}, {"G", Rational(1, 1)}, {"f", Polynomial(2)}};
  Eigen::VectorXd theta(7);
  theta << 1.0, 0.2, -0.5, 0.2, 0.7, 0.3, 1.0;
  Eigen::VectorXd theta_start(7);
  theta_start << 1.0, 1.0, 0.2, -0.5, 0.2, 0.7, 0.3;
  const Predictor expected(Series(plain), data, {InitialState::zero, 2, 1});
  const Predictor behind(Series(at_end), data, {InitialState::zero, 2, 1});
  const Predictor ahead(Series(at_start), data, {InitialState::zero, 2, 1});
  Eigen::VectorXd r(600);
  Eigen::VectorXd r_behind(600);
  Eigen::VectorXd r_ahead(600);
  ASSERT_TRUE(expected.residuals(theta, r.data()));
  ASSERT_TRUE(behind.residuals(theta, r_behind.data()));
  ASSERT_TRUE(ahead.residuals(theta_start, r_ahead.data()));
  EXPECT_LT((r - r_behind).cwiseAbs().maxCoeff(), kValue);
  EXPECT_LT((r - r_ahead).cwiseAbs().maxCoeff(), kValue);

  NormalEquations sums(8);
  NormalEquations sums_behind(8);
  ASSERT_TRUE(expected.accumulate(theta, sums));
  ASSERT_TRUE(behind.accumulate(theta, sums_behind));
  EXPECT_LT((sums.gram() - sums_behind.gram()).norm(), kTangent * sums.gram().norm());
}

TEST(PredictorTest, PredictionsThatAreNotFiniteAreReported) {
  // 3^t overflows before t = 700.
  const Model model = model_of("G=rational(nb=0,na=1)", {1.0, -3.0});
  const DataSet data = std::vector<Record>{arbitrary_record(20, 0, 71), arbitrary_record(800, 0, 72)};
  const Predictor predictor(model.chain, data);
  Eigen::VectorXd r(820);
  RowMajor jacobian(820, 2);
  EXPECT_FALSE(predictor.residuals(model.parameters, r.data()));
  EXPECT_FALSE(predictor.jacobian(model.parameters, r.data(), jacobian.data()));
  EXPECT_EQ(predictor.sum_of_squares(model.parameters), std::numeric_limits<double>::infinity());
  NormalEquations normal(3);
  QrTriangle triangle(3);
  const Eigen::MatrixXd one_row = Eigen::MatrixXd::Constant(3, 3, 1.0);
  normal.add(one_row, 1);
  EXPECT_FALSE(predictor.accumulate(model.parameters, normal));
  EXPECT_FALSE(predictor.accumulate(model.parameters, triangle));
  EXPECT_EQ(normal.gram(), one_row) << "the sums must be as they were";
  EXPECT_EQ(normal.rows(), 1);
  EXPECT_TRUE(triangle.triangle().isZero(0.0));
}

TEST(PredictorTest, MistakesAreNamed) {
  const AnyBlock chain = testing::linear().chain;
  DataSet data = arbitrary_record(30, 0, 81);
  data.records.front().name = "bench";
  EXPECT_THAT(BLOCKID_MESSAGE(Predictor(chain, data, {InitialState::zero, 30, 1})),
              AllOf(HasSubstr("bench"), HasSubstr("30 samples"), HasSubstr("warm-up of 30")));
  EXPECT_THAT(BLOCKID_MESSAGE(Predictor(chain, data, {InitialState::zero, -1, 1})), HasSubstr("got -1"));
  EXPECT_THAT(BLOCKID_MESSAGE(Predictor(chain, data, {InitialState::periodic, 0, 1})),
              AllOf(HasSubstr("bench"), HasSubstr("period")));
  data.records.front().period = 10;
  EXPECT_THAT(BLOCKID_MESSAGE(Predictor(chain, data, {InitialState::periodic, 0, 0})), HasSubstr("run-in"));
  const Predictor predictor(chain, data);
  EXPECT_THAT(BLOCKID_MESSAGE(predictor.sum_of_squares(Eigen::VectorXd::Zero(4))),
              AllOf(HasSubstr("expected 5"), HasSubstr("got 4")));
  data.records.front().y[7] = kNan;
  EXPECT_THAT(BLOCKID_MESSAGE(Predictor(chain, data)), HasSubstr("7"));
}

}  // namespace
}  // namespace blockid
