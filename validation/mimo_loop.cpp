#include <blockid/validation/mimo_loop.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/detail/stable_radius.hpp>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace blockid {
namespace {

using detail::kStableRadius;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Least singular value of a direct term, in units of the largest, that can be inverted.
constexpr double kRegular = 1e-12;

bool is_regular(const MatrixXd& d) {
  const VectorXd sigma = d.jacobiSvd().singularValues();
  return sigma.tail(1)[0] > kRegular * sigma[0];
}

void check_sizes(Index rows, Index columns, const MatrixXd& got, const char* what) {
  if (got.rows() != rows || got.cols() != columns) {
    fail(what, ": expected ", rows, " channels of ", columns, " samples, got ", got.rows(), " of ", got.cols());
  }
}

MatrixXd diagonal(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd both = MatrixXd::Zero(a.rows() + b.rows(), a.cols() + b.cols());
  both.topLeftCorner(a.rows(), a.cols()) = a;
  both.bottomRightCorner(b.rows(), b.cols()) = b;
  return both;
}

MatrixXd stacked(const MatrixXd& above, const MatrixXd& below) {
  MatrixXd both(above.rows() + below.rows(), above.cols());
  both << above, below;
  return both;
}

/// G^-1 for a regular direct term: its poles are the zeros of G.
DiscreteStateSpace inverse(const DiscreteStateSpace& s) {
  const MatrixXd d = s.d.inverse();
  return {s.a - s.b * d * s.c, s.b * d, -d * s.c, d};
}

/// [Dhat, -Nc; Nhat, Dc] from (x, w) to (u, y).
DiscreteStateSpace loop_matrix(const MimoLoop& loop) {
  const DiscreteStateSpace& g = loop.plant;
  const DiscreteStateSpace& c = loop.controller;
  const MatrixXd f = stabilising_feedback(g.a, g.b, loop.factor_pole);
  const MatrixXd fc = stabilising_feedback(c.a, c.b, loop.factor_pole);
  const Index m = g.inputs();
  const Index p = g.outputs();
  DiscreteStateSpace s;
  s.a = diagonal(g.a + g.b * f, c.a + c.b * fc);
  s.b = diagonal(g.b, c.b);
  s.c.resize(m + p, g.states() + c.states());
  s.c << f, -(c.c + c.d * fc), g.c + g.d * f, fc;
  s.d.resize(m + p, m + p);
  s.d << MatrixXd::Identity(m, m), -c.d, g.d, MatrixXd::Identity(p, p);
  return s;
}

void check_loop_sizes(const MimoLoop& loop) {
  check(loop.plant, "plant");
  check(loop.controller, "controller");
  check(loop.weight, "weight");
  const Index m = loop.plant.inputs();
  const Index p = loop.plant.outputs();
  if (loop.controller.inputs() != p || loop.controller.outputs() != m) {
    fail("controller: expected ", p, " inputs and ", m, " outputs for a plant of ", m, " inputs and ", p,
         " outputs, got ", loop.controller.inputs(), " and ", loop.controller.outputs());
  }
  if (loop.weight.inputs() != m || loop.weight.outputs() != m) {
    fail("weight: expected ", m, " inputs and outputs, as the plant has inputs, got ", loop.weight.inputs(), " and ",
         loop.weight.outputs());
  }
}

void check_weight(const DiscreteStateSpace& weight) {
  if (!is_regular(weight.d)) fail("weight: expected a regular direct term (biproper), got a singular one");
  const double zero = spectral_radius(inverse(weight));
  const double pole = spectral_radius(weight);
  if (zero >= kStableRadius) fail("weight: expected zeros inside the unit circle, got one of modulus ", zero);
  if (pole >= kStableRadius) fail("weight: expected poles inside the unit circle, got one of modulus ", pole);
}

/// (x, w) from (u, y), or from (r, 0), or what (0, d) leaves; the checks of check() come first.
DiscreteStateSpace checked_inverse(const MimoLoop& loop) {
  check_loop_sizes(loop);
  check_weight(loop.weight);
  const DiscreteStateSpace matrix = loop_matrix(loop);
  if (!is_regular(matrix.d)) fail("loop: model and controller have an algebraic loop without solution");
  DiscreteStateSpace result = inverse(matrix);
  const double radius = spectral_radius(result);
  if (radius >= kStableRadius) {
    fail("loop: expected a controller that stabilises the model, got a closed-loop pole of modulus ", radius);
  }
  return result;
}

}  // namespace

RightFactors right_factors(const DiscreteStateSpace& g, double pole) {
  check(g);
  const MatrixXd f = stabilising_feedback(g.a, g.b, pole);
  const MatrixXd a = g.a + g.b * f;
  return {{a, g.b, g.c + g.d * f, g.d}, {a, g.b, f, MatrixXd::Identity(g.inputs(), g.inputs())}};
}

LeftFactors left_factors(const DiscreteStateSpace& g, double pole) {
  check(g);
  const MatrixXd l = stabilising_feedback(g.a.transpose(), g.c.transpose(), pole).transpose();
  const MatrixXd a = g.a + l * g.c;
  return {{a, g.b + l * g.d, g.c, g.d}, {a, l, g.c, MatrixXd::Identity(g.outputs(), g.outputs())}};
}

void check(const MimoLoop& loop) { checked_inverse(loop); }

Index uncertainty_memory(const MimoLoop& loop, double remainder) {
  const double poles = spectral_radius(checked_inverse(loop));
  if (!(remainder > 0.0 && remainder < 1.0)) {
    fail("uncertainty memory: expected a remainder between 0 and 1, got ", remainder);
  }
  const double radius = std::max(poles, spectral_radius(inverse(loop.weight)));
  return radius == 0.0 ? 0 : static_cast<Index>(std::ceil(std::log(remainder) / std::log(radius)));
}

MimoSignals uncertainty_signals(const MimoLoop& loop, const MatrixXd& u, const MatrixXd& y) {
  const DiscreteStateSpace from_record = checked_inverse(loop);
  check_sizes(loop.plant.inputs(), u.cols(), u, "input");
  check_sizes(loop.plant.outputs(), u.cols(), y, "output");
  const MatrixXd xw = filter(from_record, stacked(u, y));
  MimoSignals signals{filter(loop.weight, xw.topRows(u.rows())), xw.bottomRows(y.rows())};
  if (signals.v.isZero(0.0)) fail("uncertainty: the signal v is zero, nothing excites the loop");
  return signals;
}

MatrixXd uncertainty_input(const MimoLoop& loop, const MatrixXd& r) {
  const DiscreteStateSpace from_record = checked_inverse(loop);
  check_sizes(loop.plant.inputs(), r.cols(), r, "reference");
  // D~c r = D~c u + N~c y: the reference alone stands for both.
  const MatrixXd xw = filter(from_record, stacked(r, MatrixXd::Zero(loop.plant.outputs(), r.cols())));
  return filter(loop.weight, xw.topRows(r.rows()));
}

double reference_error(const DiscreteStateSpace& controller, const MatrixXd& u, const MatrixXd& y, const MatrixXd& r) {
  check(controller, "controller");
  check_sizes(controller.outputs(), r.cols(), r, "reference");
  check_sizes(controller.outputs(), r.cols(), u, "input");
  check_sizes(controller.inputs(), r.cols(), y, "output");
  if (r.cols() == 0) return 0.0;
  return (filter(controller, y) + u - r).cwiseAbs().maxCoeff();
}

MimoRecord simulate_closed_loop(const DiscreteStateSpace& plant, const DiscreteStateSpace& controller,
                                const MatrixXd& r, const MatrixXd& d) {
  check(plant, "plant");
  check(controller, "controller");
  const Index m = plant.inputs();
  const Index p = plant.outputs();
  check_sizes(m, r.cols(), r, "reference");
  check_sizes(p, r.cols(), d, "disturbance");
  MatrixXd direct(m + p, m + p);
  direct << MatrixXd::Identity(m, m), controller.d, -plant.d, MatrixXd::Identity(p, p);
  if (!is_regular(direct)) fail("loop: model and controller have an algebraic loop without solution");
  const Eigen::PartialPivLU<MatrixXd> solver(direct);
  VectorXd x = VectorXd::Zero(plant.states());
  VectorXd xc = VectorXd::Zero(controller.states());
  MimoRecord record{MatrixXd(m, r.cols()), MatrixXd(p, r.cols())};
  for (Index t = 0; t < r.cols(); ++t) {
    const VectorXd uy = solver.solve(stacked(r.col(t) - controller.c * xc, plant.c * x + d.col(t)));
    record.u.col(t) = uy.head(m);
    record.y.col(t) = uy.tail(p);
    x = (plant.a * x + plant.b * uy.head(m)).eval();
    xc = (controller.a * xc + controller.b * uy.tail(p)).eval();
  }
  return record;
}

MimoUncertainRecord simulate_uncertain_loop(const MimoLoop& loop, const DiscreteStateSpace& uncertainty,
                                            const MatrixXd& r, const MatrixXd& d) {
  const DiscreteStateSpace from_record = checked_inverse(loop);
  const Index m = loop.plant.inputs();
  const Index p = loop.plant.outputs();
  check_sizes(m, r.cols(), r, "reference");
  check_sizes(p, r.cols(), d, "disturbance");
  check(uncertainty, "uncertainty");
  if (uncertainty.inputs() != m || uncertainty.outputs() != p) {
    fail("uncertainty: expected ", m, " inputs and ", p, " outputs, got ", uncertainty.inputs(), " and ",
         uncertainty.outputs());
  }
  if (const double pole = spectral_radius(uncertainty); pole >= kStableRadius) {
    fail("uncertainty: expected poles inside the unit circle, got one of modulus ", pole);
  }
  const MatrixXd driven = filter(from_record, stacked(r, MatrixXd::Zero(p, r.cols()))).topRows(m);
  const MatrixXd disturbed = filter(from_record, stacked(MatrixXd::Zero(m, d.cols()), d));
  const auto through = [&](const MatrixXd& x) { return filter(uncertainty, filter(loop.weight, x)); };
  MimoUncertainRecord result;
  result.delta = disturbed.bottomRows(p) - through(disturbed.topRows(m));
  // D~c r = D~c u + N~c y with u and y of the true loop, disturbance included.
  result.signals.v = filter(loop.weight, driven);
  result.signals.w = filter(uncertainty, result.signals.v) + result.delta;
  const MatrixXd uy = filter(loop_matrix(loop), stacked(driven, result.signals.w));
  result.record = {uy.topRows(m), uy.bottomRows(p)};
  return result;
}

}  // namespace blockid
