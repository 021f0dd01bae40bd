#include <blockid/estimators/rational_basis.hpp>

#include <blockid/data/error.hpp>

#include <array>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr std::array<std::pair<BasisKind, const char*>, 5> kNames = {{{BasisKind::localising, "flbf"},
                                                                      {BasisKind::monomial, "monomial"},
                                                                      {BasisKind::chebyshev, "chebyshev"},
                                                                      {BasisKind::laguerre, "laguerre"},
                                                                      {BasisKind::kautz, "kautz"}}};

bool is_polynomial(BasisKind kind) { return kind == BasisKind::monomial || kind == BasisKind::chebyshev; }
bool is_orthonormal(BasisKind kind) { return kind == BasisKind::laguerre || kind == BasisKind::kautz; }

Index expected_points(const RationalBasis& basis) {
  if (basis.kind == BasisKind::localising) return basis.order;
  return basis.kind == BasisKind::kautz ? 2 : 1;
}

/// D = s^2 + b s + c of a Kautz basis.
struct Quadratic {
  double b;
  double c;
};
Quadratic kautz_quadratic(const RationalBasis& basis) {
  return {2.0 * basis.points[1] * basis.points[0], basis.points[0] * basis.points[0]};
}

/// (N, count) phi_1 .. phi_count of the break points p, and what is left: prod s / (s + p_l).
MatrixXcd localising_values(const VectorXd& p, Index count, const VectorXcd& s) {
  MatrixXcd values(s.size(), count);
  VectorXcd high_pass = VectorXcd::Ones(s.size());
  for (Index k = 0; k < count; ++k) {
    const Eigen::ArrayXcd denominator = s.array() + p[k];
    values.col(k) = high_pass.array() * p[k] / denominator;
    high_pass.array() *= s.array() / denominator;
  }
  return values;
}

BasisValues localising(const RationalBasis& basis, const VectorXcd& s) {
  const Index n = basis.order;
  const Index m = basis.numerator_degree;
  BasisValues values{VectorXcd::Ones(s.size()), localising_values(basis.points, n, s), MatrixXcd(s.size(), m + 1)};
  values.psi.leftCols(std::min(n, m + 1)) = values.phi.leftCols(std::min(n, m + 1));
  if (m == n) values.psi.col(n) = s.array() / (s.array() + basis.points[n - 1]);
  for (Index j = m + 1; j < n; ++j) {
    const VectorXcd low_pass = basis.points[j] / (s.array() + basis.points[j]);
    values.psi = low_pass.asDiagonal() * values.psi;
  }
  return values;
}

/// The first m + 1 of [phi, lead].
MatrixXcd leading_functions(const VectorXcd& lead, const MatrixXcd& phi, Index m) {
  MatrixXcd psi(phi.rows(), m + 1);
  psi.leftCols(std::min(phi.cols(), m + 1)) = phi.leftCols(std::min(phi.cols(), m + 1));
  if (m == phi.cols()) psi.col(m) = lead;
  return psi;
}

/// (N, n + 1) powers or Chebyshev polynomials of degree 0 .. n.
MatrixXcd polynomial_values(const RationalBasis& basis, const VectorXcd& s) {
  const Eigen::ArrayXcd z = s.array() / basis.points[0];
  MatrixXcd q = MatrixXcd::Ones(s.size(), basis.order + 1);
  q.col(1) = z;
  for (Index k = 2; k <= basis.order; ++k) {
    if (basis.kind == BasisKind::monomial) {
      q.col(k) = z * q.col(k - 1).array();
    } else {
      q.col(k) = 2.0 * z * q.col(k - 1).array() + q.col(k - 2).array();
    }
  }
  return q;
}

MatrixXcd laguerre_values(const RationalBasis& basis, const VectorXcd& s) {
  const double p = basis.points[0];
  MatrixXcd values(s.size(), basis.order);
  values.col(0) = std::sqrt(2.0 * p) / (s.array() + p);
  const Eigen::ArrayXcd all_pass = (s.array() - p) / (s.array() + p);
  for (Index k = 1; k < basis.order; ++k) values.col(k) = values.col(k - 1).array() * all_pass;
  return values;
}

MatrixXcd kautz_values(const RationalBasis& basis, const VectorXcd& s) {
  const auto [b, c] = kautz_quadratic(basis);
  MatrixXcd values(s.size(), basis.order);
  const Eigen::ArrayXcd denominator = s.array().square() + b * s.array() + c;
  const Eigen::ArrayXcd all_pass = (s.array().square() - b * s.array() + c) / denominator;
  Eigen::ArrayXcd passed = std::sqrt(2.0 * b) / denominator;
  for (Index k = 0; k < basis.order; k += 2) {
    values.col(k) = std::sqrt(c) * passed;
    values.col(k + 1) = s.array() * passed;
    passed *= all_pass;
  }
  return values;
}

FilterBank localising_bank(const VectorXd& p) {
  FilterBank bank{MatrixXd::Zero(p.size(), p.size()), p};
  for (Index k = 0; k < p.size(); ++k) bank.a.row(k).head(k + 1).setConstant(-p[k]);
  return bank;
}

FilterBank polynomial_bank(const RationalBasis& basis) {
  const Index n = basis.order;
  const double scale = basis.points[0];
  FilterBank bank{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  for (Index k = 0; k < n; ++k) {
    const bool halved = basis.kind == BasisKind::chebyshev && k > 0;
    const double rate = halved ? 0.5 * scale : scale;
    if (k + 1 < n) bank.a(k, k + 1) = rate;
    if (k + 1 == n) bank.b[k] = rate;
    if (halved) bank.a(k, k - 1) = -rate;
  }
  return bank;
}

FilterBank laguerre_bank(const RationalBasis& basis) {
  const Index n = basis.order;
  const double p = basis.points[0];
  FilterBank bank{MatrixXd::Zero(n, n), VectorXd::Constant(n, std::sqrt(2.0 * p))};
  for (Index k = 0; k < n; ++k) {
    bank.a.row(k).head(k).setConstant(-2.0 * p);
    bank.a(k, k) = -p;
  }
  return bank;
}

/// Each pair is driven by v less sqrt(2b) times the second states of all pairs before it.
FilterBank kautz_bank(const RationalBasis& basis) {
  const Index n = basis.order;
  const auto [b, c] = kautz_quadratic(basis);
  FilterBank bank{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  for (Index k = 0; k < n; k += 2) {
    bank.a(k, k + 1) = std::sqrt(c);
    bank.a(k + 1, k) = -std::sqrt(c);
    bank.a(k + 1, k + 1) = -b;
    for (Index before = 1; before < k; before += 2) bank.a(k + 1, before) = -2.0 * b;
    bank.b[k + 1] = std::sqrt(2.0 * b);
  }
  return bank;
}

/// f = sum_{k<=r} c_k phi_k becomes f p_(r+1) / (s + p_(r+1)), from c' A = p (c - c') and c' B = 0 in the filter bank.
VectorXd low_passed(const VectorXd& c, const VectorXd& p, Index r) {
  VectorXd result = VectorXd::Zero(c.size());
  double rest = 0.0;  // sum of c'_i p_i over i >= k
  for (Index k = 0; k < r; ++k) {
    result[k] = c[k] + rest / p[r];
    rest -= p[k] * result[k];
  }
  result[r] = rest / p[r];
  return result;
}

/// s / (s + p_n) = lead - sum_k c_k phi_k with c_k = prod_{l<k} (1 - p_l / p_n).
VectorXd direct_term(const VectorXd& p) {
  const Index n = p.size();
  VectorXd column = VectorXd::Zero(n + 1);
  double c = 1.0;
  for (Index k = 0; k < n; ++k) {
    column[k] = -c;
    c *= 1.0 - p[k] / p[n - 1];
  }
  column[n] = 1.0;
  return column;
}

/// q(z) (c0 + c1 z) in place, q of a degree that leaves room.
void multiply(VectorXd& q, double c0, double c1) {
  for (Index k = q.size() - 1; k > 0; --k) q[k] = c0 * q[k] + c1 * q[k - 1];
  q[0] *= c0;
}
void multiply(VectorXd& q, double c0, double c1, double c2) {
  for (Index k = q.size() - 1; k >= 0; --k) {
    q[k] = c0 * q[k] + (k > 0 ? c1 * q[k - 1] : 0.0) + (k > 1 ? c2 * q[k - 2] : 0.0);
  }
}

VectorXd constant(Index size, double value) {
  VectorXd q = VectorXd::Zero(size);
  q[0] = value;
  return q;
}

BasisPolynomials localising_polynomials(const RationalBasis& basis, double scale) {
  const Index n = basis.order;
  const Index m = basis.numerator_degree;
  const VectorXd p = basis.points / scale;
  // phi_k E' with E' = prod_{l < count} (z + p_l).
  const auto function = [&](Index k, Index count) {
    VectorXd q = constant(n + 1, p[k]);
    for (Index l = 0; l < k; ++l) multiply(q, 0.0, 1.0);
    for (Index l = k + 1; l < count; ++l) multiply(q, p[l], 1.0);
    return q;
  };
  BasisPolynomials result{constant(n + 1, 1.0), MatrixXd(n + 1, n), MatrixXd(n + 1, m + 1)};
  for (Index l = 0; l < n; ++l) multiply(result.lead, p[l], 1.0);
  for (Index k = 0; k < n; ++k) result.phi.col(k) = function(k, n);
  if (m == n) {
    VectorXd direct = constant(n + 1, 1.0);
    multiply(direct, 0.0, 1.0);
    for (Index l = 0; l + 1 < n; ++l) multiply(direct, p[l], 1.0);
    result.psi << result.phi, direct;
    return result;
  }
  for (Index k = 0; k <= m; ++k) result.psi.col(k) = function(k, m + 1) * p.tail(n - m - 1).prod();
  return result;
}

BasisPolynomials orthonormal_polynomials(const RationalBasis& basis, double scale) {
  const Index n = basis.order;
  BasisPolynomials result{constant(n + 1, 1.0), MatrixXd(n + 1, n), {}};
  if (basis.kind == BasisKind::laguerre) {
    const double p = basis.points[0] / scale;
    for (Index k = 0; k < n; ++k) multiply(result.lead, p, 1.0);
    for (Index k = 0; k < n; ++k) {
      VectorXd q = constant(n + 1, std::sqrt(2.0 * basis.points[0]) / scale);
      for (Index l = 0; l < k; ++l) multiply(q, -p, 1.0);
      for (Index l = k + 1; l < n; ++l) multiply(q, p, 1.0);
      result.phi.col(k) = q;
    }
    return result;
  }
  const auto [b, c] = kautz_quadratic(basis);
  const double b1 = b / scale;
  const double c1 = c / (scale * scale);
  for (Index k = 0; k < n; k += 2) multiply(result.lead, c1, b1, 1.0);
  for (Index k = 0; k < n; k += 2) {
    VectorXd q = constant(n + 1, std::sqrt(2.0 * b));
    for (Index l = 0; l < k; l += 2) multiply(q, c1, -b1, 1.0);
    for (Index l = k + 2; l < n; l += 2) multiply(q, c1, b1, 1.0);
    result.phi.col(k) = q * (std::sqrt(c) / (scale * scale));
    multiply(q, 0.0, 1.0 / scale);
    result.phi.col(k + 1) = q;
  }
  return result;
}

BasisPolynomials polynomial_polynomials(const RationalBasis& basis, double scale) {
  const Index n = basis.order;
  const double ratio = scale / basis.points[0];
  MatrixXd q = MatrixXd::Zero(n + 1, n + 1);
  q(0, 0) = 1.0;
  q(1, 1) = ratio;
  for (Index k = 2; k <= n; ++k) {
    const double factor = basis.kind == BasisKind::chebyshev ? 2.0 * ratio : ratio;
    q.col(k).tail(n) = factor * q.col(k - 1).head(n);
    if (basis.kind == BasisKind::chebyshev) q.col(k) += q.col(k - 2);
  }
  return {q.col(n), q.leftCols(n), {}};
}

}  // namespace

std::string to_text(BasisKind kind) {
  for (const auto& [entry, name] : kNames) {
    if (entry == kind) return name;
  }
  return "unknown";
}

BasisKind basis_kind(const std::string& name) {
  std::string names;
  for (const auto& [kind, entry] : kNames) {
    if (name == entry) return kind;
    names += (names.empty() ? "" : ", ") + std::string(entry);
  }
  fail("rational basis: unknown kind '", name, "', expected one of ", names);
}

void check(const RationalBasis& basis) {
  const Index n = basis.order;
  const Index m = basis.numerator_degree;
  if (n < 1) fail("rational basis: expected an order of at least 1, got ", n);
  if (m < 0 || m > n) fail("rational basis: expected a numerator of degree 0 .. ", n, " (the order), got ", m);
  if (is_orthonormal(basis.kind) && m < n - 1) {
    fail("rational basis: ", to_text(basis.kind), " functions of order ", n, " have numerators of degree ", n - 1,
         " or ", n, ", got ", m);
  }
  if (basis.kind == BasisKind::kautz && n % 2 != 0) {
    fail("rational basis: kautz functions come in pairs, expected an even order, got ", n);
  }
  if (basis.points.size() != expected_points(basis)) {
    fail("rational basis: expected ", expected_points(basis), " points for ", to_text(basis.kind), " of order ", n,
         ", got ", basis.points.size());
  }
  for (Index k = 0; k < basis.points.size(); ++k) {
    if (!std::isfinite(basis.points[k]) || basis.points[k] <= 0) {
      fail("rational basis: point at index ", k, " is ", basis.points[k], ", expected finite and positive");
    }
    if (basis.kind == BasisKind::localising && k > 0 && basis.points[k] < basis.points[k - 1]) {
      fail("rational basis: break point at index ", k, " is ", basis.points[k],
           " rad/s, expected not below its predecessor ", basis.points[k - 1]);
    }
  }
  if (basis.kind == BasisKind::kautz && basis.points[1] >= 1.0) {
    fail("rational basis: expected a damping ratio below 1, got ", basis.points[1]);
  }
}

RationalBasis localising_basis(const VectorXd& break_points_rad_s, Index numerator_degree) {
  RationalBasis basis{BasisKind::localising, break_points_rad_s.size(), numerator_degree, break_points_rad_s};
  check(basis);
  return basis;
}

RationalBasis monomial_basis(Index order, Index numerator_degree, double scale_rad_s) {
  RationalBasis basis{BasisKind::monomial, order, numerator_degree, VectorXd::Constant(1, scale_rad_s)};
  check(basis);
  return basis;
}

RationalBasis chebyshev_basis(Index order, Index numerator_degree, double scale_rad_s) {
  RationalBasis basis{BasisKind::chebyshev, order, numerator_degree, VectorXd::Constant(1, scale_rad_s)};
  check(basis);
  return basis;
}

RationalBasis laguerre_basis(Index order, Index numerator_degree, double pole_rad_s) {
  RationalBasis basis{BasisKind::laguerre, order, numerator_degree, VectorXd::Constant(1, pole_rad_s)};
  check(basis);
  return basis;
}

RationalBasis kautz_basis(Index order, Index numerator_degree, double frequency_rad_s, double damping) {
  RationalBasis basis{BasisKind::kautz, order, numerator_degree, Eigen::Vector2d(frequency_rad_s, damping)};
  check(basis);
  return basis;
}

VectorXd break_points(double low_rad_s, double high_rad_s, Index count) {
  if (!(low_rad_s > 0.0) || !(high_rad_s >= low_rad_s) || !std::isfinite(high_rad_s)) {
    fail("break points: expected 0 < low <= high, got ", low_rad_s, " and ", high_rad_s, " rad/s");
  }
  if (count < 1) fail("break points: expected at least one, got ", count);
  if (count == 1) return VectorXd::Constant(1, geometric_mean(low_rad_s, high_rad_s));
  const double low = std::log10(low_rad_s);
  const double step = (std::log10(high_rad_s) - low) / static_cast<double>(count - 1);
  return VectorXd::NullaryExpr(count, [&](Index k) { return std::pow(10.0, low + step * static_cast<double>(k)); });
}

double geometric_mean(double low_rad_s, double high_rad_s) { return std::sqrt(low_rad_s) * std::sqrt(high_rad_s); }

BasisValues evaluate(const RationalBasis& basis, const VectorXcd& s) {
  check(basis);
  const Index n = basis.order;
  if (basis.kind == BasisKind::localising) return localising(basis, s);
  BasisValues values;
  if (is_polynomial(basis.kind)) {
    const MatrixXcd q = polynomial_values(basis, s);
    values.lead = q.col(n);
    values.phi = q.leftCols(n);
  } else {
    values.lead = VectorXcd::Ones(s.size());
    values.phi = basis.kind == BasisKind::laguerre ? laguerre_values(basis, s) : kautz_values(basis, s);
  }
  values.psi = leading_functions(values.lead, values.phi, basis.numerator_degree);
  return values;
}

BasisValues evaluate(const RationalBasis& basis, const VectorXd& omega_rad_s) {
  return evaluate(basis, VectorXcd(omega_rad_s.cast<Complex>() * Complex(0.0, 1.0)));
}

FilterBank filter_bank(const RationalBasis& basis) {
  check(basis);
  switch (basis.kind) {
    case BasisKind::localising:
      return localising_bank(basis.points);
    case BasisKind::laguerre:
      return laguerre_bank(basis);
    case BasisKind::kautz:
      return kautz_bank(basis);
    case BasisKind::monomial:
    case BasisKind::chebyshev:
      break;
  }
  return polynomial_bank(basis);
}

MatrixXd numerator_map(const RationalBasis& basis) {
  check(basis);
  const Index n = basis.order;
  const Index m = basis.numerator_degree;
  MatrixXd map = MatrixXd::Identity(n + 1, m + 1);
  if (basis.kind != BasisKind::localising) return map;
  if (m == n) map.col(n) = direct_term(basis.points);
  for (Index r = m + 1; r < n; ++r) {
    for (Index j = 0; j <= m; ++j) map.col(j).head(n) = low_passed(map.col(j).head(n), basis.points, r);
  }
  return map;
}

BasisPolynomials polynomials(const RationalBasis& basis, double scale_rad_s) {
  check(basis);
  if (basis.kind == BasisKind::localising) return localising_polynomials(basis, scale_rad_s);
  BasisPolynomials result = is_polynomial(basis.kind) ? polynomial_polynomials(basis, scale_rad_s)
                                                      : orthonormal_polynomials(basis, scale_rad_s);
  MatrixXd all(basis.order + 1, basis.order + 1);
  all << result.phi, result.lead;
  result.psi = all.leftCols(basis.numerator_degree + 1);
  return result;
}

}  // namespace blockid
