#include <blockid/blocks/registry.hpp>

#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/continuous_bank.hpp>
#include <blockid/blocks/continuous_rational.hpp>
#include <blockid/blocks/dead_zone.hpp>
#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/offset.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/piecewise_linear.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/saturation.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/tanh_network.hpp>
#include <blockid/blocks/tied.hpp>

#include <cmath>
#include <complex>
#include <string_view>
#include <utility>
#include <vector>

namespace blockid {
namespace {

/// Largest structures that a text may ask for: a typing error must not exhaust memory.
constexpr IntegerLimits kOrder{0, 1'000};
/// Orders of continuous-time filters: a matrix exponential of twice the order for every evaluation.
constexpr IntegerLimits kContinuousOrder{1, 60};
constexpr IntegerLimits kTaps{0, 10'000};
constexpr IntegerLimits kDelay{0, 100'000};
constexpr IntegerLimits kKnots{2, Knots::kMaxCount};
constexpr IntegerLimits kSections{1, 500};
constexpr IntegerLimits kUnits{1, 1'000};
constexpr IntegerLimits kFactor{2, Oversampled::kMaxFactor};
constexpr IntegerLimits kHalfLength{2, Oversampled::kMaxHalfLength};

SignalRange signal_range(const BlockArguments& arguments) {
  const auto [lower, upper] = arguments.range("range");
  return {lower, upper};
}

/// A block that takes knots: a list of them, or a number of them with a range or a placement.
template <class B>
AnyBlock with_knots(const BlockArguments& arguments) {
  if (arguments.is_list("knots")) return B(arguments.list("knots"));
  const Index knots = arguments.integer("knots", kKnots);
  if (arguments.has("range")) return B(knots, signal_range(arguments));
  return B(knots, *knot_placement(arguments.word_or("placement", "mixed", {"mixed", "uniform", "quantile"})));
}

/// A block that takes a number and perhaps a range.
template <class B>
AnyBlock with_range(const BlockArguments& arguments, std::string_view key, IntegerLimits limits) {
  const Index count = arguments.integer(key, limits);
  return arguments.has("range") ? B(count, signal_range(arguments)) : B(count);
}

/// Roots as the list [re,im,re,im,...]; none when the key is missing.
std::vector<std::complex<double>> roots(const BlockArguments& arguments, std::string_view key) {
  std::vector<std::complex<double>> result;
  if (!arguments.has(key)) return result;
  const std::vector<double> numbers = arguments.list(key);
  if (std::ssize(numbers) > 2 * kOrder.max) arguments.refuse(key, "expected at most 1000 roots");
  if (numbers.size() % 2 != 0) arguments.refuse(key, "expected real and imaginary parts in turn, got an odd count");
  for (std::size_t k = 0; k < numbers.size(); k += 2) result.emplace_back(numbers[k], numbers[k + 1]);
  return result;
}

template <class B>
AnyBlock without_arguments(const BlockArguments&) {
  return B();
}

const ArgumentKey kDelayKey = {"nk", "delay in samples; default 0"};
const ArgumentKey kRangeKey = {"range", "[lower,upper] of its input; default from the data"};

void add_linear(Registry& registry) {
  registry.add("gain", {}, without_arguments<Gain>, "constant gain k u");
  registry.add(
      "delay", {{"samples", "how many"}}, [](const BlockArguments& a) { return Delay(a.integer("samples", kDelay)); },
      "delay by whole samples");
  registry.add(
      "fir", {{"nb", "degree of the numerator"}, kDelayKey},
      [](const BlockArguments& a) {
        return Fir{a.integer("nb", kTaps), a.integer_or("nk", 0, kDelay)};
      },
      "finite impulse response filter B(q)");
  registry.add(
      "rational", {{"nb", "degree of the numerator"}, {"na", "degree of the denominator"}, kDelayKey},
      [](const BlockArguments& a) {
        return Rational{a.integer("nb", kOrder), a.integer("na", kOrder), a.integer_or("nk", 0, kDelay)};
      },
      "linear filter B(q)/A(q)");
  registry.add(
      "biquads", {{"sections", "of second order, in a row"}, {"stable", "true keeps all poles stable; default false"}},
      [](const BlockArguments& a) {
        return Biquads{a.integer("sections", kSections), a.flag_or("stable", false)};
      },
      "linear filter as second-order sections");
  registry.add(
      "fractional",
      {{"poles", "[re,im,...], a pair by its member with im > 0; default none"},
       {"zeros", "likewise"},
       {"n", "coefficients of the expansion"},
       {"n1", "how many of them follow the exponents; default all"},
       kDelayKey},
      [](const BlockArguments& a) {
        const Index n = a.integer("n", kTaps);
        return FractionalFilter({roots(a, "poles"), roots(a, "zeros")}, n, a.integer_or("n1", n, {0, n}),
                                a.integer_or("nk", 0, kDelay));
      },
      "expansion of a filter with fractional poles and zeros");
}

Sampling sampling(const BlockArguments& arguments) {
  const std::string hold =
      arguments.word_or("hold", "foh", {"zoh", "foh", "spline3", "spline5", "spline7", "band_limited"});
  return {arguments.number("sample_time"), *hold_from_text(hold)};
}

std::vector<double> break_points(const BlockArguments& arguments) {
  std::vector<double> points = arguments.list("break_points");
  if (points.empty() || std::ssize(points) > kContinuousOrder.max) {
    arguments.refuse("break_points", "expected 1 to 60 numbers");
  }
  return points;
}

const ArgumentKey kSampleTimeKey = {"sample_time", "in seconds"};
const ArgumentKey kHoldKey = {"hold",
                              "input between samples: zoh, foh, spline3, spline5, spline7, band_limited; default foh"};
const ArgumentKey kBreakPointsKey = {"break_points", "[p1,p2,...] rad/s"};
const ArgumentKey kPoleKey = {"pole", "rad/s"};

void add_continuous(Registry& registry) {
  registry.add(
      "continuous_rational",
      {{"nb", "degree of the numerator"},
       {"na", "degree of the denominator"},
       kSampleTimeKey,
       kHoldKey,
       {"break_points", "[p1,p2,...] rad/s, na of them; default spread below the Nyquist frequency"}},
      [](const BlockArguments& a) {
        return ContinuousRational(a.integer("nb", {0, kContinuousOrder.max}), a.integer("na", kContinuousOrder),
                                  sampling(a), a.has("break_points") ? break_points(a) : std::vector<double>{});
      },
      "continuous-time filter B(s)/A(s)");
  registry.add(
      "flbf", {kBreakPointsKey, kSampleTimeKey, kHoldKey},
      [](const BlockArguments& a) { return ContinuousBank::flbf(break_points(a), sampling(a)); },
      "weighted sum of frequency-localising filters");
  registry.add(
      "svf", {{"order", "how many filters"}, kPoleKey, kSampleTimeKey, kHoldKey},
      [](const BlockArguments& a) {
        return ContinuousBank::svf(a.integer("order", kContinuousOrder), a.number("pole"), sampling(a));
      },
      "weighted sum of state-variable filters");
  registry.add(
      "laguerre", {{"order", "how many filters"}, kPoleKey, kSampleTimeKey, kHoldKey},
      [](const BlockArguments& a) {
        return ContinuousBank::laguerre(a.integer("order", kContinuousOrder), a.number("pole"), sampling(a));
      },
      "weighted sum of Laguerre filters");
  registry.add(
      "kautz",
      {{"pairs", "of filters"}, {"frequency", "rad/s"}, {"damping", "of the pole pair"}, kSampleTimeKey, kHoldKey},
      [](const BlockArguments& a) {
        return ContinuousBank::kautz(a.integer("pairs", {1, kContinuousOrder.max / 2}), a.number("frequency"),
                                     a.number("damping"), sampling(a));
      },
      "weighted sum of two-parameter Kautz filters");
}

/// Numbers as many as ties; `fallback` for each when the key is missing.
std::vector<double> for_each_tie(const BlockArguments& arguments, std::string_view key, std::size_t count,
                                 double fallback) {
  if (!arguments.has(key)) return std::vector<double>(count, fallback);
  std::vector<double> numbers = arguments.list(key);
  if (numbers.size() != count) arguments.refuse(key, "expected as many numbers as inner parameters");
  return numbers;
}

AnyBlock tied(const BlockArguments& arguments) {
  const AnyBlock inner = arguments.block();
  const auto count = static_cast<std::size_t>(inner.parameter_count());
  std::vector<double> index(count);
  for (std::size_t k = 0; k < count; ++k) index[k] = static_cast<double>(k);
  if (arguments.has("to")) index = for_each_tie(arguments, "to", count, 0.0);
  const std::vector<double> scale = for_each_tie(arguments, "scale", count, 1.0);
  const std::vector<double> offset = for_each_tie(arguments, "offset", count, 0.0);
  std::vector<Tie> ties;
  for (std::size_t k = 0; k < count; ++k) {
    if (!(index[k] >= 0.0 && index[k] < static_cast<double>(count)) || index[k] != std::floor(index[k])) {
      arguments.refuse("to", "expected whole numbers from 0 on, fewer than there are inner parameters");
    }
    ties.push_back({static_cast<Index>(index[k]), scale[k], offset[k]});
  }
  return Tied(inner, std::move(ties));
}

void add_containers(Registry& registry) {
  registry.add("tied",
               {{"", "the block"},
                {"to", "for each of its parameters the number (from 0 on) that it follows; default its own"},
                {"scale", "factor for each; default 1"},
                {"offset", "constant added for each; default 0"}},
               tied, "block whose parameters are scale * number + offset of fewer numbers");
}

void add_static(Registry& registry) {
  const std::vector<ArgumentKey> knots = {{"knots", "how many, or a list [k1,k2,...] of them"},
                                          {"range", "[lower,upper] over which they lie uniformly"},
                                          {"placement", "mixed, uniform or quantile; default mixed, from the data"}};
  registry.add("offset", {}, without_arguments<Offset>, "constant added, u + c");
  registry.add(
      "polynomial", {{"degree", "highest power"}, kRangeKey},
      [](const BlockArguments& a) {
        return with_range<Polynomial>(a, "degree", {0, Polynomial::kMaxDegree});
      },
      "static polynomial in the Chebyshev basis");
  registry.add("piecewise_linear", knots, with_knots<PiecewiseLinear>, "static function made of straight pieces");
  registry.add("spline", knots, with_knots<Spline>, "static cubic spline");
  registry.add("saturation", {}, without_arguments<Saturation>, "clipping to a lower and an upper limit");
  registry.add("dead_zone", {}, without_arguments<DeadZone>, "a middle interval is cut out");
  registry.add(
      "tanh_network", {{"units", "hidden units"}, kRangeKey},
      [](const BlockArguments& a) { return with_range<TanhNetwork>(a, "units", kUnits); },
      "static network with one hidden layer of tanh units");
}

void add_rates(Registry& registry) {
  registry.add(
      "oversampled",
      {{"", "the block or row that runs at the higher rate"},
       {"factor", "multiple of the sampling rate"},
       {"half_length", "samples of the resampling filters on either side; default 8"}},
      [](const BlockArguments& a) {
        return Oversampled(a.block(), a.integer("factor", kFactor),
                           a.integer_or("half_length", Oversampled::kDefaultHalfLength, kHalfLength));
      },
      "a block run at a multiple of the sampling rate, between resampling filters");
}

}  // namespace

Registry standard_registry() {
  Registry registry;
  add_linear(registry);
  add_continuous(registry);
  add_static(registry);
  add_containers(registry);
  add_rates(registry);
  return registry;
}

}  // namespace blockid
