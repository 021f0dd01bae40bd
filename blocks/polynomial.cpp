#include <blockid/blocks/polynomial.hpp>

#include <blockid/blocks/detail/format.hpp>
#include <blockid/blocks/detail/kernels.hpp>
#include <blockid/blocks/detail/signal_range.hpp>
#include <blockid/data/error.hpp>

#include <Eigen/QR>
#include <cmath>

namespace blockid {
namespace {

/// Chebyshev series of x times a Chebyshev series: 2 x T_k = T_{k+1} + T_{k-1}.
Eigen::VectorXd times_x(const Eigen::VectorXd& c) {
  const Index n = c.size();
  Eigen::VectorXd result = Eigen::VectorXd::Zero(n);
  for (Index k = 0; k < n; ++k) {
    if (k == 0) {
      if (n > 1) result[1] += c[0];
    } else {
      if (k + 1 < n) result[k + 1] += 0.5 * c[k];
      result[k - 1] += 0.5 * c[k];
    }
  }
  return result;
}

}  // namespace

Polynomial::Polynomial(Index degree) : Polynomial(degree, SignalRange{}) { range_given_ = false; }

Polynomial::Polynomial(Index degree, SignalRange range)
    : degree_(degree),
      range_(range),
      range_given_(true),
      scale_(2.0 / (range.upper - range.lower)),
      shift_(-(range.upper + range.lower) / (range.upper - range.lower)) {
  if (degree < 0 || degree > kMaxDegree) {
    fail("polynomial: degree must lie in 0..", kMaxDegree, ", got ", degree);
  }
  detail::check_range(range, "polynomial");
}

Arguments Polynomial::arguments() const {
  Arguments result = {{"degree", std::to_string(degree_)}};
  if (range_given_) result.emplace_back("range", detail::list_text({range_.lower, range_.upper}));
  return result;
}

std::vector<std::string> Polynomial::parameter_names() const {
  std::vector<std::string> names;
  for (Index k = 0; k <= degree_; ++k) names.push_back("c" + std::to_string(k));
  return names;
}

Eigen::VectorXd Polynomial::initial_parameters() const {
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(degree_ + 1);
  theta[0] = 0.5 * (range_.upper + range_.lower);
  if (degree_ > 0) theta[1] = 0.5 * (range_.upper - range_.lower);
  return theta;
}

void Polynomial::detail_apply(std::span<const double> theta, std::span<const double> u, std::span<double> y) const {
  detail::kernels().chebyshev(theta.data(), degree_, scale_, shift_, u.data(), y.data(), std::ssize(u));
}

void Polynomial::push_forward(std::span<const double> theta, std::span<double>, std::span<double>,
                              std::span<const double> u, std::span<double> y, const Tangents& tangents,
                              OwnColumns) const {
  detail::kernels().chebyshev_tangents(theta.data(), degree_, scale_, shift_, u.data(), y.data(), tangents.rows,
                                       tangents.data, tangents.stride, tangents.upstream);
}

Polynomial Polynomial::adapted_to(std::span<const double> v) const {
  return range_given_ ? *this : Polynomial(degree_, detail::range_of(v, "polynomial"));
}

Rescaled Polynomial::with_scaled_input(std::span<const double> theta, double k) const {
  const double a = k * range_.lower;
  const double b = k * range_.upper;
  Eigen::VectorXd c = Eigen::Map<const Eigen::VectorXd>(theta.data(), degree_ + 1);
  if (k < 0.0) {
    for (Index j = 1; j <= degree_; j += 2) c[j] = -c[j];
  }
  return {Polynomial(degree_, {std::min(a, b), std::max(a, b)}), c};
}

Rescaled Polynomial::with_scaled_output(std::span<const double> theta, double k) const {
  return {*this, k * Eigen::Map<const Eigen::VectorXd>(theta.data(), degree_ + 1)};
}

Eigen::VectorXd Polynomial::from_powers(const Eigen::VectorXd& powers) const {
  if (powers.size() != degree_ + 1) {
    fail("polynomial: expected ", degree_ + 1, " powers for degree ", degree_, ", got ", powers.size());
  }
  // Horner in the basis: p = (...(p_d u + p_{d-1}) u + ...) with u = (x - shift) / scale.
  Eigen::VectorXd c = Eigen::VectorXd::Zero(degree_ + 1);
  for (Index k = degree_; k >= 0; --k) {
    c = (times_x(c) - shift_ * c) / scale_;
    c[0] += powers[k];
  }
  return c;
}

Eigen::VectorXd Polynomial::to_powers(const Eigen::VectorXd& theta) const {
  Eigen::MatrixXd basis(degree_ + 1, degree_ + 1);
  for (Index k = 0; k <= degree_; ++k) basis.col(k) = from_powers(Eigen::VectorXd::Unit(degree_ + 1, k));
  return basis.colPivHouseholderQr().solve(theta);
}

}  // namespace blockid
