#include <blockid/blocks/registry.hpp>

#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>

namespace blockid {
namespace {

/// Largest orders that a text may ask for: a typing error must not exhaust memory.
constexpr IntegerLimits kOrder{0, 1'000};
constexpr IntegerLimits kDelay{0, 100'000};

SignalRange signal_range(const BlockArguments& arguments) {
  const auto [lower, upper] = arguments.range("range");
  return {lower, upper};
}

void add_linear(Registry& registry) {
  registry.add(
      "rational",
      {{"nb", "degree of the numerator"}, {"na", "degree of the denominator"}, {"nk", "delay in samples, 0"}},
      [](const BlockArguments& a) {
        return Rational{a.integer("nb", kOrder), a.integer("na", kOrder), a.integer_or("nk", 0, kDelay)};
      },
      "linear filter B(q)/A(q)");
}

void add_static(Registry& registry) {
  registry.add(
      "polynomial", {{"degree", "highest power"}, {"range", "[lower,upper] of its input, from the data"}},
      [](const BlockArguments& a) {
        const Index degree = a.integer("degree", {0, Polynomial::kMaxDegree});
        return a.has("range") ? Polynomial(degree, signal_range(a)) : Polynomial(degree);
      },
      "static polynomial in the Chebyshev basis");
}

}  // namespace

Registry standard_registry() {
  Registry registry;
  add_linear(registry);
  add_static(registry);
  return registry;
}

}  // namespace blockid
