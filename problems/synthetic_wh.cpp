#include <blockid/problems/synthetic_wh.hpp>

#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>
#include <blockid/problems/gaussian.hpp>

#include <cmath>
#include <complex>
#include <utility>

namespace blockid::problems {
namespace {

constexpr double kSampleTime = 1e-3;
constexpr Eigen::Index kWarmup = 100;

/// (1 - real q^-1) (1 - 2 Re(pair) q^-1 + |pair|^2 q^-2): (4,).
Eigen::Vector4d third_order(double real, std::complex<double> pair) {
  const double p1 = -2.0 * pair.real();
  const double p2 = std::norm(pair);
  return {1.0, p1 - real, p2 - real * p1, -real * p2};
}

/// theta = [b, a] of a rational(nb=3,na=3) with b(1)/a(1) = 1, (7,).
Eigen::VectorXd filter(const Eigen::Vector4d& b, const Eigen::Vector4d& a) {
  Eigen::VectorXd theta(7);
  theta << b * (a.sum() / b.sum()), a.tail<3>();
  return theta;
}

/// sqrt(sum g_t^2) of the impulse response: the deviation of the output for white unit input.
double noise_gain(const Eigen::VectorXd& theta) {
  constexpr Eigen::Index kLongEnough = 1000;
  Model model = make_model(Rational(3, 3));
  model.parameters = theta;
  Eigen::VectorXd impulse = Eigen::VectorXd::Zero(kLongEnough);
  impulse[0] = 1.0;
  return simulate(model, impulse).norm();
}

Model synthetic_wh_model() {
  constexpr double kDeviation = 1.5;  // of v
  constexpr double kReach = 4.0;      // of v in deviations
  Eigen::VectorXd g1 = filter(third_order(-0.3, {0.2, 0.6}), third_order(0.7, {0.5, 0.6}));
  g1.head(4) *= kDeviation / noise_gain(g1);
  const Eigen::VectorXd g2 = filter(third_order(0.3, {-0.3, 0.5}), third_order(0.8, {0.6, 0.3}));
  const Polynomial f(5, SignalRange{-kReach * kDeviation, kReach * kDeviation});
  Eigen::VectorXd powers(6);
  powers << 0.0, 1.0, 0.05, -0.07, -0.003, 0.0023;

  Model model = make_model(Series({{"G1", Rational(3, 3)}, {"f", f}, {"G2", Rational(3, 3)}}), kSampleTime);
  model.parameters << g1, f.from_powers(powers), g2;
  model.input_unit = "V";
  model.output_unit = "V";
  return model;
}

Record measured(const Model& truth, Eigen::Index samples, Gaussian& gaussian, std::string name) {
  Record record;
  record.name = std::move(name);
  record.u = gaussian.vector(samples);
  record.y = simulate(truth, record.u);
  record.sample_time_s = truth.sample_time_s;
  record.input_unit = truth.input_unit;
  record.output_unit = truth.output_unit;
  return record;
}

}  // namespace

Problem synthetic_wiener_hammerstein(const SyntheticWienerHammersteinOptions& options) {
  if (options.train_samples < 1 || options.test_samples < 1) {
    fail("synthetic problem: records need at least one sample, got ", options.train_samples, " and ",
         options.test_samples);
  }
  const Model truth = synthetic_wh_model();
  Gaussian gaussian(options.seed);
  Record train = measured(truth, options.train_samples, gaussian, "train");
  Record test = measured(truth, options.test_samples, gaussian, "test");
  const double deviation = std::sqrt((train.y.array() - train.y.mean()).square().mean());
  const double noise_std = deviation * std::pow(10.0, -options.signal_to_noise_db / 20.0);
  train.y += noise_std * gaussian.vector(options.train_samples);
  test.y += noise_std * gaussian.vector(options.test_samples);
  return {.name = "synthetic_wiener_hammerstein",
          .description =
              "third-order filter, saturating polynomial of degree 5, third-order filter; white Gaussian "
              "input, white Gaussian noise in the measured output",
          .train = std::move(train),
          .test = std::move(test),
          .truth = truth,
          .noise_std = noise_std,
          .warmup = kWarmup,
          .unit = "V"};
}

}  // namespace blockid::problems
