// A block of one's own against the installed package alone: its laws, its place in a chain, its parameters from data.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/record.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <span>

namespace {

// x_{t+1} = a x_t + tanh(b u_t), y_t = x_{t+1}; theta = [a, b].
struct SaturatingLag {
  blockid::Index parameter_count() const { return 2; }
  blockid::Index state_count() const { return 1; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) {
      x[0] = theta[0] * x[0] + tanh(theta[1] * u[t]);
      y[t] = x[0];
    }
  }
};

// v_t = b0 u_t - a1 v_{t-1}, then SaturatingLag.
blockid::Model chain_model(double b0, double a1, double a, double b) {
  blockid::Model model =
      blockid::make_model(blockid::Series({{"G", blockid::Rational(0, 1)}, {"lag", SaturatingLag{}}}));
  model.parameters = Eigen::Vector4d(b0, a1, a, b);
  return model;
}

Eigen::VectorXd chirp(Eigen::Index samples) {
  return Eigen::VectorXd::NullaryExpr(samples, [](Eigen::Index t) {
    const double time = static_cast<double>(t);
    return std::sin(0.002 * time * time);
  });
}

TEST(CustomBlock, KeepsTheLaws) { EXPECT_THAT(SaturatingLag{}, blockid::testing::ConformsToBlockLaws()); }

TEST(CustomBlock, SimulatesInAChainAsTheEquationsSay) {
  const blockid::Model model = chain_model(2.0, -0.5, 0.25, 0.75);
  const Eigen::VectorXd u = chirp(200);
  const Eigen::VectorXd y = blockid::simulate(model, u);
  ASSERT_EQ(y.size(), u.size());
  double v = 0.0;
  double x = 0.0;
  for (Eigen::Index t = 0; t < u.size(); ++t) {
    v = 2.0 * u[t] + 0.5 * v;
    x = 0.25 * x + std::tanh(0.75 * v);
    ASSERT_NEAR(y[t], x, 1e-12) << "t = " << t;
  }
}

TEST(CustomBlock, ParametersComeBackFromData) {
  const blockid::Model truth = chain_model(2.0, -0.5, 0.25, 0.75);
  blockid::Record record;
  record.u = chirp(500);
  record.y = blockid::simulate(truth, record.u);
  blockid::RefitOptions options;
  options.frozen = {"G.b0"};  // its gain could be traded with the lag's

  const blockid::RefitReport report = blockid::refit(chain_model(2.0, -0.3, 0.1, 0.5), record, options);

  EXPECT_EQ(report.status, blockid::FitStatus::converged) << report.message;
  EXPECT_LT((report.model.parameters - truth.parameters).norm(), 1e-6) << report.model.parameters.transpose();
}

TEST(InstalledPackage, ThrowsItsOwnError) { EXPECT_THROW(blockid::Rational(-1, 0), blockid::Error); }

}  // namespace
