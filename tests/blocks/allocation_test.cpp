// No allocation grows with the length of the record: a program of its own, for it counts every operator new.
#include "blocks/custom_blocks.hpp"

#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/continuous_bank.hpp>
#include <blockid/blocks/continuous_rational.hpp>
#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/tanh_network.hpp>

#include <gmock/gmock.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> largest_request{0};
std::atomic<std::size_t> requested{0};

void* counted(std::size_t size) {
  requested += size;
  std::size_t before = largest_request;
  while (before < size && !largest_request.compare_exchange_weak(before, size)) {
  }
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace blockid::testing {
namespace {

std::vector<LabelledBlock> blocks() {
  const Series wiener_hammerstein(
      {{"G1", Rational(3, 3)}, {"f", Spline(12, SignalRange{-2, 2})}, {"G2", Rational(9, 10)}});
  return {{"rational", Rational(3, 4, 1)},
          {"fir", Fir(30)},
          {"delay", Delay(700)},
          {"biquads", Biquads(2)},
          {"continuous_rational", ContinuousRational(2, 3, {0.1, Hold::cubic})},
          {"svf", ContinuousBank::svf(3, 2.0, {0.1, Hold::first_order})},
          {"fractional", FractionalFilter({{0.9}, {1.5}}, 40, 30)},
          {"polynomial", Polynomial(5)},
          {"spline", Spline(20)},
          {"tanh_network", TanhNetwork(4)},
          {"static custom block", CustomTanh{}},
          {"custom block with state", CustomLag{}},
          {"oversampled", Oversampled(Spline(12, SignalRange{-2, 2}), 4)},
          {"oversampled chain", Oversampled(wiener_hammerstein, 4)},
          {"chain", wiener_hammerstein},
          {"sum", Parallel({{"a", wiener_hammerstein}, {"b", CustomLag{}}})}};
}

TEST(AllocationTest, ApplyOfALongRecordAsksForNoMoreThanOfAShortOne) {
  for (const auto& [name, block] : blocks()) {
    const auto bytes = [&block = block](std::size_t samples) {
      const Eigen::VectorXd theta = block.initial_parameters();
      const std::vector<double> u(samples, 0.25);
      std::vector<double> y(samples);
      std::vector<double> x(static_cast<std::size_t>(block.state_count()));
      largest_request = 0;
      block.apply({theta.data(), static_cast<std::size_t>(theta.size())}, x, u, y);
      return largest_request.load();
    };
    EXPECT_EQ(bytes(2000), bytes(200000)) << name;
  }
}

TEST(AllocationTest, EachTileAsksForNoMoreThanTheFirst) {
  for (const auto& [name, block] : blocks()) {
    const Eigen::VectorXd theta = block.initial_parameters();
    const Index upstream = 3;
    const OwnColumns own = OwnColumns::parameters_and_state;
    const Index stride = padded_columns(upstream + block.own_columns(own));
    std::vector<double> u(static_cast<std::size_t>(kMaxTileRows), 0.25);
    std::vector<double> y(u.size());
    std::vector<double> x(static_cast<std::size_t>(block.state_count()));
    std::vector<double> memory(static_cast<std::size_t>(block.tangent_memory(upstream, own)));
    std::vector<double> tile(u.size() * static_cast<std::size_t>(stride));
    const Tangents tangents{tile.data(), kMaxTileRows, stride, upstream};
    std::size_t first = 0;
    for (int k = 0; k < 50; ++k) {
      requested = 0;
      block.push_forward({theta.data(), static_cast<std::size_t>(theta.size())}, x, memory, u, y, tangents, own);
      if (k == 0) first = requested;
      EXPECT_LE(requested, first) << name << ", tile " << k;
    }
  }
}

}  // namespace
}  // namespace blockid::testing
