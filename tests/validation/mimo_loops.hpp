// Loops with several inputs and outputs, and uncertainties of known norm.
#pragma once

#include "crowder_loop.hpp"

#include <blockid/validation/mimo_loop.hpp>

#include <Eigen/LU>
#include <Eigen/QR>
#include <array>
#include <string>

namespace blockid::testing {

inline Eigen::MatrixXd normal_matrix(Eigen::Index rows, Eigen::Index columns, std::uint32_t seed) {
  return normal_reference(rows * columns, seed).reshaped(rows, columns);
}

inline Eigen::MatrixXd orthogonal(Eigen::Index size, std::uint32_t seed) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(normal_matrix(size, size, seed)).householderQ();
}

inline DiscreteTransferFunction first_order(double gain, double pole) {
  return {polynomial({0.0, gain}), polynomial({1.0, -pole})};
}

/// Two inputs and outputs, stable, under integral control of both outputs: C = 0.1 P(1)^-1 / (1 - q^-1).
inline MimoLoop integral_loop() {
  MimoLoop loop;
  loop.plant = transfer_matrix(
      {{first_order(0.3, 0.6), first_order(0.1, 0.8)}, {first_order(-0.2, 0.7), first_order(0.5, 0.5)}});
  const DiscreteStateSpace& g = loop.plant;
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(g.states(), g.states());
  const Eigen::MatrixXd rest = g.c * (identity - g.a).inverse() * g.b + g.d;
  const Eigen::MatrixXd gain = 0.1 * rest.inverse();
  const Eigen::MatrixXd two = Eigen::MatrixXd::Identity(2, 2);
  loop.controller = {two, two, gain, gain};
  // Upper triangular, each channel lead or lag over its own constant.
  loop.weight = {0.4 * two, two, Eigen::MatrixXd{{-0.06, 0.0}, {0.0, 0.08}}, Eigen::MatrixXd{{0.3, 0.1}, {0.0, 0.4}}};
  loop.factor_pole = 0.8;
  return loop;
}

/// Three inputs and two outputs: a double integrator, a pair outside the circle and a stable mode, under feedback of an
/// observer's states: its loop has the eigenvalues of A + B F and A + L C.
inline MimoLoop observer_loop() {
  MimoLoop loop;
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(5, 5);
  modes.topLeftCorner(2, 2) << 1.0, 1.0, 0.0, 1.0;
  modes.block(2, 2, 2, 2) << 1.02, 0.2, -0.2, 1.02;
  modes(4, 4) = 0.5;
  const Eigen::MatrixXd turn = orthogonal(5, 21);
  const Eigen::MatrixXd a = turn * modes * turn.transpose();
  const Eigen::MatrixXd b = normal_matrix(5, 3, 22);
  const Eigen::MatrixXd c = normal_matrix(2, 5, 23);
  loop.plant = {a, b, c, Eigen::MatrixXd::Zero(2, 3)};
  const Eigen::MatrixXd f = stabilising_feedback(a, b, 0.4);
  const Eigen::MatrixXd l = stabilising_feedback(a.transpose(), c.transpose(), 0.3).transpose();
  loop.controller = {a + b * f + l * c, l, f, Eigen::MatrixXd::Zero(3, 2)};
  loop.weight = static_gain(0.2 * orthogonal(3, 24));
  loop.factor_pole = 0.5;
  return loop;
}

/// One input and two outputs: an integrator and a lag, under feedback of an observer's states. T_v is singular here.
inline MimoLoop tall_loop() {
  MimoLoop loop;
  loop.plant = transfer_matrix({{first_order(0.5, 1.0)}, {first_order(0.3, 0.7)}});
  const DiscreteStateSpace& g = loop.plant;
  const Eigen::MatrixXd f = stabilising_feedback(g.a, g.b, 0.6);
  const Eigen::MatrixXd l = stabilising_feedback(g.a.transpose(), g.c.transpose(), 0.5).transpose();
  loop.controller = {g.a + g.b * f + l * g.c, l, f, Eigen::MatrixXd::Zero(1, 2)};
  loop.weight = state_space({polynomial({0.3, -0.1}), polynomial({1.0, -0.5})});
  loop.factor_pole = 0.7;
  return loop;
}

/// Name of the loop among the three above, in the order in which they stand.
inline std::string loop_name(std::size_t index) {
  constexpr std::array<const char*, 3> kNames = {"Integral", "Observer", "Tall"};
  return kNames.at(index);
}

/// norm U diag((q - a) / (1 - a q), ...) W' with parts U (p, k) and W (m, k) of orthogonal matrices, k = min(p, m), q
/// the delay: the gain `norm` in k directions at all frequencies.
inline DiscreteStateSpace all_pass_uncertainty(Eigen::Index outputs, Eigen::Index inputs, double norm,
                                               std::uint32_t seed) {
  const Eigen::Index k = std::min(outputs, inputs);
  DiscreteStateSpace s = static_gain(Eigen::MatrixXd::Zero(k, k));
  s.a = Eigen::MatrixXd::Zero(k, k);
  s.b = s.c = Eigen::MatrixXd::Identity(k, k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const double pole = 0.5 - 0.3 * static_cast<double>(i);
    s.a(i, i) = pole;
    s.d(i, i) = -pole;
    s.c(i, i) = 1.0 - pole * pole;
  }
  const Eigen::MatrixXd left = norm * orthogonal(outputs, seed).leftCols(k);
  const Eigen::MatrixXd right = orthogonal(inputs, seed + 1).leftCols(k).transpose();
  return {s.a, s.b * right, left * s.c, left * s.d * right};
}

}  // namespace blockid::testing
