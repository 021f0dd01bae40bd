#include <blockid/estimators/stability.hpp>

#include "estimators/systems.hpp"

#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/estimators/fit.hpp>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <string>

namespace blockid {
namespace {

using detail::view;
using testing::model_of;

TEST(Stability, LooksAtEveryRationalFilter) {
  EXPECT_TRUE(is_stable(testing::wiener()));
  EXPECT_TRUE(is_stable(model_of("G=rational(nb=0,na=1) | H=rational(nb=0,na=2)", {1, -0.9, 1, -1.2, 0.72})));
  EXPECT_FALSE(is_stable(model_of("G=rational(nb=0,na=1) | H=rational(nb=0,na=2)", {1, -0.9, 1, -1.2, 1.02})));
  EXPECT_FALSE(
      is_stable(model_of("[k=gain + (s=saturation | G=rational(nb=0,na=1))] | H=fir(nb=0)", {1, -1, 1, 1, 1.0, 1})));
}

TEST(Stability, ReflectionKeepsTheMagnitude) {
  // Poles 1.25, and 1.1 exp(+-i); the pair of H, of radius sqrt(0.72), stays.
  const double pair = -2.0 * 1.1 * std::cos(1.0);
  const Model model = model_of("G=rational(nb=1,na=3) | H=rational(nb=0,na=2)",
                               {2, 0.7, pair - 1.25, 1.21 - 1.25 * pair, -1.25 * 1.21, 1, -1.2, 0.72});
  const Model reflected = with_reflected_poles(model);
  EXPECT_FALSE(is_stable(model));
  EXPECT_TRUE(is_stable(reflected));
  EXPECT_EQ(reflected.parameters.tail(3), model.parameters.tail(3));
  const Rational g(1, 3);
  for (int step = 0; step < 32; ++step) {
    const double omega = 0.1 * step;
    const double before = std::abs(g.frequency_response(view(model.parameters).first(5), omega));
    const double after = std::abs(g.frequency_response(view(reflected.parameters).first(5), omega));
    EXPECT_NEAR(after, before, 1e-12 * before) << omega;  // rounding of three roots and back
  }
}

TEST(Stability, PoleOnTheCircleComesInside) {
  const Model reflected = with_reflected_poles(model_of("G=rational(nb=0,na=1)", {1, -1.0}));
  EXPECT_NEAR(reflected.parameters[1], -0.999, 1e-12);
  EXPECT_TRUE(is_stable(reflected));
}

// Two periods of 512 samples: 1.0005^1024 = 1.7, and the zero beside the pole hides it to the noise.
TEST(Stability, FitTakesAStableModelThatIsAsGood) {
  const double hidden = 1.0005;
  const Model truth = model_of("G=rational(nb=0,na=1) | f=polynomial(degree=3)", {1, -0.5, 0, 1, 0.3, -0.1});
  testing::Noise numbers(11);
  const Eigen::VectorXd period = numbers.white(512);
  Record record;
  record.u = period.replicate(2, 1);
  record.period = 512;
  const Eigen::VectorXd steady = simulate(truth, period.replicate(3, 1)).tail(1024);
  record.y = steady + 0.01 * numbers.white(1024);
  const Model start = model_of("G=rational(nb=1,na=2) | f=polynomial(degree=3)",
                               {1, -hidden, -0.5 - hidden, 0.5 * hidden, 0, 1, 0.3, -0.1});
  FitOptions options;
  options.refit.prediction.initial_state = InitialState::periodic;
  const RefitReport alone = refit(start, record, options.refit);
  ASSERT_FALSE(is_stable(alone.model)) << "nothing to do for the fit";
  const FitResult result = fit(start.chain, record, start_from(start), options);
  EXPECT_TRUE(is_stable(result.model));
  EXPECT_LE(result.report.rmse, 1.02 * alone.rmse);
  // A hundred times the record, where 1.0005^102400 is 1e22.
  const Eigen::VectorXd longer = simulate(result.model, period.replicate(200, 1)).tail(1024);
  EXPECT_LT((longer - steady).cwiseAbs().maxCoeff(), 0.05);
}

}  // namespace
}  // namespace blockid
