#include <blockid/problems/giordano_sjoberg.hpp>

#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/problems/gaussian.hpp>

#include <complex>
#include <utility>

namespace blockid::problems {
namespace {

constexpr Eigen::Index kSamples = 3000;
constexpr double kInputDeviation = 5.0;
constexpr double kNoiseDeviation = 0.1;

/// a_1, a_2 of (1 - root q^-1)(1 - conj(root) q^-1).
Eigen::Vector2d pair(std::complex<double> root) { return {-2.0 * root.real(), std::norm(root)}; }

Model giordano_sjoberg_model() {
  const GiordanoSjobergRoots roots;
  const Eigen::Vector2d a1 = pair(roots.first_pole);
  const Eigen::Vector2d a2 = pair(roots.second_pole);
  const double g1 = (1.0 + a1.sum()) / (1.0 - roots.first_zero);
  const Polynomial f(3, SignalRange{-20.0, 20.0});
  const Eigen::VectorXd theta_f = f.from_powers(Eigen::Vector4d(0.0, 1.0, 0.1, 0.05));

  Model model = make_model(Series({{"G1", Rational(1, 2)}, {"f", f}, {"G2", Rational(0, 2)}}));
  model.parameters << g1, -roots.first_zero * g1, a1, theta_f, 1.0 + a2.sum(), a2;
  return model;
}

Record measured(const Model& truth, Gaussian& gaussian, std::string name) {
  Record record;
  record.name = std::move(name);
  record.u = kInputDeviation * gaussian.vector(kSamples);
  record.y = simulate(truth, record.u) + kNoiseDeviation * gaussian.vector(kSamples);
  return record;
}

}  // namespace

Problem giordano_sjoberg(std::uint64_t seed) {
  const Model truth = giordano_sjoberg_model();
  Gaussian gaussian(seed);
  Record train = measured(truth, gaussian, "train");
  Record test = measured(truth, gaussian, "test");
  return {.name = "giordano_sjoberg_2015",
          .description = "simulation example of Giordano and Sjoberg 2015 with roots and nonlinearity of our own",
          .train = std::move(train),
          .test = std::move(test),
          .truth = truth,
          .noise_std = kNoiseDeviation,
          .unit = ""};
}

}  // namespace blockid::problems
