#include <blockid/blocks/continuous_rational.hpp>

#include <blockid/blocks/detail/format.hpp>
#include <blockid/data/error.hpp>

#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <utility>

namespace blockid {
namespace {

/// Sampling and orders are verified before anything is computed from them.
std::vector<double> checked(Index nb, Index na, const Sampling& sampling, std::vector<double> break_points) {
  if (na < 1) fail("continuous_rational: na is the degree of the denominator, expected at least 1, got ", na);
  if (nb < 0 || nb > na) {
    fail("continuous_rational: expected a degree of the numerator from 0 to na=", na, ", got nb=", nb);
  }
  detail::check_sampling("continuous_rational", sampling);
  if (break_points.empty()) return ContinuousRational::default_break_points(na, sampling.sample_time_s);
  if (std::ssize(break_points) != na) {
    fail("continuous_rational: expected na=", na, " break points, got ", break_points.size());
  }
  return break_points;
}

/// [[A, 0], [v c', A]]: A driven by v times the output c of another A.
Eigen::MatrixXd chained(const Eigen::MatrixXd& a, const Eigen::VectorXd& v, const Eigen::VectorXd& c) {
  const Index n = a.rows();
  Eigen::MatrixXd twice = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  twice.topLeftCorner(n, n) = a;
  twice.bottomRightCorner(n, n) = a;
  twice.bottomLeftCorner(n, n) = v * c.transpose();
  return twice;
}

}  // namespace

void detail::check_sampling(const char* kind, const Sampling& sampling) {
  if (!(sampling.sample_time_s > 0.0) || !std::isfinite(sampling.sample_time_s)) {
    fail(kind, ": expected a positive sample time in seconds, got ", sampling.sample_time_s);
  }
}

ContinuousRational::ContinuousRational(Index nb, Index na, Sampling sampling, std::vector<double> break_points)
    : nb_(nb),
      sampling_(sampling),
      basis_(checked(nb, na, sampling, std::move(break_points))),
      low_degree_(basis_.low_degree(b_count())) {}

std::vector<double> ContinuousRational::default_break_points(Index na, double sample_time_s) {
  const double upper = 0.5 * std::numbers::pi / sample_time_s;
  return logarithmic_break_points(upper / std::pow(10.0, 2.5), upper, na);
}

Arguments ContinuousRational::arguments() const {
  return {{"nb", std::to_string(nb_)},
          {"na", std::to_string(na())},
          {"sample_time", detail::number_text(sampling_.sample_time_s)},
          {"hold", to_text(sampling_.hold)},
          {"break_points", detail::list_text(basis_.break_points())}};
}

std::vector<std::string> ContinuousRational::parameter_names() const {
  std::vector<std::string> names;
  if (has_direct()) names.emplace_back("b0");
  for (Index k = 1; k <= b_count(); ++k) names.push_back("b" + std::to_string(k));
  for (Index k = 1; k <= na(); ++k) names.push_back("a" + std::to_string(k));
  return names;
}

Eigen::VectorXd ContinuousRational::initial_parameters() const {
  return Eigen::VectorXd::Unit(parameter_count(), has_direct() ? 1 : 0);
}

detail::HeldTangents ContinuousRational::tangents_for(Index upstream) const {
  return {{.order = na(),
           .taps = detail::held_taps(sampling_.hold),
           .lag = latency(),
           .parameters = parameter_count(),
           .signals = 2 * na(),
           .free = 3 * na()},
          upstream};
}

// With x = (s - A)^-1 P 1 u and y = b' x, dA/da_k = -P 1 e_k' gives
//   dy/da_k = -b' (s - A)^-1 P 1 x_k = -z_k,   z' = A z + P 1 y:
// one more copy of the filter, driven by y. A state x(0) adds e^{At} x(0) to x, whose part of dy/da_k is the
// convolution of x_k with the impulse response: -w_k, w' = A w + x(0) g, g = b' e^{At} P 1.
detail::HeldTangentSources ContinuousRational::sources(std::span<const double> theta, std::span<const double> x) const {
  const Index n = na();
  const Eigen::VectorXd a = Eigen::Map<const Eigen::VectorXd>(theta.data() + nb_ + 1, n);
  const Eigen::VectorXd b = numerator(theta);
  const Eigen::MatrixXd matrix = basis_.matrix<double>(a);
  const Eigen::VectorXd start = Eigen::Map<const Eigen::VectorXd>(x.data(), n);
  Eigen::VectorXd input = Eigen::VectorXd::Zero(2 * n);
  input.head(n) = basis_.input();
  const Index first_b = has_direct() ? 1 : 0;
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(parameter_count(), 2 * n);
  own.block(first_b, 0, b_count(), n) = low_degree_.transpose();
  own.bottomRightCorner(n, n) = -Eigen::MatrixXd::Identity(n, n);
  // f = [e^{At} P 1; w; e^{At} x(0)].
  Eigen::MatrixXd free = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  free.topLeftCorner(2 * n, 2 * n) = chained(matrix, start, b);
  free.bottomRightCorner(n, n) = matrix;
  Eigen::VectorXd free_start(3 * n);
  free_start << input, start;
  Eigen::MatrixXd free_own = Eigen::MatrixXd::Zero(parameter_count(), 3 * n);
  free_own.block(first_b, 2 * n, b_count(), n) = low_degree_.transpose();
  free_own.block(nb_ + 1, n, n, n) = -Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd direct = Eigen::VectorXd::Zero(parameter_count());
  if (has_direct()) direct[0] = 1.0;
  return {.signals = detail::held_system<double>(chained(matrix, basis_.input(), b), input, sampling_),
          .own = own,
          .direct = direct,
          .free_transition = detail::matrix_exponential(free * sampling_.sample_time_s),
          .free_start = free_start,
          .free_own = free_own};
}

Index ContinuousRational::tangent_memory(Index upstream, OwnColumns) const { return tangents_for(upstream).memory(); }

void ContinuousRational::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                                      std::span<const double> u, std::span<double> y, const Tangents& tangents,
                                      OwnColumns own) const {
  const detail::HeldTangents kept = tangents_for(tangents.upstream);
  if (detail::HeldTangents::is_new(memory)) kept.start(memory, filter(theta), sources(theta, x));
  kept.push(x, memory, u, y, tangents, own);
}

std::complex<double> ContinuousRational::frequency_response(std::span<const double> theta, double omega) const {
  return detail::frequency_response(filter(theta), omega);
}

Rescaled ContinuousRational::with_scaled_output(std::span<const double> theta, double k) const {
  Eigen::VectorXd scaled = Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count());
  scaled.head(nb_ + 1) *= k;
  return {*this, scaled};
}

Rescaled ContinuousRational::with_scaled_input(std::span<const double> theta, double k) const {
  return with_scaled_output(theta, 1.0 / k);
}

Index ContinuousRational::gain_parameter(std::span<const double> theta) const {
  Index largest = 0;
  Eigen::Map<const Eigen::VectorXd>(theta.data(), nb_ + 1).cwiseAbs().maxCoeff(&largest);
  return largest;
}

std::complex<double> ContinuousRational::transfer_function(std::span<const double> theta,
                                                           std::complex<double> s) const {
  const Eigen::VectorXcd f = basis_.at(s);
  const Eigen::VectorXd b = numerator(theta);
  std::complex<double> top = has_direct() ? theta[0] : 0.0;
  std::complex<double> bottom = 1.0;
  for (Index k = 0; k < na(); ++k) {
    top += b[k] * f[k];
    bottom += theta[static_cast<std::size_t>(nb_ + 1 + k)] * f[k];
  }
  return top / bottom;
}

Eigen::VectorXcd ContinuousRational::poles(std::span<const double> theta) const {
  return basis_.poles(Eigen::Map<const Eigen::VectorXd>(theta.data() + nb_ + 1, na()));
}

Eigen::VectorXd ContinuousRational::numerator(std::span<const double> theta) const {
  return low_degree_ * Eigen::Map<const Eigen::VectorXd>(theta.data() + (has_direct() ? 1 : 0), b_count());
}

Eigen::VectorXd ContinuousRational::from_roots(double gain, const std::vector<std::complex<double>>& zeros,
                                               const std::vector<std::complex<double>>& poles) const {
  if (std::ssize(zeros) > nb_) fail("continuous_rational: expected at most nb=", nb_, " zeros, got ", zeros.size());
  Eigen::VectorXd theta(parameter_count());
  theta.tail(na()) = basis_.denominator_from_poles(poles);
  const double direct = std::ssize(zeros) == na() ? gain : 0.0;
  if (has_direct()) theta[0] = direct;
  using LongComplex = std::complex<long double>;
  const Eigen::VectorXd all = basis_.coordinates([&](LongComplex s) {
    LongComplex value = static_cast<long double>(gain);
    for (std::size_t k = 0; k < poles.size(); ++k) {
      if (k < zeros.size()) value *= s - LongComplex(zeros[k]);
      value /= s + static_cast<long double>(basis_.break_points()[k]);
    }
    return value - static_cast<long double>(direct);
  });
  theta.segment(has_direct() ? 1 : 0, b_count()) = low_degree_.householderQr().solve(all);
  return theta;
}

}  // namespace blockid
