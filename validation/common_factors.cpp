#include <blockid/validation/common_factors.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/tail_probability.hpp>
#include <blockid/validation/coprime_factors.hpp>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Root = std::complex<double>;

/// Imaginary parts below this are rounding.
constexpr double kReal = 1e-8;
/// Standard deviations within which a last coefficient counts as zero.
constexpr double kNearZero = 2.0;

/// A root and its derivatives by all coefficients of the filter.
struct MovingRoot {
  Root root;
  VectorXcd slope;
};

/// Roots of c_0 z^n + ... + c_n, whose coefficients c_from .. c_n have the places first, first + 1, ...
std::vector<MovingRoot> moving_roots(const VectorXd& c, Index from, Index first, Index places) {
  const Index n = c.size() - 1;
  std::vector<MovingRoot> result;
  if (c.size() < 2 || c[0] == 0.0) return result;
  for (const Root& z : polynomial_roots(c)) {
    Root derivative = 0.0;
    for (Index k = 0; k < n; ++k) derivative = derivative * z + static_cast<double>(n - k) * c[k];
    if (std::abs(z) < kReal || std::abs(derivative) == 0.0) continue;
    MovingRoot moving{z, VectorXcd::Zero(places)};
    for (Index k = from; k <= n; ++k) {
      moving.slope[first + k - from] = -std::pow(z, static_cast<double>(n - k)) / derivative;
    }
    result.push_back(std::move(moving));
  }
  return result;
}

bool real(const MovingRoot& root) { return std::abs(root.root.imag()) <= kReal * std::abs(root.root); }

/// A real root, or two that are roots of one real polynomial, as sum and product with their derivatives.
struct RealFactor {
  std::vector<Index> roots;
  VectorXd value;
  MatrixXd slope;  // (1 or 2, places)
};

std::vector<RealFactor> real_factors(const std::vector<MovingRoot>& roots) {
  std::vector<RealFactor> factors;
  const auto count = static_cast<Index>(roots.size());
  for (Index i = 0; i < count; ++i) {
    const MovingRoot& one = roots[static_cast<std::size_t>(i)];
    if (real(one)) factors.push_back({{i}, VectorXd::Constant(1, one.root.real()), one.slope.real().transpose()});
    for (Index j = i + 1; j < count; ++j) {
      const MovingRoot& other = roots[static_cast<std::size_t>(j)];
      const bool conjugate = std::abs(one.root - std::conj(other.root)) <= kReal * std::abs(one.root);
      if (!conjugate && !(real(one) && real(other))) continue;
      RealFactor factor{{i, j}, VectorXd(2), MatrixXd(2, one.slope.size())};
      factor.value << (one.root + other.root).real(), (one.root * other.root).real();
      factor.slope.row(0) = (one.slope + other.slope).real().transpose();
      factor.slope.row(1) = (other.root * one.slope + one.root * other.slope).real().transpose();
      factors.push_back(std::move(factor));
    }
  }
  return factors;
}

/// A pair of factors with places of their roots.
struct Candidate {
  CommonFactor common;
  std::vector<Index> zeros;
  std::vector<Index> poles;
};

std::vector<Root> values_at(const std::vector<MovingRoot>& roots, const std::vector<Index>& places) {
  std::vector<Root> values;
  for (const Index k : places) values.push_back(roots[static_cast<std::size_t>(k)].root);
  return values;
}

/// The statistic; negative where it has no meaning.
double wald(const RealFactor& zero, const RealFactor& pole, const MatrixXd& covariance) {
  const VectorXd difference = zero.value - pole.value;
  const MatrixXd slope = zero.slope - pole.slope;
  const MatrixXd variance = slope * covariance * slope.transpose();
  const Eigen::FullPivLU<MatrixXd> factors(variance);
  if (!variance.allFinite() || !factors.isInvertible()) return -1.0;
  return difference.dot(factors.solve(difference));
}

bool overlap(const std::vector<Index>& a, const std::vector<Index>& b) {
  return std::any_of(a.begin(), a.end(), [&](Index k) { return std::find(b.begin(), b.end(), k) != b.end(); });
}

void check_filter(const EstimatedFilter& filter) {
  const Index places = filter.numerator.size() + filter.denominator.size() - 1;
  if (filter.numerator.size() < 1 || filter.denominator.size() < 1 || filter.covariance.rows() != places ||
      filter.covariance.cols() != places) {
    fail("common factors: expected a covariance of ", places, " coefficients, got ", filter.covariance.rows(), " x ",
         filter.covariance.cols());
  }
}

}  // namespace

std::vector<CommonFactor> common_factors(const EstimatedFilter& filter, double significance) {
  check_filter(filter);
  const Index places = filter.covariance.rows();
  const std::vector<MovingRoot> zeros = moving_roots(filter.numerator, 0, 0, places);
  const std::vector<MovingRoot> poles = moving_roots(filter.denominator, 1, filter.numerator.size(), places);
  std::vector<Candidate> candidates;
  for (const RealFactor& zero : real_factors(zeros)) {
    for (const RealFactor& pole : real_factors(poles)) {
      if (zero.value.size() != pole.value.size()) continue;
      const double statistic = wald(zero, pole, filter.covariance);
      if (!(statistic >= 0.0)) continue;
      const double p_value = chi_square_tail(statistic, static_cast<double>(zero.value.size()));
      if (p_value < significance) continue;
      candidates.push_back(
          {{values_at(zeros, zero.roots), values_at(poles, pole.roots), statistic, p_value}, zero.roots, pole.roots});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.common.p_value > b.common.p_value; });
  std::vector<Candidate> kept;
  std::vector<CommonFactor> result;
  for (const Candidate& candidate : candidates) {
    const bool used = std::any_of(kept.begin(), kept.end(), [&](const Candidate& other) {
      return overlap(candidate.zeros, other.zeros) || overlap(candidate.poles, other.poles);
    });
    if (used) continue;
    kept.push_back(candidate);
    result.push_back(candidate.common);
  }
  return result;
}

std::vector<std::string> vanishing_coefficients(const EstimatedFilter& filter) {
  check_filter(filter);
  std::vector<std::string> names;
  const auto add = [&](double value, Index place, const char* letter, Index degree) {
    const double deviation = std::sqrt(filter.covariance(place, place));
    if (deviation > 0.0 && std::abs(value) < kNearZero * deviation) names.push_back(letter + std::to_string(degree));
  };
  const Index nb = filter.numerator.size() - 1;
  const Index na = filter.denominator.size() - 1;
  if (nb > 0) add(filter.numerator[nb], nb, "b", nb);
  if (na > 0) add(filter.denominator[na], nb + na, "a", na);
  return names;
}

}  // namespace blockid
