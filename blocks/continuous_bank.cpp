#include <blockid/blocks/continuous_bank.hpp>

#include <blockid/blocks/continuous_rational.hpp>
#include <blockid/blocks/detail/format.hpp>
#include <blockid/blocks/localising_basis.hpp>
#include <blockid/data/error.hpp>

#include <Eigen/LU>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

void check_positive(const char* kind, const char* what, double value) {
  if (!(value > 0.0) || !std::isfinite(value)) fail(kind, ": expected a positive ", what, ", got ", value);
}

void check_count(const char* kind, const char* what, Index value) {
  if (value < 1) fail(kind, ": ", what, " is expected to be at least 1, got ", value);
}

}  // namespace

ContinuousBank::ContinuousBank(std::string kind, Arguments own_arguments, Sampling sampling,
                               Eigen::MatrixXd state_matrix, Eigen::VectorXd input_vector)
    : kind_(std::move(kind)),
      own_arguments_(std::move(own_arguments)),
      sampling_(sampling),
      state_matrix_(std::move(state_matrix)),
      input_vector_(std::move(input_vector)) {
  detail::check_sampling(kind_.c_str(), sampling);
  system_ = detail::held_system<double>(state_matrix_, input_vector_, sampling);
}

ContinuousBank ContinuousBank::flbf(std::vector<double> break_points, Sampling sampling) {
  const LocalisingBasis basis(std::move(break_points));
  return {"flbf",
          {{"break_points", detail::list_text(basis.break_points())}},
          sampling,
          basis.matrix<double>(Eigen::VectorXd::Zero(basis.size())),
          basis.input()};
}

// x_k' = p x_{k+1}, x_n' = p (u - sum_k binomial(n, k - 1) x_k).
ContinuousBank ContinuousBank::svf(Index order, double pole, Sampling sampling) {
  check_count("svf", "order", order);
  check_positive("svf", "pole in rad/s", pole);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(order, order);
  double binomial = 1.0;
  for (Index k = 0; k < order; ++k) {
    if (k + 1 < order) a(k, k + 1) = pole;
    a(order - 1, k) = -pole * binomial;
    binomial = binomial * static_cast<double>(order - k) / static_cast<double>(k + 1);
  }
  return {"svf",
          {{"order", std::to_string(order)}, {"pole", detail::number_text(pole)}},
          sampling,
          a,
          pole * Eigen::VectorXd::Unit(order, order - 1)};
}

// x_k' = -p (2 x_1 + ... + 2 x_{k-1} + x_k) + sqrt(2p) u.
ContinuousBank ContinuousBank::laguerre(Index order, double pole, Sampling sampling) {
  check_count("laguerre", "order", order);
  check_positive("laguerre", "pole in rad/s", pole);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(order, order);
  a.triangularView<Eigen::StrictlyLower>().setConstant(-2.0 * pole);
  a.diagonal().setConstant(-pole);
  return {"laguerre",
          {{"order", std::to_string(order)}, {"pole", detail::number_text(pole)}},
          sampling,
          a,
          Eigen::VectorXd::Constant(order, std::sqrt(2.0 * pole))};
}

// Section i is driven by w_i = w_{i-1} - sqrt(2b) x_{2i-3}, w_1 = u:
//   x_{2i-1}' = sqrt(2b) w_i - b x_{2i-1} - sqrt(c) x_{2i},   x_{2i}' = sqrt(c) x_{2i-1}.
ContinuousBank ContinuousBank::kautz(Index pairs, double frequency, double damping, Sampling sampling) {
  check_count("kautz", "pairs", pairs);
  check_positive("kautz", "frequency in rad/s", frequency);
  check_positive("kautz", "damping", damping);
  const double b = 2.0 * damping * frequency;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * pairs, 2 * pairs);
  Eigen::VectorXd input = Eigen::VectorXd::Zero(2 * pairs);
  for (Index i = 0; i < 2 * pairs; i += 2) {
    for (Index before = 0; before < i; before += 2) a(i, before) = -2.0 * b;
    a(i, i) = -b;
    a(i, i + 1) = -frequency;
    a(i + 1, i) = frequency;
    input[i] = std::sqrt(2.0 * b);
  }
  return {"kautz",
          {{"pairs", std::to_string(pairs)},
           {"frequency", detail::number_text(frequency)},
           {"damping", detail::number_text(damping)}},
          sampling,
          a,
          input};
}

Eigen::VectorXcd ContinuousBank::at(std::complex<double> s) const {
  const Index n = parameter_count();
  const Eigen::MatrixXcd resolvent = s * Eigen::MatrixXcd::Identity(n, n) - state_matrix_.cast<std::complex<double>>();
  return resolvent.partialPivLu().solve(input_vector_.cast<std::complex<double>>().eval());
}

Arguments ContinuousBank::arguments() const {
  Arguments result = own_arguments_;
  result.emplace_back("sample_time", detail::number_text(sampling_.sample_time_s));
  result.emplace_back("hold", to_text(sampling_.hold));
  return result;
}

std::vector<std::string> ContinuousBank::parameter_names() const {
  std::vector<std::string> names;
  for (Index k = 1; k <= parameter_count(); ++k) names.push_back("c" + std::to_string(k));
  return names;
}

detail::HeldTangents ContinuousBank::tangents_for(Index upstream) const {
  return {{.order = parameter_count(),
           .taps = detail::held_taps(sampling_.hold),
           .lag = latency(),
           .parameters = parameter_count(),
           .signals = parameter_count(),
           .free = parameter_count()},
          upstream};
}

Index ContinuousBank::tangent_memory(Index upstream, OwnColumns) const { return tangents_for(upstream).memory(); }

void ContinuousBank::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                                  std::span<const double> u, std::span<double> y, const Tangents& tangents,
                                  OwnColumns own) const {
  const detail::HeldTangents kept = tangents_for(tangents.upstream);
  const Index n = parameter_count();
  if (detail::HeldTangents::is_new(memory)) {
    kept.start(memory, filter(theta),
               {.signals = system_,
                .own = Eigen::MatrixXd::Identity(n, n),
                .direct = Eigen::VectorXd::Zero(n),
                .free_transition = system_.transition,
                .free_start = Eigen::Map<const Eigen::VectorXd>(x.data(), n),
                .free_own = Eigen::MatrixXd::Identity(n, n)});
  }
  kept.push(x, memory, u, y, tangents, own);
}

std::complex<double> ContinuousBank::frequency_response(std::span<const double> theta, double omega) const {
  return detail::frequency_response(filter(theta), omega);
}

Rescaled ContinuousBank::with_scaled_output(std::span<const double> theta, double k) const {
  return {*this, k * Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count())};
}

Rescaled ContinuousBank::with_scaled_input(std::span<const double> theta, double k) const {
  return with_scaled_output(theta, 1.0 / k);
}

Index ContinuousBank::gain_parameter(std::span<const double> theta) const {
  Index largest = 0;
  Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count()).cwiseAbs().maxCoeff(&largest);
  return largest;
}

}  // namespace blockid
