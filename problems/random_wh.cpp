#include <blockid/problems/random_wh.hpp>

#include <blockid/blocks/dead_zone.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/saturation.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/tanh_network.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace blockid::problems {
namespace {

constexpr Eigen::Index kLongestWarmup = 100;
/// Ranges of static blocks: v has deviation 1.
constexpr SignalRange kRange{-5.0, 5.0};

/// Uniform numbers that are the same with every standard library.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : engine_(seed) {}

  double operator()(double lower, double upper) {
    constexpr int kDroppedBits = 11;
    return lower + (upper - lower) * 0x1.0p-53 * static_cast<double>(engine_() >> kDroppedBits);
  }
  bool chance(double probability) { return (*this)(0.0, 1.0) < probability; }
  double sign() { return chance(0.5) ? 1.0 : -1.0; }
  Eigen::Index integer(Eigen::Index first, Eigen::Index last) {
    return first + static_cast<Eigen::Index>((*this)(0.0, static_cast<double>(last - first + 1)));
  }

 private:
  std::mt19937_64 engine_;
};

/// p(x) q(x), coefficients in rising powers.
Eigen::VectorXd product(const Eigen::VectorXd& p, const Eigen::VectorXd& q) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(p.size() + q.size() - 1);
  for (Eigen::Index k = 0; k < p.size(); ++k) result.segment(k, q.size()) += p[k] * q;
  return result;
}

/// prod (1 - root q^-1) with `order` roots, real or in pairs, (order + 1,).
Eigen::VectorXd random_polynomial(Eigen::Index order, double reflected, Uniform& uniform) {
  Eigen::VectorXd result = Eigen::VectorXd::Ones(1);
  while (result.size() <= order) {
    const bool pair = order - result.size() + 1 >= 2 && uniform.chance(0.5);
    double radius = uniform(0.3, 0.9);
    if (uniform.chance(reflected)) radius = 1.0 / radius;
    if (pair) {
      const double angle = uniform(0.1, 0.9) * std::numbers::pi;
      result = product(result, Eigen::Vector3d(1.0, -2.0 * radius * std::cos(angle), radius * radius));
    } else {
      result = product(result, Eigen::Vector2d(1.0, -radius * uniform.sign()));
    }
  }
  return result;
}

/// sqrt(sum g_t^2) of the impulse response: the deviation of the output for white unit input.
double noise_gain(const AnyBlock& filter, const Eigen::VectorXd& theta) {
  constexpr Eigen::Index kLongEnough = 2000;
  Model model = make_model(filter);
  model.parameters = theta;
  Eigen::VectorXd impulse = Eigen::VectorXd::Zero(kLongEnough);
  impulse[0] = 1.0;
  return simulate(model, impulse).norm();
}

/// theta = [b, a] of a rational(nb=order,na=order) of noise gain 1.
Eigen::VectorXd random_filter(Eigen::Index order, Uniform& uniform) {
  constexpr double kReflectedZeros = 0.25;
  const Eigen::VectorXd a = random_polynomial(order, 0.0, uniform);
  const Eigen::VectorXd b = random_polynomial(order, kReflectedZeros, uniform);
  Eigen::VectorXd theta(2 * order + 1);
  theta << b, a.tail(order);
  theta.head(order + 1) /= noise_gain(Rational(order, order), theta);
  return theta;
}

struct StaticBlock {
  AnyBlock block;
  Eigen::VectorXd theta;
};

StaticBlock random_polynomial_block(Uniform& uniform) {
  const Polynomial f(3, kRange);
  Eigen::VectorXd powers(4);
  const double square = uniform.sign() * uniform(0.1, 0.3);
  const double cube = uniform.sign() * uniform(0.1, 0.2);
  powers << 0.0, 1.0, square, cube;
  return {f, f.from_powers(powers)};
}

Eigen::VectorXd random_limits(double least, double most, Uniform& uniform) {
  const double lower = -uniform(least, most);
  const double upper = uniform(least, most);
  return Eigen::Vector2d(lower, upper);
}

StaticBlock random_tanh_block(Uniform& uniform) {
  Eigen::VectorXd theta(5);
  const double slope = uniform(0.0, 0.1);
  const double steepness = uniform(1.0, 2.0);
  const double shift = uniform(-0.5, 0.5);
  theta << 0.0, slope * kRange.upper, 1.0, steepness * kRange.upper, shift;
  return {TanhNetwork(1, kRange), theta};
}

/// Two units of unlike steepness on either side of zero: a kinked, asymmetric curve that rises throughout.
StaticBlock random_two_unit_block(Uniform& uniform) {
  Eigen::VectorXd theta(8);
  theta << 0.0, 0.2 * kRange.upper, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0;
  for (Eigen::Index unit = 0; unit < 2; ++unit) {
    const double weight = uniform(0.5, 1.0);
    const double steepness = uniform(1.0, 3.0);
    const double centre = (unit == 0 ? -1.0 : 1.0) * uniform(0.3, 1.2);
    theta.segment<3>(2 + 3 * unit) << weight, steepness * kRange.upper, -steepness * centre;
  }
  return {TanhNetwork(2, kRange), theta};
}

StaticBlock random_static(StaticKind kind, Uniform& uniform) {
  switch (kind) {
    case StaticKind::polynomial:
      return random_polynomial_block(uniform);
    case StaticKind::saturation:
      return {Saturation(), random_limits(0.5, 1.2, uniform)};
    case StaticKind::dead_zone:
      return {DeadZone(), random_limits(0.3, 0.8, uniform)};
    case StaticKind::tanh:
      return random_tanh_block(uniform);
  }
  fail("random Wiener-Hammerstein system: unknown static kind ", static_cast<int>(kind));
}

Model chained(Eigen::Index order1, const Eigen::VectorXd& g1, const StaticBlock& f, Eigen::Index order2,
              const Eigen::VectorXd& g2) {
  Model model =
      make_model(Series({{"G1", Rational(order1, order1)}, {"f", f.block}, {"G2", Rational(order2, order2)}}));
  model.parameters << g1, f.theta, g2;
  return model;
}

Record noise_free(const Model& truth, Eigen::Index samples, Gaussian& gaussian, std::string name) {
  Record record;
  record.name = std::move(name);
  record.u = gaussian.vector(samples);
  record.y = simulate(truth, record.u);
  return record;
}

double deviation(const Eigen::VectorXd& y) { return std::sqrt((y.array() - y.mean()).square().mean()); }

}  // namespace

std::vector<StaticKind> static_kinds() {
  return {StaticKind::polynomial, StaticKind::saturation, StaticKind::dead_zone, StaticKind::tanh};
}

std::string to_text(StaticKind kind) {
  switch (kind) {
    case StaticKind::polynomial:
      return "polynomial";
    case StaticKind::saturation:
      return "saturation";
    case StaticKind::dead_zone:
      return "dead_zone";
    case StaticKind::tanh:
      return "tanh";
  }
  return "unknown";
}

Problem random_wiener_hammerstein(const RandomWienerHammersteinOptions& options) {
  if (options.order < 1) fail("random Wiener-Hammerstein system: expected an order of at least 1, got ", options.order);
  if (options.samples < 1 || options.test_samples < 1) {
    fail("random Wiener-Hammerstein system: records need at least one sample, got ", options.samples, " and ",
         options.test_samples);
  }
  if (std::isnan(options.snr_db)) fail("random Wiener-Hammerstein system: snr_db is not a number");
  Uniform uniform(options.seed);
  const Eigen::VectorXd g1 = random_filter(options.order, uniform);
  const StaticBlock f = random_static(options.static_kind, uniform);
  const Eigen::VectorXd g2 = random_filter(options.order, uniform);
  const Model truth = chained(options.order, g1, f, options.order, g2);

  constexpr std::uint64_t kOtherStream = 0x9e3779b97f4a7c15U;
  Gaussian gaussian(options.seed ^ kOtherStream);
  Record train = noise_free(truth, options.samples, gaussian, "train");
  Record test = noise_free(truth, options.test_samples, gaussian, "test");
  const double noise_std = deviation(train.y) * std::pow(10.0, -options.snr_db / 20.0);
  train.y += noise_std * gaussian.vector(options.samples);
  test.y += noise_std * gaussian.vector(options.test_samples);
  return {.name = compose("random_wh_", to_text(options.static_kind), "_order", options.order, "_seed", options.seed),
          .description = compose("filters of order ", options.order, " around a ", to_text(options.static_kind),
                                 ", signal to noise ratio ", options.snr_db, " dB"),
          .train = std::move(train),
          .test = std::move(test),
          .truth = truth,
          .noise_std = noise_std,
          .warmup = std::min(kLongestWarmup, std::min(options.samples, options.test_samples) - 1),
          .unit = ""};
}

Problem short_wiener_hammerstein(std::uint64_t index) {
  constexpr Eigen::Index kSamples = 400;
  constexpr std::uint64_t kSystems = 0x5157454d53U;
  constexpr std::uint64_t kSignals = 0x5349474e414cU;
  Uniform uniform(kSystems + index);
  const Eigen::Index order1 = uniform.integer(1, 5);
  const Eigen::Index order2 = uniform.integer(1, 5);
  const Eigen::VectorXd g1 = random_filter(order1, uniform);
  const StaticBlock f = random_two_unit_block(uniform);
  const Eigen::VectorXd g2 = random_filter(order2, uniform);
  Model truth = chained(order1, g1, f, order2, g2);

  Gaussian gaussian(kSignals + index);
  Record train = noise_free(truth, kSamples, gaussian, "train");
  Record test = noise_free(truth, kSamples, gaussian, "test");
  const double scale = 1.0 / deviation(train.y);
  truth.parameters.segment(truth.parameters.size() - g2.size(), order2 + 1) *= scale;
  train.y *= scale;
  test.y *= scale;
  return {.name = compose("short_wh_", index),
          .description = compose("filters of orders ", order1, " and ", order2,
                                 " around a tanh network, 400 samples from rest, noise-free"),
          .train = std::move(train),
          .test = std::move(test),
          .truth = truth,
          .unit = "",
          .published = {{.method = "random start, Adam (mean of 256 other systems of the kind)",
                         .value = 0.072,
                         .unit = "",
                         .source = "Forgione et al., sysid-transformers"}}};
}

AnyBlock true_structure(const Problem& problem) {
  if (!problem.truth) fail("problem '", problem.name, "' has no known truth");
  std::vector<LabelledBlock> blocks;
  for (const ChildParameters& part : top_level_blocks(*problem.truth)) {
    AnyBlock block = part.block;
    if (const auto* f = part.block.target<Polynomial>()) block = Polynomial(f->degree());
    if (const auto* f = part.block.target<TanhNetwork>()) block = TanhNetwork(f->units());
    blocks.push_back({part.label, block});
  }
  return Series(std::move(blocks));
}

}  // namespace blockid::problems
