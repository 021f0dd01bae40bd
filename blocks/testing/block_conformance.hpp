// The laws of the Block contract as a test that anyone can run on a block of their own, with or without GoogleTest:
//
//   const auto report = blockid::testing::check_block(MyBlock{});
//   if (!report.ok()) std::cerr << report.text();
//
// blockid/blocks/README.md states the laws. <blockid/testing/block_conformance_gtest.hpp> makes it one line of a test.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/detail/view.hpp>
#include <blockid/testing/conformance_report.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace blockid::testing {

/// Row-major, rows = samples, as tangent tiles are.
using TangentMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Uniform numbers that are the same with every standard library, unlike std::uniform_real_distribution.
class UniformNumbers {
 public:
  explicit UniformNumbers(std::uint64_t seed) : engine_(seed) {}

  /// In [-1, 1).
  double next() { return 0x1.0p-52 * static_cast<double>(engine_() >> 11) - 1.0; }

  Eigen::VectorXd vector(Index n) {
    return Eigen::VectorXd::NullaryExpr(n, [this](Index) { return next(); });
  }

 private:
  std::mt19937_64 engine_;
};

/// initial_parameters() plus random numbers whose absolute values add up to 0.9, kept within bounds(). The sum below 1
/// keeps every denominator 1 + a_1 q^-1 + ... stable that starts at 1.
inline Eigen::VectorXd perturbed_initial_parameters(const AnyBlock& block, std::uint64_t seed) {
  Eigen::VectorXd theta = block.initial_parameters();
  if (theta.size() == 0) return theta;
  const Eigen::VectorXd step = UniformNumbers(seed).vector(theta.size());
  theta += 0.9 / step.lpNorm<1>() * step;
  const ParameterBounds bounds = block.bounds();
  return theta.cwiseMax(bounds.lower).cwiseMin(bounds.upper);
}

/// Uniform on [-1.5, 1.5): static blocks made for [-1, 1] are tried beyond their range as well.
inline Eigen::VectorXd uniform_input(Index samples, std::uint64_t seed) {
  return 1.5 * UniformNumbers(seed).vector(samples);
}

/// How far two ways to the same number may lie apart, relative to the largest absolute value of the signal or column.
struct ConformanceTolerances {
  /// Values by another order of summation (tiles, Jets, other kernels): rounding 1e-16 times the operations behind one
  /// output and the noise gain of a recursion leave 5 digits of room.
  double value = 1e-11;
  /// Analytic tangents against Jets: as above, one more recursion.
  double tangent = 1e-10;
  /// Tangents against central differences: rounding 1e-16 / difference_step = 5e-10, amplified like the values.
  double difference = 1e-6;
  /// Sine after the transient against G(e^{jw}): the remaining transient is below 1e-10 of the response.
  double steady_state = 1e-8;
};

struct ConformanceOptions {
  /// Point at which the laws are tested, (parameter_count(),); left out, sample_parameters draws it.
  std::optional<Eigen::VectorXd> parameters = {};
  std::function<Eigen::VectorXd(const AnyBlock&, std::uint64_t seed)> sample_parameters = perturbed_initial_parameters;
  /// Test signals; each law asks with other seeds.
  std::function<Eigen::VectorXd(Index samples, std::uint64_t seed)> input = uniform_input;
  /// Factor on input().
  double input_scale = 1.0;
  /// Initial states are uniform in +-state_scale.
  double state_scale = 0.3;
  std::uint64_t seed = 20240607;
  /// Record length: more than two full tiles and a part of one.
  Index samples = 2 * kMaxTileRows + 77;
  /// Record length for central differences.
  Index difference_samples = 160;
  /// Relative to max(1, |number|). Small, so that hardly a sample crosses a kink.
  double difference_step = 2e-7;
  /// Numbers of upstream columns that push_forward is tried with: every remainder of the vector widths.
  std::vector<Index> upstream_counts = {0, 1, 3, 4, 5, 8, 11, 17};
  /// Longest record over which a transient may die away in the test of frequency_response().
  Index longest_transient = 1 << 16;
  /// A block that calls itself linear must have a frequency_response().
  bool require_frequency_response = true;
  ConformanceTolerances tolerances = {};
};

/// A block at a point: what every law starts from.
struct ConformanceCase {
  AnyBlock block;
  ConformanceOptions options;
  Eigen::VectorXd theta;
  Eigen::VectorXd x0;
  Eigen::VectorXd u;
};

namespace detail {

using blockid::detail::view;

/// Equal bit for bit, NaN included.
inline bool same_bits(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == b.size() &&
         (a.size() == 0 || std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(double)) == 0);
}

inline std::string at(const std::string& what, Index k) { return what + "[" + std::to_string(k) + "]"; }

/// Numbers with guards on both sides that show a write beyond the ends.
class GuardedNumbers {
 public:
  explicit GuardedNumbers(Index n, double fill = 0.0)
      : all_(Eigen::VectorXd::Constant(n + 2 * kGuard, kSentinel)), count_(n) {
    all_.segment(kGuard, n).setConstant(fill);
  }

  double* data() { return all_.data() + kGuard; }
  std::span<double> span() { return {data(), static_cast<std::size_t>(count_)}; }
  bool intact() const {
    return (all_.head(kGuard).array() == kSentinel).all() && (all_.tail(kGuard).array() == kSentinel).all();
  }

 private:
  static constexpr Index kGuard = 64;
  static constexpr double kSentinel = 1234567.8901;

  Eigen::VectorXd all_;
  Index count_;
};

struct ApplyRun {
  Eigen::VectorXd y;
  Eigen::VectorXd x;
};

/// apply() over a record in pieces of the given sizes, the last one repeated.
inline ApplyRun apply_record(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& x0,
                             const Eigen::VectorXd& u, const std::vector<Index>& pieces = {}) {
  constexpr double kStale = std::numeric_limits<double>::quiet_NaN();
  ApplyRun run{Eigen::VectorXd::Constant(u.size(), kStale), x0};
  Index start = 0;
  for (std::size_t k = 0; start < u.size(); ++k) {
    const Index rest = u.size() - start;
    const Index rows = pieces.empty() ? rest : std::min(rest, pieces[std::min(k, pieces.size() - 1)]);
    block.apply(view(theta), view(run.x),
                view(u).subspan(static_cast<std::size_t>(start), static_cast<std::size_t>(rows)),
                view(run.y).subspan(static_cast<std::size_t>(start), static_cast<std::size_t>(rows)));
    start += rows;
  }
  return run;
}

struct TangentRun {
  Eigen::VectorXd y;
  Eigen::VectorXd x;
  /// (N, upstream + own).
  TangentMatrix columns;
  bool wrote_outside = false;
  bool finite = true;
};

/// push_forward() over a record in tiles of the given sizes, in turn and over again. directions: (N, upstream) du/dp.
/// Everything in a tile beyond the upstream columns holds `garbage` before each call.
inline TangentRun push_record(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& x0,
                              const Eigen::VectorXd& u, const TangentMatrix& directions, OwnColumns own,
                              const std::vector<Index>& tiles, double garbage) {
  const Index upstream = directions.cols();
  const Index used = upstream + block.own_columns(own);
  // One group more than needed: rows of a chain's tile are longer than what one block uses of them.
  const Index stride = padded_columns(used) + kColumnPadding;
  TangentRun run{Eigen::VectorXd(u.size()), x0, TangentMatrix(u.size(), used)};
  GuardedNumbers memory(block.tangent_memory(upstream, own));
  GuardedNumbers x(x0.size());
  std::copy(x0.begin(), x0.end(), x.data());
  Index start = 0;
  for (std::size_t k = 0; start < u.size(); ++k) {
    const Index rows = std::min({u.size() - start, tiles[k % tiles.size()], kMaxTileRows});
    GuardedNumbers tile(rows * stride, garbage);
    GuardedNumbers y(rows, garbage);
    const Tangents tangents{tile.data(), rows, stride, upstream};
    for (Index t = 0; t < rows; ++t) {
      for (Index c = 0; c < upstream; ++c) tangents.row(t)[c] = directions(start + t, c);
    }
    block.push_forward(view(theta), x.span(), memory.span(),
                       view(u).subspan(static_cast<std::size_t>(start), static_cast<std::size_t>(rows)), y.span(),
                       tangents, own);
    for (Index t = 0; t < rows; ++t) {
      run.y[start + t] = y.data()[t];
      for (Index c = 0; c < used; ++c) run.columns(start + t, c) = tangents.row(t)[c];
    }
    run.wrote_outside = run.wrote_outside || !tile.intact() || !y.intact();
    start += rows;
  }
  std::copy_n(x.data(), x0.size(), run.x.data());
  run.wrote_outside = run.wrote_outside || !memory.intact() || !x.intact();
  return run;
}

/// The same by push_negated() for every second tile: columns (N, upstream + n_theta), signs turned back.
inline TangentRun pack_record(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& x0,
                              const Eigen::VectorXd& u, const TangentMatrix& directions,
                              const std::vector<Index>& tiles, double garbage) {
  const Index upstream = directions.cols();
  const Index used = upstream + block.parameter_count();
  const Index stride = padded_columns(used) + kColumnPadding;
  TangentRun run{Eigen::VectorXd(u.size()), x0, TangentMatrix(u.size(), used)};
  GuardedNumbers memory(block.tangent_memory(upstream, OwnColumns::parameters));
  Index start = 0;
  for (std::size_t k = 0; start < u.size(); ++k) {
    const Index rows = std::min({u.size() - start, tiles[k % tiles.size()], kMaxTileRows});
    GuardedNumbers tile(rows * stride, garbage);
    const Tangents tangents{tile.data(), rows, stride, upstream};
    for (Index t = 0; t < rows; ++t) {
      for (Index c = 0; c < upstream; ++c) tangents.row(t)[c] = directions(start + t, c);
    }
    const std::size_t first = static_cast<std::size_t>(start);
    const std::size_t count = static_cast<std::size_t>(rows);
    const auto input = view(u).subspan(first, count);
    const auto output = view(run.y).subspan(first, count);
    if (k % 2 == 0) {
      GuardedNumbers packed(rows * used);
      run.finite =
          block.push_negated(view(theta), view(run.x), memory.span(), input, output, tangents, packed.data()) &&
          run.finite;
      run.columns.middleRows(start, rows) = -Eigen::Map<const TangentMatrix>(packed.data(), rows, used);
      run.wrote_outside = run.wrote_outside || !packed.intact();
    } else {
      block.push_forward(view(theta), view(run.x), memory.span(), input, output, tangents, OwnColumns::parameters);
      for (Index t = 0; t < rows; ++t) {
        for (Index c = 0; c < used; ++c) run.columns(start + t, c) = tangents.row(t)[c];
      }
    }
    start += rows;
  }
  return run;
}

/// Jets of apply over the whole record: value and columns [du | dtheta | dx0], (N, upstream + n_theta + n_x).
inline TangentRun jet_record(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& x0,
                             const Eigen::VectorXd& u, const TangentMatrix& directions) {
  const Index upstream = directions.cols();
  const Index columns = upstream + theta.size() + x0.size();
  TangentRun run{Eigen::VectorXd(u.size()), x0, TangentMatrix(u.size(), columns)};
  std::vector<TileJet> theta_jets(static_cast<std::size_t>(theta.size()));
  std::vector<TileJet> x_jets(static_cast<std::size_t>(x0.size()));
  std::vector<TileJet> u_jets(static_cast<std::size_t>(u.size()));
  std::vector<TileJet> y_jets(static_cast<std::size_t>(u.size()));
  for (Index first = 0; first < std::max<Index>(columns, 1); first += kJetStride) {
    const Index lanes = std::min<Index>(kJetStride, columns - first);
    const auto seeded = [&](double value, Index column) {
      return column >= first && column < first + lanes ? TileJet(value, static_cast<int>(column - first))
                                                       : TileJet(value);
    };
    for (Index k = 0; k < theta.size(); ++k) {
      theta_jets[static_cast<std::size_t>(k)] = seeded(theta[k], upstream + k);
    }
    for (Index k = 0; k < x0.size(); ++k) {
      x_jets[static_cast<std::size_t>(k)] = seeded(x0[k], upstream + theta.size() + k);
    }
    for (Index t = 0; t < u.size(); ++t) {
      TileJet& input = u_jets[static_cast<std::size_t>(t)];
      input = TileJet(u[t]);
      for (Index lane = 0; lane < lanes && first + lane < upstream; ++lane) {
        input.v[static_cast<int>(lane)] = directions(t, first + lane);
      }
    }
    block.apply(std::span<const TileJet>(theta_jets), std::span<TileJet>(x_jets), std::span<const TileJet>(u_jets),
                std::span<TileJet>(y_jets));
    for (Index t = 0; t < u.size(); ++t) {
      const TileJet& output = y_jets[static_cast<std::size_t>(t)];
      run.y[t] = output.a;
      for (Index lane = 0; lane < lanes; ++lane) run.columns(t, first + lane) = output.v[static_cast<int>(lane)];
    }
    for (Index k = 0; k < x0.size(); ++k) run.x[k] = x_jets[static_cast<std::size_t>(k)].a;
  }
  return run;
}

/// Random du/dp, (N, columns).
inline TangentMatrix random_directions(Index samples, Index columns, std::uint64_t seed) {
  UniformNumbers numbers(seed);
  return TangentMatrix::NullaryExpr(samples, columns, [&](Index, Index) { return numbers.next(); });
}

/// Columns of jet_record() in the order in which push_forward() writes them.
inline TangentMatrix in_own_order(const TangentMatrix& all, Index all_upstream, Index upstream,
                                  const std::vector<Index>& order) {
  TangentMatrix result(all.rows(), upstream + static_cast<Index>(order.size()));
  result.leftCols(upstream) = all.leftCols(upstream);
  for (std::size_t k = 0; k < order.size(); ++k) {
    result.col(upstream + static_cast<Index>(k)) = all.col(all_upstream + order[k]);
  }
  return result;
}

/// What the number with index k of column_order() is called.
inline std::string number_name(const AnyBlock& block, Index k) {
  if (k < block.parameter_count()) return block.parameter_names()[static_cast<std::size_t>(k)];
  return at("x(0)", k - block.parameter_count());
}

inline std::string column_name(const AnyBlock& block, Index upstream, const std::vector<Index>& order, Index c) {
  if (c < upstream) return "upstream column " + std::to_string(c) + " of " + std::to_string(upstream);
  return "d/d " + number_name(block, order[static_cast<std::size_t>(c - upstream)]);
}

/// Largest absolute value of each column, at least `least`.
inline Eigen::VectorXd column_scale(const Eigen::Ref<const Eigen::MatrixXd>& columns, double least) {
  if (columns.rows() == 0) return Eigen::VectorXd::Constant(columns.cols(), least);
  return columns.cwiseAbs().colwise().maxCoeff().transpose().cwiseMax(least);
}

inline double largest(const Eigen::Ref<const Eigen::MatrixXd>& values) {
  return values.size() == 0 ? 0.0 : values.cwiseAbs().maxCoeff();
}

/// Nothing is compared more finely than this: numbers below it are zero in effect.
inline constexpr double kTiny = 1e-280;

/// Compares two signals; `where` names them.
inline void close_signals(LawRecorder& law, const std::string& where, const Eigen::VectorXd& expected,
                          const Eigen::VectorXd& got, double tolerance, double scale = 0.0) {
  const Eigen::VectorXd least = Eigen::VectorXd::Constant(1, std::max({scale, largest(expected), kTiny}));
  law.close(expected, got, least, tolerance, [&](Index t, Index) { return at(where, t); });
}

inline void close_columns(LawRecorder& law, const AnyBlock& block, const TangentMatrix& expected,
                          const TangentMatrix& got, Index upstream, const std::vector<Index>& order, double tolerance,
                          double least, const std::string& how) {
  const Eigen::VectorXd scale = column_scale(expected, std::max(least, kTiny));
  law.close(expected, got, scale, tolerance, [&](Index t, Index c) {
    return column_name(block, upstream, order, c) + " at t = " + std::to_string(t) + ", " + how;
  });
}

inline bool is_permutation_of_first(std::vector<Index> order, Index n) {
  std::sort(order.begin(), order.end());
  for (Index k = 0; k < static_cast<Index>(order.size()); ++k) {
    if (order[static_cast<std::size_t>(k)] != k) return false;
  }
  return static_cast<Index>(order.size()) == n;
}

inline const char* name_of(OwnColumns own) {
  return own == OwnColumns::parameters ? "parameters" : "parameters and state";
}

inline constexpr std::array kBothOwnColumns = {OwnColumns::parameters, OwnColumns::parameters_and_state};

/// Tiles of many sizes, the smallest and the largest among them.
inline const std::vector<Index>& mixed_tiles() {
  static const std::vector<Index> kTiles = {1, kMaxTileRows, 7, 64, 2, 101, 3};
  return kTiles;
}

}  // namespace detail

// ---------------------------------------------------------------------------------------------------------------
// The laws. Each takes a case and writes what it finds.

/// Counts, names, limits and orders agree with one another; all are as many as parameter_count() and state_count() say.
inline void law_sizes(const ConformanceCase& c, LawRecorder& law) {
  const AnyBlock& block = c.block;
  const Index n = block.parameter_count();
  const std::vector<std::string> names = block.parameter_names();
  law.equal("number of parameter_names()", n, static_cast<Index>(names.size()));
  std::set<std::string> different;
  for (const std::string& name : names) {
    if (name.empty()) law.violated("a parameter has an empty name");
    if (!different.insert(name).second) law.violated("two parameters are called '" + name + "'");
  }
  law.equal("size of initial_parameters()", n, block.initial_parameters().size());
  if (!block.initial_parameters().allFinite()) law.violated("initial_parameters() are not all finite");
  const ParameterBounds bounds = block.bounds();
  law.equal("size of bounds().lower", n, bounds.lower.size());
  law.equal("size of bounds().upper", n, bounds.upper.size());
  if (bounds.lower.size() == n && bounds.upper.size() == n && block.initial_parameters().size() == n) {
    for (Index k = 0; k < n; ++k) {
      const double start = block.initial_parameters()[k];
      if (!(bounds.lower[k] <= start && start <= bounds.upper[k])) {
        law.violated(detail::at("initial_parameters()", k) + " lies outside its bounds");
      }
    }
  }
  for (const OwnColumns own : detail::kBothOwnColumns) {
    if (!detail::is_permutation_of_first(block.column_order(own), block.own_columns(own))) {
      law.violated(std::string("column_order(") + detail::name_of(own) + ") is no permutation of its own columns");
    }
    for (const Index upstream : c.options.upstream_counts) {
      if (block.tangent_memory(upstream, own) < 0) law.violated("tangent_memory() is negative");
    }
  }
  if (block.latency() < 0) law.violated("latency() is negative");
  if (const auto gain = block.gain_parameter(detail::view(c.theta)); gain && (*gain < 0 || *gain >= n)) {
    law.violated("gain_parameter()", "an index below " + std::to_string(n), *gain);
  }
}

/// The same call gives the same bits, whatever came between, and leaves theta and u as they were.
inline void law_pure(const ConformanceCase& c, LawRecorder& law) {
  const Eigen::VectorXd theta = c.theta;
  const Eigen::VectorXd u = c.u;
  Eigen::VectorXd y(u.size());
  Eigen::VectorXd x = c.x0;
  const auto call = [&](double stale) {
    y.setConstant(stale);
    x = c.x0;
    c.block.apply(detail::view(theta), detail::view(x), detail::view(u), detail::view(y));
    return detail::ApplyRun{y, x};
  };
  const detail::ApplyRun first = call(0.0);
  const Eigen::VectorXd other = c.options.input_scale * c.options.input(100, c.options.seed + 11);
  detail::apply_record(c.block, 0.5 * c.theta, 2.0 * c.x0, other);
  const detail::ApplyRun second = call(std::numeric_limits<double>::quiet_NaN());
  if (!detail::same_bits(first.y, second.y)) law.violated("y of apply() differs between two equal calls");
  if (!detail::same_bits(first.x, second.x)) law.violated("x of apply() differs between two equal calls");
  if (!detail::same_bits(theta, c.theta)) law.violated("apply() wrote to theta");
  if (!detail::same_bits(u, c.u)) law.violated("apply() wrote to u");

  const TangentMatrix directions = detail::random_directions(u.size(), 3, c.options.seed + 12);
  const auto push = [&](double garbage) {
    return detail::push_record(c.block, theta, c.x0, u, directions, OwnColumns::parameters_and_state, {kMaxTileRows},
                               garbage);
  };
  const detail::TangentRun zeros = push(0.0);
  const detail::TangentRun stale = push(std::numeric_limits<double>::quiet_NaN());
  if (!detail::same_bits(zeros.y, stale.y) || !detail::same_bits(zeros.columns.reshaped(), stale.columns.reshaped())) {
    law.violated("push_forward() differs between two equal calls that found other stale numbers in the tile");
  }
  if (!detail::same_bits(theta, c.theta)) law.violated("push_forward() wrote to theta");
  if (!detail::same_bits(u, c.u)) law.violated("push_forward() wrote to u");
}

/// y before T does not depend on u from T on.
inline void law_causal(const ConformanceCase& c, LawRecorder& law) {
  const Eigen::VectorXd y = detail::apply_record(c.block, c.theta, c.x0, c.u).y;
  const Index n = c.u.size();
  for (const Index from : {Index{1}, n / 3, kMaxTileRows - 1, kMaxTileRows, n - 1}) {
    if (from < 1 || from >= n) continue;
    Eigen::VectorXd changed = c.u;
    changed.tail(n - from) = c.options.input_scale * c.options.input(n - from, c.options.seed + 21);
    const Eigen::VectorXd other = detail::apply_record(c.block, c.theta, c.x0, changed).y;
    detail::close_signals(law, "after a change of u from t = " + std::to_string(from) + " on, y", y.head(from),
                          other.head(from), c.options.tolerances.value, detail::largest(y));
  }
}

/// One pass over N samples = passes over parts of it with x carried, in apply(). An empty pass changes nothing.
inline void law_chunked(const ConformanceCase& c, LawRecorder& law) {
  const detail::ApplyRun whole = detail::apply_record(c.block, c.theta, c.x0, c.u);
  const Index n = c.u.size();
  const double tolerance = c.options.tolerances.value;
  const double scale = std::max(detail::largest(whole.x), detail::largest(whole.y));
  const std::vector<std::vector<Index>> ways = {{1}, {2, 1}, {7}, {n / 3, n}, {n - 1, 1}, {kMaxTileRows}, {600, 5}};
  for (const std::vector<Index>& pieces : ways) {
    const std::string how = "in pieces of " + std::to_string(pieces.front()) + ", " + std::to_string(pieces.back());
    const detail::ApplyRun parts = detail::apply_record(c.block, c.theta, c.x0, c.u, pieces);
    detail::close_signals(law, how + " y", whole.y, parts.y, tolerance);
    detail::close_signals(law, how + " x", whole.x, parts.x, tolerance, scale);
  }
  Eigen::VectorXd x = c.x0;
  c.block.apply(detail::view(c.theta), detail::view(x), {}, {});
  if (!detail::same_bits(x, c.x0)) law.violated("an empty pass changed x");
}

/// The value part of Jets = the value of doubles.
inline void law_jet_value(const ConformanceCase& c, LawRecorder& law) {
  const detail::ApplyRun doubles = detail::apply_record(c.block, c.theta, c.x0, c.u);
  const detail::TangentRun jets = detail::jet_record(c.block, c.theta, c.x0, c.u, TangentMatrix(c.u.size(), 0));
  const double tolerance = c.options.tolerances.value;
  detail::close_signals(law, "y", doubles.y, jets.y, tolerance);
  detail::close_signals(law, "x after the record", doubles.x, jets.x, tolerance,
                        std::max(detail::largest(doubles.x), detail::largest(doubles.y)));
}

/// push_forward() gives the same y and x as apply().
inline void law_push_value(const ConformanceCase& c, LawRecorder& law) {
  const detail::ApplyRun apply = detail::apply_record(c.block, c.theta, c.x0, c.u);
  const TangentMatrix directions = detail::random_directions(c.u.size(), 2, c.options.seed + 31);
  const double tolerance = c.options.tolerances.value;
  const double scale = std::max(detail::largest(apply.x), detail::largest(apply.y));
  for (const OwnColumns own : detail::kBothOwnColumns) {
    const detail::TangentRun push =
        detail::push_record(c.block, c.theta, c.x0, c.u, directions, own, detail::mixed_tiles(), 1e3);
    detail::close_signals(law, "y", apply.y, push.y, tolerance);
    detail::close_signals(law, "x after the record", apply.x, push.x, tolerance, scale);
  }
}

/// push_forward() = Jets of apply over the whole record, for every number of upstream columns.
inline void law_tangents_jets(const ConformanceCase& c, LawRecorder& law) {
  const std::vector<Index>& counts = c.options.upstream_counts;
  const Index most = counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end());
  const TangentMatrix directions = detail::random_directions(c.u.size(), most, c.options.seed + 41);
  const detail::TangentRun jets = detail::jet_record(c.block, c.theta, c.x0, c.u, directions);
  const double least = 1e-6 * detail::largest(jets.columns);
  double garbage = std::numeric_limits<double>::quiet_NaN();
  for (const OwnColumns own : detail::kBothOwnColumns) {
    const std::vector<Index> order = c.block.column_order(own);
    for (const Index upstream : counts) {
      const detail::TangentRun push = detail::push_record(c.block, c.theta, c.x0, c.u, directions.leftCols(upstream),
                                                          own, detail::mixed_tiles(), garbage);
      garbage = std::isnan(garbage) ? 1e9 : std::numeric_limits<double>::quiet_NaN();
      detail::close_columns(law, c.block, detail::in_own_order(jets.columns, most, upstream, order), push.columns,
                            upstream, order, c.options.tolerances.tangent, least,
                            std::string("own columns: ") + detail::name_of(own));
    }
  }
}

/// push_forward() = central differences of apply.
inline void law_tangents_differences(const ConformanceCase& c, LawRecorder& law) {
  const Index samples = std::min(c.options.difference_samples, c.u.size());
  const Eigen::VectorXd u = c.u.head(samples);
  constexpr Index kUpstream = 3;
  const TangentMatrix directions = detail::random_directions(samples, kUpstream, c.options.seed + 51);
  const OwnColumns own = OwnColumns::parameters_and_state;
  const std::vector<Index> order = c.block.column_order(own);
  const detail::TangentRun push =
      detail::push_record(c.block, c.theta, c.x0, u, directions, own, {64}, std::numeric_limits<double>::quiet_NaN());
  TangentMatrix differences(samples, kUpstream + static_cast<Index>(order.size()));
  const auto difference = [&](double step, const auto& moved) {
    return Eigen::VectorXd((moved(step) - moved(-step)) / (2.0 * step));
  };
  double finest_step = c.options.difference_step;
  for (Index k = 0; k < kUpstream; ++k) {
    differences.col(k) = difference(finest_step, [&](double step) {
      return detail::apply_record(c.block, c.theta, c.x0, u + step * directions.col(k)).y;
    });
  }
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Index number = order[k];
    const bool is_state = number >= c.theta.size();
    const Index place = is_state ? number - c.theta.size() : number;
    const double value = is_state ? c.x0[place] : c.theta[place];
    differences.col(kUpstream + static_cast<Index>(k)) =
        difference(c.options.difference_step * std::max(1.0, std::abs(value)), [&](double step) {
          Eigen::VectorXd theta = c.theta;
          Eigen::VectorXd x0 = c.x0;
          (is_state ? x0 : theta)[place] += step;
          return detail::apply_record(c.block, theta, x0, u).y;
        });
  }
  // Differences cannot see derivatives below the rounding of y divided by the step.
  const double rounding = 50.0 * std::numeric_limits<double>::epsilon() * detail::largest(push.y) / finest_step;
  detail::close_columns(law, c.block, differences, push.columns, kUpstream, order, c.options.tolerances.difference,
                        rounding / c.options.tolerances.difference, "against central differences");
}

/// Tangents do not depend on how the record is cut into tiles.
inline void law_tangents_chunked(const ConformanceCase& c, LawRecorder& law) {
  constexpr Index kUpstream = 5;
  const TangentMatrix directions = detail::random_directions(c.u.size(), kUpstream, c.options.seed + 61);
  for (const OwnColumns own : detail::kBothOwnColumns) {
    const std::vector<Index> order = c.block.column_order(own);
    const auto push = [&](const std::vector<Index>& tiles) {
      return detail::push_record(c.block, c.theta, c.x0, c.u, directions, own, tiles,
                                 std::numeric_limits<double>::quiet_NaN());
    };
    const TangentMatrix largest_tiles = push({kMaxTileRows}).columns;
    const double least = 1e-6 * detail::largest(largest_tiles);
    for (const Index tile : {Index{1}, Index{7}, Index{64}, Index{500}}) {
      detail::close_columns(law, c.block, largest_tiles, push({tile}).columns, kUpstream, order,
                            c.options.tolerances.tangent, least, "tiles of " + std::to_string(tile));
    }
  }
}

/// Upstream columns pass linearly: push(D C) = push(D) C for a matrix C; own columns do not depend on D.
inline void law_tangents_linear(const ConformanceCase& c, LawRecorder& law) {
  constexpr Index kBefore = 4;
  constexpr Index kAfter = 6;
  const TangentMatrix directions = detail::random_directions(c.u.size(), kBefore, c.options.seed + 71);
  const TangentMatrix mix = 3.0 * detail::random_directions(kBefore, kAfter, c.options.seed + 72);
  const OwnColumns own = OwnColumns::parameters_and_state;
  const std::vector<Index> order = c.block.column_order(own);
  const auto push = [&](const TangentMatrix& columns) {
    return detail::push_record(c.block, c.theta, c.x0, c.u, columns, own, detail::mixed_tiles(), -7.0).columns;
  };
  const TangentMatrix before = push(directions);
  TangentMatrix expected(c.u.size(), kAfter + static_cast<Index>(order.size()));
  expected.leftCols(kAfter) = before.leftCols(kBefore) * mix;
  expected.rightCols(static_cast<Index>(order.size())) = before.rightCols(static_cast<Index>(order.size()));
  detail::close_columns(law, c.block, expected, push(directions * mix), kAfter, order, c.options.tolerances.tangent,
                        1e-6 * detail::largest(expected), "mixed upstream columns");
}

/// push_negated() gives the rows of push_forward(), packed and negated, and each continues what the other began.
inline void law_packed_rows(const ConformanceCase& c, LawRecorder& law) {
  constexpr double kStale = 1e3;
  const OwnColumns own = OwnColumns::parameters;
  const std::vector<Index> order = c.block.column_order(own);
  for (const Index upstream : c.options.upstream_counts) {
    const TangentMatrix directions = detail::random_directions(c.u.size(), upstream, c.options.seed + 86);
    const detail::TangentRun push =
        detail::push_record(c.block, c.theta, c.x0, c.u, directions, own, detail::mixed_tiles(), kStale);
    const detail::TangentRun packed =
        detail::pack_record(c.block, c.theta, c.x0, c.u, directions, detail::mixed_tiles(), kStale);
    const std::string with = " with " + std::to_string(upstream) + " upstream columns";
    if (packed.wrote_outside) law.violated("push_negated()" + with + " wrote behind its last row");
    if (!packed.finite) law.violated("push_negated()" + with + " calls finite rows not finite");
    detail::close_signals(law, "y", push.y, packed.y, c.options.tolerances.value);
    detail::close_columns(law, c.block, push.columns, packed.columns, upstream, order, c.options.tolerances.tangent,
                          1e-6 * detail::largest(push.columns), "packed rows");
  }
}

/// push_forward() writes to its tile, y, x and tangent_memory() numbers, and apply() to y and x, and nowhere else.
inline void law_stays_inside(const ConformanceCase& c, LawRecorder& law) {
  for (const OwnColumns own : detail::kBothOwnColumns) {
    for (const Index upstream : c.options.upstream_counts) {
      const TangentMatrix directions = detail::random_directions(c.u.size(), upstream, c.options.seed + 81);
      if (detail::push_record(c.block, c.theta, c.x0, c.u, directions, own, detail::mixed_tiles(), 0.0).wrote_outside) {
        law.violated("push_forward() with " + std::to_string(upstream) +
                     " upstream columns wrote outside its tile, memory, x or y; own columns: " + detail::name_of(own));
      }
    }
  }
  for (const Index samples : {Index{1}, Index{7}, c.u.size()}) {
    detail::GuardedNumbers x(c.x0.size());
    detail::GuardedNumbers y(samples);
    c.block.apply(detail::view(c.theta), x.span(), detail::view(c.u).first(static_cast<std::size_t>(samples)),
                  y.span());
    if (!x.intact() || !y.intact()) {
      law.violated("apply() over " + std::to_string(samples) + " samples wrote outside x or y");
    }
  }
}

/// Linear blocks from rest: B(a u + b v) = a B u + b B v.
inline void law_superposition(const ConformanceCase& c, LawRecorder& law) {
  if (!c.block.is_linear()) return law.skip("is_linear() is false");
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(c.x0.size());
  const Eigen::VectorXd v = c.options.input_scale * c.options.input(c.u.size(), c.options.seed + 91);
  const auto run = [&](const Eigen::VectorXd& input) { return detail::apply_record(c.block, c.theta, rest, input).y; };
  const Eigen::VectorXd y_u = run(c.u);
  const Eigen::VectorXd y_v = run(v);
  detail::close_signals(law, "response to 2.5 u - 0.75 v, y", 2.5 * y_u - 0.75 * y_v, run(2.5 * c.u - 0.75 * v),
                        c.options.tolerances.value, std::max(detail::largest(y_u), detail::largest(y_v)));
}

/// Linear blocks from rest: a delayed input gives the delayed output.
inline void law_shift_invariance(const ConformanceCase& c, LawRecorder& law) {
  if (!c.block.is_linear()) return law.skip("is_linear() is false");
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(c.x0.size());
  const Eigen::VectorXd y = detail::apply_record(c.block, c.theta, rest, c.u).y;
  const Index n = c.u.size();
  for (const Index shift : {Index{1}, Index{13}, n / 2}) {
    Eigen::VectorXd delayed = Eigen::VectorXd::Zero(n);
    delayed.tail(n - shift) = c.u.head(n - shift);
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(n);
    expected.tail(n - shift) = y.head(n - shift);
    detail::close_signals(law, "input delayed by " + std::to_string(shift) + ", y", expected,
                          detail::apply_record(c.block, c.theta, rest, delayed).y, c.options.tolerances.value,
                          detail::largest(y));
  }
}

/// Linear blocks: after the transient, cos(w t) gives |G| cos(w t + arg G) with G = frequency_response(theta, w).
inline void law_frequency_response(const ConformanceCase& c, LawRecorder& law) {
  const std::span<const double> theta = detail::view(c.theta);
  if (!c.block.is_linear()) {
    if (c.block.frequency_response(theta, 0.5)) law.violated("frequency_response() of a block that is not linear");
    return law.skip("is_linear() is false");
  }
  if (!c.block.frequency_response(theta, 0.5)) {
    if (!c.options.require_frequency_response) return law.skip("no frequency_response()");
    return law.violated("a linear block has no frequency_response()");
  }
  // The transient has died away when the impulse response has. No delay is longer than the number of states.
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(c.x0.size());
  Index transient = 256 + 2 * c.block.state_count();
  for (;; transient *= 2) {
    const Eigen::VectorXd h = detail::apply_record(c.block, c.theta, rest, Eigen::VectorXd::Unit(2 * transient, 0)).y;
    if (h.tail(transient).lpNorm<1>() <= 1e-10 * h.lpNorm<1>()) break;
    if (2 * transient > c.options.longest_transient) {
      return law.skip("the impulse response does not die away within " + std::to_string(transient) + " samples");
    }
  }
  const Index n = transient + 100;
  double peak = 0.0;
  const std::array omegas = {0.0, 0.05, 0.4, 1.1, 2.3, std::numbers::pi};
  for (const double omega : omegas) peak = std::max(peak, std::abs(*c.block.frequency_response(theta, omega)));
  for (const double omega : omegas) {
    const std::complex<double> response = *c.block.frequency_response(theta, omega);
    const auto wave = [&](Index t) { return std::polar(1.0, omega * static_cast<double>(t)); };
    const Eigen::VectorXd u = Eigen::VectorXd::NullaryExpr(n, [&](Index t) { return wave(t).real(); });
    const Eigen::VectorXd expected =
        Eigen::VectorXd::NullaryExpr(100, [&](Index t) { return (response * wave(transient + t)).real(); });
    detail::close_signals(law, "steady state at w = " + std::to_string(omega) + ", y", expected,
                          detail::apply_record(c.block, c.theta, rest, u).y.tail(100),
                          c.options.tolerances.steady_state, peak);
  }
}

/// Blocks linear in their parameters, from rest: y is affine in theta, y = y_0(u) + Phi(u) theta.
inline void law_linear_in_parameters(const ConformanceCase& c, LawRecorder& law) {
  if (!c.block.is_linear_in_parameters()) return law.skip("is_linear_in_parameters() is false");
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(c.x0.size());
  const Eigen::VectorXd other = c.theta + UniformNumbers(c.options.seed + 101).vector(c.theta.size());
  const auto run = [&](const Eigen::VectorXd& theta) { return detail::apply_record(c.block, theta, rest, c.u).y; };
  const Eigen::VectorXd y = run(c.theta);
  const Eigen::VectorXd y_other = run(other);
  detail::close_signals(law, "theta + 2.5 (theta' - theta), y", y + 2.5 * (y_other - y),
                        run(c.theta + 2.5 * (other - c.theta)), c.options.tolerances.value,
                        std::max(detail::largest(y), detail::largest(y_other)));
}

namespace detail {

/// The block g that `rescaled` gives for k of either sign: from rest, g(input(k) u) = output(k) f(u).
template <class RescaledBy, class Factor>
void check_rescaled(const ConformanceCase& c, LawRecorder& law, const std::string& member, RescaledBy&& rescaled,
                    Factor&& input, Factor&& output) {
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(c.x0.size());
  const Eigen::VectorXd y = apply_record(c.block, c.theta, rest, c.u).y;
  bool any = false;
  for (const double k : {2.5, 0.01, -0.75}) {
    const std::optional<Rescaled> g = rescaled(k);
    if (!g) continue;
    any = true;
    const std::string how = "k = " + std::to_string(k);
    law.equal("number of parameters, " + how, g->block.parameter_count(), g->parameters.size());
    if (g->block.parameter_count() != g->parameters.size()) continue;
    const Eigen::VectorXd start = Eigen::VectorXd::Zero(g->block.state_count());
    close_signals(law, "rescaled block, " + how + ", y", output(k) * y,
                  apply_record(g->block, g->parameters, start, input(k) * c.u).y, c.options.tolerances.value);
  }
  if (!any) law.skip("no " + member);
}

inline double once(double) { return 1.0; }
inline double times(double k) { return k; }

}  // namespace detail

/// with_scaled_input(): g(k u) = f(u) from rest, for k of either sign.
inline void law_scaled_input(const ConformanceCase& c, LawRecorder& law) {
  const auto rescaled = [&](double k) { return c.block.with_scaled_input(detail::view(c.theta), k); };
  detail::check_rescaled(c, law, "with_scaled_input()", rescaled, detail::times, detail::once);
}

/// with_scaled_output(): g(u) = k f(u) from rest, for k of either sign.
inline void law_scaled_output(const ConformanceCase& c, LawRecorder& law) {
  const auto rescaled = [&](double k) { return c.block.with_scaled_output(detail::view(c.theta), k); };
  detail::check_rescaled(c, law, "with_scaled_output()", rescaled, detail::once, detail::times);
}

/// with_scaled_signals(): g(k u) = k f(u) from rest, for k of either sign.
inline void law_scaled_signals(const ConformanceCase& c, LawRecorder& law) {
  const auto rescaled = [&](double k) { return c.block.with_scaled_signals(detail::view(c.theta), k); };
  detail::check_rescaled(c, law, "with_scaled_signals()", rescaled, detail::times, detail::times);
}

/// adapted_to(): a block of the same kind whose structure is settled, so that a second call with another signal changes
/// nothing.
inline void law_adapted(const ConformanceCase& c, LawRecorder& law) {
  const AnyBlock once = c.block.adapted_to(detail::view(c.u));
  const Eigen::VectorXd wider = (3.0 * c.u).array() + 1.0;
  const AnyBlock twice = once.adapted_to(detail::view(wider));
  law.equal("kind() after adapted_to()", c.block.kind(), once.kind());
  if (once.arguments() != twice.arguments()) law.violated("a second adapted_to() changed arguments()");
  law.equal("parameter_count() after a second adapted_to()", once.parameter_count(), twice.parameter_count());
  if (once.parameter_count() != twice.parameter_count()) return;
  const Eigen::VectorXd theta = once.initial_parameters();
  if (!detail::same_bits(theta, twice.initial_parameters())) {
    law.violated("a second adapted_to() changed initial_parameters()");
  }
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(once.state_count());
  detail::close_signals(law, "after a second adapted_to(), y", detail::apply_record(once, theta, rest, c.u).y,
                        detail::apply_record(twice, theta, rest, c.u).y, c.options.tolerances.value);
}

/// A law with the name that reports bear.
struct BlockLaw {
  const char* name;
  void (*check)(const ConformanceCase&, LawRecorder&);
};

/// All laws, in the order in which check_block() tests them.
inline constexpr std::array kBlockLaws = {
    BlockLaw{"sizes", law_sizes},
    BlockLaw{"pure", law_pure},
    BlockLaw{"causal", law_causal},
    BlockLaw{"chunked", law_chunked},
    BlockLaw{"stays inside", law_stays_inside},
    BlockLaw{"Jet value", law_jet_value},
    BlockLaw{"push value", law_push_value},
    BlockLaw{"tangents = Jets", law_tangents_jets},
    BlockLaw{"tangents = differences", law_tangents_differences},
    BlockLaw{"tangents chunked", law_tangents_chunked},
    BlockLaw{"tangents linear", law_tangents_linear},
    BlockLaw{"packed rows", law_packed_rows},
    BlockLaw{"superposition", law_superposition},
    BlockLaw{"shift invariance", law_shift_invariance},
    BlockLaw{"frequency response", law_frequency_response},
    BlockLaw{"linear in parameters", law_linear_in_parameters},
    BlockLaw{"scaled input", law_scaled_input},
    BlockLaw{"scaled output", law_scaled_output},
    BlockLaw{"scaled signals", law_scaled_signals},
    BlockLaw{"adapted", law_adapted},
};

/// Tests every law of the Block contract at one point. Same options, same report: nothing is drawn from a clock.
///
/// A law that throws counts as violated. When sizes do not agree, or the output is not finite at the chosen parameters,
/// the other laws are skipped.
inline ConformanceReport check_block(const AnyBlock& block, const ConformanceOptions& options = {}) {
  ConformanceReport report;
  ConformanceCase c{block, options, {}, {}, {}};
  const auto run = [&](const BlockLaw& law) {
    LawRecorder recorder(law.name, report);
    report.checked.emplace_back(law.name);
    try {
      law.check(c, recorder);
    } catch (const std::exception& error) {
      recorder.violated(std::string("it threw \"") + error.what() + "\"");
    }
  };
  const auto skip_rest = [&](const std::string& reason) {
    for (const BlockLaw& law : kBlockLaws) {
      if (law.check != law_sizes) LawRecorder(law.name, report).skip(reason);
    }
    return report;
  };

  const Index n = block.parameter_count();
  c.theta = Eigen::VectorXd::Zero(n);
  LawRecorder sizes("sizes", report);
  if (n < 0 || block.state_count() < 0) {
    sizes.violated("parameter_count() or state_count() is negative");
    return skip_rest("sizes are wrong");
  }
  if (options.parameters) {
    sizes.equal("size of ConformanceOptions::parameters", n, options.parameters->size());
    if (options.parameters->size() != n) return skip_rest("sizes are wrong");
    c.theta = *options.parameters;
  } else if (block.initial_parameters().size() == n && block.bounds().lower.size() == n &&
             block.bounds().upper.size() == n) {
    c.theta = options.sample_parameters(block, options.seed);
  }
  run(kBlockLaws.front());
  if (!report.ok()) return skip_rest("sizes are wrong");

  c.x0 = options.state_scale * UniformNumbers(options.seed + 1).vector(block.state_count());
  c.u = options.input_scale * options.input(options.samples, options.seed + 2);
  if (!detail::apply_record(block, c.theta, c.x0, c.u).y.allFinite()) {
    sizes.violated("y is not finite at the chosen parameters; give others in ConformanceOptions::parameters");
    return skip_rest("y is not finite");
  }
  for (const BlockLaw& law : kBlockLaws) {
    if (law.check != law_sizes) run(law);
  }
  return report;
}

}  // namespace blockid::testing
