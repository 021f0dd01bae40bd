// The case of the derivative benchmark: rational 3/3 | degree-5 polynomial | rational 3/3 on white noise.
#pragma once

#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/data_set.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace blockid::bench {

/// Standard normal numbers by Box and Muller, the same with every standard library.
inline Eigen::VectorXd gaussian(Index count, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&] { return (static_cast<double>(engine() >> 11) + 0.5) * 0x1.0p-53; };
  Eigen::VectorXd values(count);
  for (Index k = 0; k < count; ++k) {
    values[k] = std::sqrt(-2.0 * std::log(uniform())) * std::cos(6.283185307179586 * uniform());
  }
  return values;
}

struct WienerHammersteinCase {
  Rational first{3, 3};
  Polynomial f{5, {-4.0, 4.0}};
  Rational second{3, 3};
  AnyBlock chain = Series({{"G1", first}, {"f", f}, {"G2", second}});
  Eigen::VectorXd theta = parameters();
  DataSet data;

  explicit WienerHammersteinCase(Index samples) {
    Record record;
    record.u = gaussian(samples, 1);
    record.y = Eigen::VectorXd::Zero(samples);
    std::vector<double> x(static_cast<std::size_t>(chain.state_count()), 0.0);
    chain.apply({theta.data(), static_cast<std::size_t>(theta.size())}, x,
                {record.u.data(), static_cast<std::size_t>(samples)},
                {record.y.data(), static_cast<std::size_t>(samples)});
    record.y += 0.01 * gaussian(samples, 2);
    data = DataSet(std::move(record));
    theta *= 1.001;
  }

  static Eigen::VectorXd parameters() {
    Eigen::VectorXd p(20);
    p << 0.3, 0.2, 0.1, 0.05, -1.2, 0.65, -0.12,  //
        0.1, 1.5, 0.3, -0.4, 0.05, 0.1,           //
        0.4, 0.3, -0.1, 0.05, -0.9, 0.5, -0.1;
    return p;
  }

  /// y = chain(theta) u for any scalar, in tiles of `tile` samples: what a user without push_forward would write.
  template <class T>
  void apply(std::span<const T> p, std::span<const double> u, std::span<T> y, std::size_t tile) const {
    std::vector<T> first_state(3, T(0.0));
    std::vector<T> second_state(3, T(0.0));
    std::vector<T> input(tile);
    std::vector<T> v(tile);
    std::vector<T> w(tile);
    for (std::size_t start = 0; start < u.size(); start += tile) {
      const std::size_t rows = std::min(tile, u.size() - start);
      for (std::size_t t = 0; t < rows; ++t) input[t] = T(u[start + t]);
      first.apply(p.subspan(0, 7), std::span<T>(first_state), std::span<const T>(input).first(rows),
                  std::span<T>(v).first(rows));
      f.apply(p.subspan(7, 6), std::span<T>(), std::span<const T>(v).first(rows), std::span<T>(w).first(rows));
      second.apply(p.subspan(13, 7), std::span<T>(second_state), std::span<const T>(w).first(rows),
                   y.subspan(start, rows));
    }
  }
};

}  // namespace blockid::bench
