#include <blockid/estimators/polynomial_model.hpp>

#include <blockid/blocks/offset.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/filtered.hpp>

#include <cmath>

namespace blockid {
namespace {

using Eigen::VectorXd;

/// 1, p_1, ..., p_n.
VectorXd monic(const Eigen::Ref<const VectorXd>& tail) {
  VectorXd result(tail.size() + 1);
  result << 1.0, tail;
  return result;
}

std::complex<double> value_at(const VectorXd& polynomial, double omega) {
  std::complex<double> sum = 0.0;
  for (Index k = polynomial.size() - 1; k >= 0; --k) sum = sum * std::polar(1.0, -omega) + polynomial[k];
  return sum;
}

VectorXd unit_pulse(Index count) { return VectorXd::Unit(count, 0); }

}  // namespace

void check(const PolynomialOrders& orders) {
  const auto& [na, nb, nc, nd, nf, nk] = orders;
  if (na < 0 || nb < 0 || nc < 0 || nd < 0 || nf < 0 || nk < 0) {
    fail("polynomial orders: expected na, nb, nc, nd, nf and nk >= 0, got na=", na, ", nb=", nb, ", nc=", nc,
         ", nd=", nd, ", nf=", nf, ", nk=", nk);
  }
}

Index parameter_count(const PolynomialOrders& orders) {
  return orders.na + orders.nb + 1 + orders.nc + orders.nd + orders.nf;
}

std::vector<std::string> parameter_names(const PolynomialOrders& orders) {
  std::vector<std::string> names;
  const auto add = [&names](const char* letter, Index first, Index last) {
    for (Index k = first; k <= last; ++k) names.push_back(letter + std::to_string(k));
  };
  add("a", 1, orders.na);
  add("b", 0, orders.nb);
  add("c", 1, orders.nc);
  add("d", 1, orders.nd);
  add("f", 1, orders.nf);
  return names;
}

void check(const PolynomialModel& model) {
  check(model.orders);
  if (model.theta.size() != parameter_count(model.orders)) {
    fail("polynomial model: expected ", parameter_count(model.orders), " parameters, got ", model.theta.size());
  }
  for (Index k = 0; k < model.theta.size(); ++k) {
    if (std::isfinite(model.theta[k])) continue;
    fail("polynomial model: ", parameter_names(model.orders)[static_cast<std::size_t>(k)],
         " is not finite: ", model.theta[k]);
  }
  if (!std::isfinite(model.u_mean) || !std::isfinite(model.y_mean)) {
    fail("polynomial model: expected finite means, got ", model.u_mean, " and ", model.y_mean);
  }
  if (!(model.sample_time_s > 0.0) || !std::isfinite(model.sample_time_s)) {
    fail("polynomial model: expected a sample time > 0, got ", model.sample_time_s);
  }
}

Polynomials polynomials(const PolynomialOrders& orders, const VectorXd& theta) {
  Polynomials result;
  Index next = 0;
  const auto take = [&](Index count) { return theta.segment(std::exchange(next, next + count), count); };
  result.a = monic(take(orders.na));
  result.b = VectorXd::Zero(orders.nk + orders.nb + 1);
  result.b.tail(orders.nb + 1) = take(orders.nb + 1);
  result.c = monic(take(orders.nc));
  result.d = monic(take(orders.nd));
  result.f = monic(take(orders.nf));
  return result;
}

Polynomials polynomials(const PolynomialModel& model) { return polynomials(model.orders, model.theta); }

bool has_roots_inside_circle(const VectorXd& polynomial) {
  VectorXd p = polynomial / polynomial[0];
  while (p.size() > 1) {
    const Index n = p.size() - 1;
    const double reflection = p[n];
    if (!(std::abs(reflection) < 1.0)) return false;
    p = VectorXd((p - reflection * p.reverse()).head(n) / (1.0 - reflection * reflection));
  }
  return true;
}

bool is_stable(const PolynomialModel& model) {
  const Polynomials p = polynomials(model);
  return has_roots_inside_circle(p.a) && has_roots_inside_circle(p.f);
}

bool has_stationary_noise(const PolynomialModel& model) {
  const Polynomials p = polynomials(model);
  return has_roots_inside_circle(p.a) && has_roots_inside_circle(p.d);
}

bool has_stable_predictor(const PolynomialModel& model) {
  const Polynomials p = polynomials(model);
  return has_roots_inside_circle(p.c) && has_roots_inside_circle(p.f);
}

std::complex<double> response(const PolynomialModel& model, double omega) {
  const Polynomials p = polynomials(model);
  return value_at(p.b, omega) / (value_at(p.a, omega) * value_at(p.f, omega));
}

std::complex<double> noise_response(const PolynomialModel& model, double omega) {
  const Polynomials p = polynomials(model);
  return value_at(p.c, omega) / (value_at(p.a, omega) * value_at(p.d, omega));
}

VectorXd noise_impulse_response(const PolynomialModel& model, Index count) {
  if (count < 1) fail("noise impulse response: expected at least one sample, got ", count);
  const Polynomials p = polynomials(model);
  return detail::filtered(p.c, detail::convolved(p.a, p.d), unit_pulse(count));
}

Model deterministic_part(const PolynomialModel& model) {
  check(model);
  const PolynomialOrders& orders = model.orders;
  const Polynomials p = polynomials(model);
  const VectorXd denominator = detail::convolved(p.a, p.f);
  Model chain = make_model(
      Series({{"input", Offset()}, {"G", Rational(orders.nb, orders.na + orders.nf, orders.nk)}, {"output", Offset()}}),
      model.sample_time_s);
  chain.parameters << -model.u_mean, p.b.tail(orders.nb + 1), denominator.tail(denominator.size() - 1), model.y_mean;
  return chain;
}

VectorXd simulate(const PolynomialModel& model, const VectorXd& u) { return simulate(deterministic_part(model), u); }

}  // namespace blockid
