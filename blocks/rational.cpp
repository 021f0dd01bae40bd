#include <blockid/blocks/rational.hpp>

#include <blockid/data/error.hpp>

#include <cmath>

namespace blockid {

Rational::Rational(Index nb, Index na, Index nk) : nb_(nb), na_(na), nk_(nk), order_(std::max(na, nb + nk)) {
  if (nb < 0 || na < 0 || nk < 0) {
    fail("rational: nb, na and nk are degrees and a delay, expected >= 0, got nb=", nb, ", na=", na, ", nk=", nk);
  }
}

Arguments Rational::arguments() const {
  Arguments result = {{"nb", std::to_string(nb_)}, {"na", std::to_string(na_)}};
  if (nk_ > 0) result.emplace_back("nk", std::to_string(nk_));
  return result;
}

std::vector<std::string> Rational::parameter_names() const {
  std::vector<std::string> names;
  for (Index k = 0; k <= nb_; ++k) names.push_back("b" + std::to_string(k));
  for (Index k = 1; k <= na_; ++k) names.push_back("a" + std::to_string(k));
  return names;
}

Eigen::VectorXd Rational::initial_parameters() const { return Eigen::VectorXd::Unit(parameter_count(), 0); }

Index Rational::tangent_memory(Index upstream, OwnColumns) const {
  return detail::DirectFormTangents::memory({nb_, na_, nk_}, upstream);
}

void Rational::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                            std::span<const double> u, std::span<double> y, const Tangents& tangents,
                            OwnColumns own) const {
  const std::size_t split = static_cast<std::size_t>(nb_) + 1;
  const detail::DirectForm<double> filter(theta.subspan(0, split), theta.subspan(split), nk_);
  detail::DirectFormTangents::push(filter, {nb_, na_, nk_}, x, memory, u, y, tangents, own);
}

bool Rational::push_negated(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                            std::span<const double> u, std::span<double> y, const Tangents& tangents,
                            double* target) const {
  const std::size_t split = static_cast<std::size_t>(nb_) + 1;
  const detail::DirectForm<double> filter(theta.subspan(0, split), theta.subspan(split), nk_);
  return detail::DirectFormTangents::push_negated(filter, {nb_, na_, nk_}, x, memory, u, y, tangents, target);
}

std::complex<double> Rational::frequency_response(std::span<const double> theta, double omega) const {
  const std::complex<double> shift = std::polar(1.0, -omega);
  std::complex<double> numerator = 0.0;
  std::complex<double> denominator = 0.0;
  for (Index k = nb_; k >= 0; --k) numerator = numerator * shift + theta[static_cast<std::size_t>(k)];
  for (Index k = na_; k >= 1; --k) denominator = (denominator + theta[static_cast<std::size_t>(nb_ + k)]) * shift;
  return std::polar(1.0, -omega * static_cast<double>(nk_)) * numerator / (1.0 + denominator);
}

Rescaled Rational::with_scaled_output(std::span<const double> theta, double k) const {
  Eigen::VectorXd scaled = Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Index>(theta.size()));
  scaled.head(nb_ + 1) *= k;
  return {*this, scaled};
}

Rescaled Rational::with_scaled_input(std::span<const double> theta, double k) const {
  return with_scaled_output(theta, 1.0 / k);
}

Index Rational::gain_parameter(std::span<const double> theta) const {
  Index largest = 0;
  Eigen::Map<const Eigen::VectorXd>(theta.data(), nb_ + 1).cwiseAbs().maxCoeff(&largest);
  return largest;
}

Eigen::VectorXd Rational::numerator(std::span<const double> theta) const {
  Eigen::VectorXd b = Eigen::VectorXd::Zero(nb_ + nk_ + 1);
  b.tail(nb_ + 1) = Eigen::Map<const Eigen::VectorXd>(theta.data(), nb_ + 1);
  return b;
}

Eigen::VectorXd Rational::denominator(std::span<const double> theta) const {
  Eigen::VectorXd a(na_ + 1);
  a[0] = 1.0;
  a.tail(na_) = Eigen::Map<const Eigen::VectorXd>(theta.data() + nb_ + 1, na_);
  return a;
}

}  // namespace blockid
