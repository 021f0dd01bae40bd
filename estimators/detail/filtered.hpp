// Polynomials in q^-1 acting on whole signals.
#pragma once

#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/rational.hpp>

#include <Eigen/Core>
#include <span>

namespace blockid::detail {

/// (N,) B/A x from rest, b and a in ascending powers of q^-1, a_0 = 1.
inline Eigen::VectorXd filtered(const Eigen::VectorXd& b, const Eigen::VectorXd& a, const Eigen::VectorXd& x) {
  const Rational filter(b.size() - 1, a.size() - 1);
  Eigen::VectorXd theta(filter.parameter_count());
  theta << b, a.tail(a.size() - 1);
  Eigen::VectorXd state = Eigen::VectorXd::Zero(filter.state_count());
  Eigen::VectorXd y(x.size());
  filter.apply<double>(view(theta), view(state), view(x), view(y));
  return y;
}

/// Coefficients of the product of two polynomials.
inline Eigen::VectorXd convolved(const Eigen::VectorXd& p, const Eigen::VectorXd& q) {
  Eigen::VectorXd product = Eigen::VectorXd::Zero(p.size() + q.size() - 1);
  for (Index k = 0; k < p.size(); ++k) product.segment(k, q.size()) += p[k] * q;
  return product;
}

}  // namespace blockid::detail
