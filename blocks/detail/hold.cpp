#include <blockid/blocks/detail/hold.hpp>

#include <blockid/data/error.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

namespace blockid::detail {
namespace {

/// Coefficients of a block's prefilter, of gain 1 at frequency zero, that are left out.
constexpr double kPrefilterTolerance = 1e-10;
/// Half-length of a prefilter that is exact in double: the slowest pole, -0.66 at degree 11, to this power is 1e-18.
constexpr Index kExactHalfLength = 100;

/// (n choose 0) .. (n choose n) with alternating sign.
Eigen::VectorXd alternating_binomials(Index n) {
  Eigen::VectorXd row(n + 1);
  double value = 1.0;
  for (Index k = 0; k <= n; ++k) {
    row[k] = k % 2 == 0 ? value : -value;
    value = value * static_cast<double>(n - k) / static_cast<double>(k + 1);
  }
  return row;
}

/// d^m/dx^m of the centred B-spline of odd degree d at the integer x, from the right.
double spline_derivative(Index d, Index m, Index x) {
  const Eigen::VectorXd binomials = alternating_binomials(d + 1);
  double factorial = 1.0;
  for (Index k = 2; k <= d - m; ++k) factorial *= static_cast<double>(k);
  double sum = 0.0;
  for (Index k = 0; k <= d + 1; ++k) {
    const Index distance = x + (d + 1) / 2 - k;
    if (distance < 0) continue;
    sum += binomials[k] * std::pow(static_cast<double>(distance), static_cast<double>(d - m));
  }
  return sum / factorial;
}

/// (reach + 1,) values of the spline at 0, 1, ..., reach.
Eigen::VectorXd spline_samples(Index d) {
  return Eigen::VectorXd::NullaryExpr((d - 1) / 2 + 1, [d](Index k) { return spline_derivative(d, 0, k); });
}

/// (2 half + 1,) impulse response of 1 / sum_k beta(k) z^k: its Fourier series, whose sums over points converge
/// geometrically.
Eigen::VectorXd inverse_of_samples(Index d, Index half) {
  constexpr Index kPoints = 1024;
  const Eigen::VectorXd samples = spline_samples(d);
  const auto cosine = [](Index k) { return std::cos(2.0 * std::numbers::pi * static_cast<double>(k) / kPoints); };
  Eigen::VectorXd response(2 * half + 1);
  for (Index k = 0; k <= half; ++k) {
    double sum = 0.0;
    for (Index q = 0; q < kPoints; ++q) {
      double value = samples[0];
      for (Index j = 1; j < samples.size(); ++j) value += 2.0 * samples[j] * cosine(q * j % kPoints);
      sum += cosine(q * k % kPoints) / value;
    }
    response[half + k] = response[half - k] = sum / kPoints;
  }
  return response;
}

Eigen::VectorXd truncated_prefilter(Index d) {
  const Eigen::VectorXd full = inverse_of_samples(d, kExactHalfLength);
  Index half = 1;
  while (std::abs(full[kExactHalfLength + half]) > kPrefilterTolerance) ++half;
  const Eigen::VectorXd kept = full.segment(kExactHalfLength - half, 2 * half + 1);
  return kept / kept.sum();
}

HoldPieces spline_pieces(Index d) {
  HoldPieces pieces;
  pieces.reach = (d - 1) / 2;
  pieces.prefilter = truncated_prefilter(d);
  pieces.weights.resize(d + 1, d + 1);
  for (Index m = 0; m <= d; ++m) {
    for (Index j = 0; j <= d; ++j) pieces.weights(m, j) = spline_derivative(d, m, j - 1 - pieces.reach);
  }
  return pieces;
}

HoldPieces make_pieces(Hold hold) {
  HoldPieces pieces;
  pieces.prefilter = Eigen::VectorXd::Ones(1);
  switch (hold) {
    case Hold::zero_order:
      pieces.weights = Eigen::RowVector2d(0.0, 1.0);
      return pieces;
    case Hold::first_order:
      pieces.weights = Eigen::Matrix2d{{0.0, 1.0}, {1.0, -1.0}};
      return pieces;
    case Hold::cubic:
      return spline_pieces(3);
    case Hold::quintic:
      return spline_pieces(5);
    case Hold::septic:
      return spline_pieces(7);
    case Hold::band_limited:
      return spline_pieces(11);
  }
  return pieces;
}

/// The roots z, -1 < z < 0, of sum_k beta(k) z^k, by bisection between its sign changes over a fine grid of log(-z).
std::vector<double> prefilter_poles(Index d) {
  const Eigen::VectorXd samples = spline_samples(d);
  const Index reach = samples.size() - 1;
  // In v = z + 1/z the sum is a polynomial: Chebyshev's T_k(v/2) = (z^k + z^-k)/2 continued outside [-1, 1].
  const auto value = [&](double log_z) {
    double sum = samples[0];
    for (Index k = 1; k <= reach; ++k) {
      sum += (k % 2 == 0 ? 2.0 : -2.0) * samples[k] * std::cosh(static_cast<double>(k) * log_z);
    }
    return sum;
  };
  std::vector<double> poles;
  constexpr int kSteps = 1400;
  constexpr double kStep = 0.01;
  for (int step = kSteps; step > 1; --step) {
    double left = -kStep * step;
    double right = -kStep * (step - 1);
    if ((value(left) > 0.0) == (value(right) > 0.0)) continue;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (left + right);
      ((value(middle) > 0.0) == (value(left) > 0.0) ? left : right) = middle;
    }
    poles.push_back(-std::exp(0.5 * (left + right)));
  }
  return poles;
}

}  // namespace

const HoldPieces& hold_pieces(Hold hold) {
  static const std::vector<HoldPieces> kAll = [] {
    std::vector<HoldPieces> pieces;
    for (const Hold each : holds()) pieces.push_back(make_pieces(each));
    return pieces;
  }();
  return kAll[static_cast<std::size_t>(hold)];
}

Index held_taps(Hold hold) {
  const HoldPieces& pieces = hold_pieces(hold);
  return pieces.taps() + pieces.prefilter.size() - 2;
}

Eigen::VectorXd interpolation_coefficients(const Eigen::VectorXd& samples, Hold hold) {
  const HoldPieces& pieces = hold_pieces(hold);
  const Index reach = pieces.reach;
  if (reach == 0) return samples;
  const Index d = pieces.degree();
  const Index count = samples.size();
  if (count < 2 * d + 2) {
    fail("hold ", to_text(hold), ": expected at least ", 2 * d + 2, " samples to interpolate, got ", count);
  }
  // The spline of the record followed by zeros, c = prefilter * samples.
  const Eigen::VectorXd prefilter = inverse_of_samples(d, kExactHalfLength);
  const Index length = count + 2 * reach;
  Eigen::VectorXd c(length);
  for (Index k = 0; k < length; ++k) {
    const Index first = std::max<Index>(0, k - reach - kExactHalfLength);
    const Index last = std::min<Index>(count - 1, k - reach + kExactHalfLength);
    c[k] = last < first ? 0.0
                        : samples.segment(first, last - first + 1)
                              .dot(prefilter.segment(first - (k - reach) + kExactHalfLength, last - first + 1));
  }
  // Plus multiples of z^k from either end, which vanish at all samples, such that the spline has no knot next to its
  // ends: the difference of order d + 1 is the jump of the derivative of order d.
  const std::vector<double> poles = prefilter_poles(d);
  const Eigen::VectorXd difference = alternating_binomials(d + 1);
  const Index unknowns = 2 * reach;
  const auto homogeneous = [&](Index i, Index k) {
    const double z = poles[static_cast<std::size_t>(i % reach)];
    return std::pow(z, static_cast<double>(i < reach ? k : length - 1 - k));
  };
  Eigen::MatrixXd system(unknowns, unknowns);
  Eigen::VectorXd jumps(unknowns);
  for (Index row = 0; row < unknowns; ++row) {
    // Jump at sample 1 .. reach or count - 1 - reach .. count - 2, over c_{j - reach - 1} .. c_{j + reach + 1}.
    const Index start = row < reach ? row : count - 2 - reach + (row - reach);
    jumps[row] = -c.segment(start, d + 2).dot(difference);
    for (Index i = 0; i < unknowns; ++i) {
      double sum = 0.0;
      for (Index k = 0; k < d + 2; ++k) sum += difference[k] * homogeneous(i, start + k);
      system(row, i) = sum;
    }
  }
  const Eigen::VectorXd factors = system.fullPivLu().solve(jumps);
  for (Index i = 0; i < unknowns; ++i) {
    const double z = poles[static_cast<std::size_t>(i % reach)];
    double term = factors[i];
    for (Index k = 0; k < length && std::abs(term) > 1e-300; ++k) {
      c[i < reach ? k : length - 1 - k] += term;
      term *= z;
    }
  }
  return c;
}

Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& m) {
  if (!m.allFinite()) return Eigen::MatrixXd::Constant(m.rows(), m.cols(), std::numeric_limits<double>::quiet_NaN());
  return m.exp();
}

template SampledSystem<double> sampled_system(const MatrixOf<double>&, const VectorOf<double>&, const Sampling&);
template HeldSystem<double> held_system(const MatrixOf<double>&, const VectorOf<double>&, const Sampling&);
template HeldSystem<TileJet> held_system(const MatrixOf<TileJet>&, const VectorOf<TileJet>&, const Sampling&);

}  // namespace blockid::detail
