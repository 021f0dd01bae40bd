// Linear systems with coloured noise, simulated by plain loops.
#pragma once

#include "support/signals.hpp"

#include <blockid/data/record.hpp>
#include <blockid/estimators/polynomial_model.hpp>

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>

namespace blockid::testing {

inline PolynomialModel polynomial_model(const PolynomialOrders& orders, std::initializer_list<double> theta,
                                        double noise_variance) {
  PolynomialModel model{.orders = orders,
                        .theta = Eigen::Map<const Eigen::VectorXd>(theta.begin(), static_cast<Index>(theta.size())),
                        .noise_variance = noise_variance};
  check(model);
  return model;
}

inline PolynomialModel arx_system() {
  return polynomial_model({.na = 2, .nb = 1, .nk = 1}, {-1.3, 0.6, 1.0, 0.5}, 0.25);
}

inline PolynomialModel armax_system() {
  return polynomial_model({.na = 2, .nb = 1, .nc = 2, .nk = 1}, {-1.3, 0.6, 1.0, 0.5, -0.5, 0.3}, 0.25);
}

inline PolynomialModel output_error_system() {
  return polynomial_model({.nb = 1, .nf = 2, .nk = 2}, {1.0, 0.5, -1.4, 0.7}, 0.25);
}

// All degrees differ, so that no two polynomials can be exchanged unnoticed.
inline PolynomialModel box_jenkins_system() {
  return polynomial_model({.nb = 3, .nc = 1, .nd = 2, .nf = 2, .nk = 1},
                          {1.0, 0.5, -0.2, 0.1, 0.6, -1.2, 0.5, -1.4, 0.7}, 0.25);
}

struct SimulatedPolynomial {
  Record record;
  // (N,) the innovations.
  Eigen::VectorXd e;
};

// A y = q^-nk B/F u + C/D e from rest, sample by sample.
inline SimulatedPolynomial simulated(const PolynomialModel& model, const Eigen::VectorXd& u, const Eigen::VectorXd& e) {
  const auto& [na, nb, nc, nd, nf, nk] = model.orders;
  const double* a = model.theta.data() - 1;
  const double* b = a + na + 1;
  const double* c = b + nb;
  const double* d = c + nc;
  const double* f = d + nd;
  const Index length = u.size();
  Eigen::VectorXd w = Eigen::VectorXd::Zero(length);
  Eigen::VectorXd v = e;
  SimulatedPolynomial result;
  result.e = e;
  result.record.u = u;
  result.record.sample_time_s = model.sample_time_s;
  Eigen::VectorXd& y = result.record.y;
  y.resize(length);
  for (Index t = 0; t < length; ++t) {
    for (Index k = 0; k <= nb && k + nk <= t; ++k) w[t] += b[k] * (u[t - nk - k] - model.u_mean);
    for (Index k = 1; k <= nf && k <= t; ++k) w[t] -= f[k] * w[t - k];
    for (Index k = 1; k <= nc && k <= t; ++k) v[t] += c[k] * e[t - k];
    for (Index k = 1; k <= nd && k <= t; ++k) v[t] -= d[k] * v[t - k];
    y[t] = w[t] + v[t];
    for (Index k = 1; k <= na && k <= t; ++k) y[t] -= a[k] * (y[t - k] - model.y_mean);
    y[t] += model.y_mean;
  }
  return result;
}

// White Gaussian input of unit deviation; `settle` samples before the record are simulated and cut off.
inline SimulatedPolynomial simulated(const PolynomialModel& model, Index samples, std::uint64_t seed,
                                     Index settle = 0) {
  Noise numbers(seed);
  const Eigen::VectorXd u = numbers.white(samples + settle).array() + model.u_mean;
  const Eigen::VectorXd e = numbers.white(samples + settle, std::sqrt(model.noise_variance));
  SimulatedPolynomial whole = simulated(model, u, e);
  if (settle > 0) whole.record = slice(whole.record, settle, samples + settle);
  whole.e = e.tail(samples);
  return whole;
}

}  // namespace blockid::testing
