#include <blockid/blocks/localising_basis.hpp>

#include <blockid/data/error.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

using Complex = std::complex<long double>;

/// Points of a fit on the imaginary axis, for each basis function, and how far they reach beyond the break points.
constexpr Index kPointsEach = 6;
constexpr double kReach = 10.0;

std::vector<Complex> fit_points(const std::vector<double>& p) {
  std::vector<Complex> points;
  const auto count = static_cast<Index>(p.size()) * kPointsEach + 12;
  for (const double omega : logarithmic_break_points(p.front() / kReach, p.back() * kReach, count)) {
    points.emplace_back(0.0L, static_cast<long double>(omega));
  }
  return points;
}

std::vector<Complex> functions(const std::vector<double>& p, Complex s) {
  std::vector<Complex> f;
  Complex h = 1.0L;
  for (const double each : p) {
    const Complex pole = s + static_cast<long double>(each);
    f.push_back(h * static_cast<long double>(each) / pole);
    h *= s / pole;
  }
  return f;
}

/// Ratio of the break points beyond which Eigen's iteration, which takes for zero what is below epsilon^2 of the norm,
/// would lose the slow poles in double precision.
constexpr double kWideRatio = 1e15;
/// A root is polished by steps below this share of its modulus.
constexpr long double kPolishRange = 1e-2L;
constexpr int kPolishSteps = 8;

template <class Real>
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& matrix) {
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::EigenSolver<Matrix> solver(Matrix(matrix.cast<Real>()), false);
  if (solver.info() != Eigen::Success) fail("localising basis: the eigenvalue iteration did not converge");
  return solver.eigenvalues().template cast<std::complex<double>>();
}

/// f = 1 + sum_k a_k F_k(s) and df/ds.
struct ValueAndSlope {
  Complex value = 1.0L;
  Complex slope = 0.0L;
};
ValueAndSlope denominator_at(const std::vector<double>& p, const Eigen::VectorXd& a, Complex s) {
  ValueAndSlope f;
  Complex h = 1.0L;
  Complex h_slope = 0.0L;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const auto point = static_cast<long double>(p[k]);
    const auto coefficient = static_cast<long double>(a[static_cast<Index>(k)]);
    const Complex low_pass = point / (s + point);
    const Complex low_pass_slope = -low_pass / (s + point);
    f.value += coefficient * h * low_pass;
    f.slope += coefficient * (h_slope * low_pass + h * low_pass_slope);
    // s / (s + p) = 1 - p / (s + p)
    h_slope = h_slope * (1.0L - low_pass) - h * low_pass_slope;
    h *= 1.0L - low_pass;
  }
  return f;
}

/// Newton's iteration from an eigenvalue, as long as |f| falls: f keeps the relative accuracy of slow roots beside fast
/// ones that an eigenvalue loses.
std::complex<double> polished(const std::vector<double>& p, const Eigen::VectorXd& a, std::complex<double> root) {
  Complex s(root);
  ValueAndSlope f = denominator_at(p, a, s);
  for (int k = 0; k < kPolishSteps; ++k) {
    const Complex step = f.value / f.slope;
    if (!(std::abs(step) <= kPolishRange * std::abs(s))) break;
    const ValueAndSlope next = denominator_at(p, a, s - step);
    if (!(std::abs(next.value) < std::abs(f.value))) break;
    s -= step;
    f = next;
  }
  return {static_cast<double>(s.real()), static_cast<double>(s.imag())};
}

}  // namespace

LocalisingBasis::LocalisingBasis(std::vector<double> break_points) : break_points_(std::move(break_points)) {
  if (break_points_.empty()) fail("break points: expected at least one");
  for (const double p : break_points_) {
    if (!(p > 0.0) || !std::isfinite(p)) fail("break points: expected positive numbers in rad/s, got ", p);
  }
  std::sort(break_points_.begin(), break_points_.end());
}

Eigen::VectorXd LocalisingBasis::input() const {
  return Eigen::Map<const Eigen::VectorXd>(break_points_.data(), size());
}

Eigen::VectorXcd LocalisingBasis::at(std::complex<double> s) const {
  Eigen::VectorXcd f(size());
  std::complex<double> h = 1.0;
  for (Index k = 0; k < size(); ++k) {
    const double p = break_points_[static_cast<std::size_t>(k)];
    f[k] = h * p / (s + p);
    h *= s / (s + p);
  }
  return f;
}

Eigen::VectorXd LocalisingBasis::coordinates(const std::function<Complex(Complex)>& f) const {
  const std::vector<Complex> points = fit_points(break_points_);
  const auto count = static_cast<Index>(points.size());
  Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic> rows(2 * count, size());
  Eigen::Matrix<long double, Eigen::Dynamic, 1> values(2 * count);
  for (Index i = 0; i < count; ++i) {
    const Complex s = points[static_cast<std::size_t>(i)];
    const std::vector<Complex> basis = functions(break_points_, s);
    for (Index k = 0; k < size(); ++k) {
      rows(2 * i, k) = basis[static_cast<std::size_t>(k)].real();
      rows(2 * i + 1, k) = basis[static_cast<std::size_t>(k)].imag();
    }
    const Complex value = f(s);
    values[2 * i] = value.real();
    values[2 * i + 1] = value.imag();
  }
  return rows.householderQr().solve(values).cast<double>();
}

Eigen::VectorXd LocalisingBasis::denominator_from_poles(const std::vector<std::complex<double>>& poles) const {
  if (std::ssize(poles) != size()) fail("break points: expected ", size(), " poles, one for each, got ", poles.size());
  double imaginary = 0.0;
  for (const std::complex<double>& pole : poles) imaginary += pole.imag() / (1e-300 + std::abs(pole));
  if (!(std::abs(imaginary) < 1e-9)) fail("break points: expected poles closed under conjugation");
  return coordinates([&](Complex s) {
    Complex ratio = 1.0L;
    for (std::size_t k = 0; k < poles.size(); ++k) {
      ratio *= (s - Complex(poles[k])) / (s + static_cast<long double>(break_points_[k]));
    }
    return ratio - 1.0L;
  });
}

Eigen::VectorXcd LocalisingBasis::poles(const Eigen::VectorXd& a) const {
  const Eigen::MatrixXd descending = matrix<double>(a).reverse();
  const bool wide = break_points_.back() > kWideRatio * break_points_.front();
  Eigen::VectorXcd roots = wide ? eigenvalues<long double>(descending) : eigenvalues<double>(descending);
  for (std::complex<double>& root : roots) root = polished(break_points_, a, root);
  return roots;
}

Eigen::MatrixXd LocalisingBasis::low_degree(Index m) const {
  if (m == size()) return Eigen::MatrixXd::Identity(m, m);
  Eigen::MatrixXd result(size(), m);
  for (Index k = 0; k < m; ++k) {
    result.col(k) = coordinates([&](Complex s) {
      Complex value = functions(break_points_, s)[static_cast<std::size_t>(k)];
      for (std::size_t l = static_cast<std::size_t>(m); l < break_points_.size(); ++l) {
        const auto p = static_cast<long double>(break_points_[l]);
        value *= p / (s + p);
      }
      return value;
    });
  }
  return result;
}

std::vector<double> logarithmic_break_points(double lower, double upper, Index count) {
  if (!(lower > 0.0) || !(upper >= lower) || !std::isfinite(upper)) {
    fail("break points: expected 0 < lower <= upper in rad/s, got ", lower, " and ", upper);
  }
  if (count < 1) fail("break points: expected at least one, got ", count);
  if (count == 1) return {std::sqrt(lower * upper)};
  std::vector<double> points;
  const double ratio = std::log(upper / lower) / static_cast<double>(count - 1);
  for (Index k = 0; k < count; ++k) points.push_back(lower * std::exp(ratio * static_cast<double>(k)));
  points.back() = upper;
  return points;
}

}  // namespace blockid
