#include <blockid/estimators/trend_structure.hpp>

#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace blockid {
namespace {

void check_powers(const std::vector<Index>& powers, Index order, const std::string& name) {
  for (std::size_t k = 0; k < powers.size(); ++k) {
    if (powers[k] < 0 || powers[k] >= order) {
      fail("trends: powers of ", name, "(s) must lie in 0..", order - 1, " for order ", order, ", got ", powers[k]);
    }
    if (std::find(powers.begin(), powers.begin() + static_cast<std::ptrdiff_t>(k), powers[k]) !=
        powers.begin() + static_cast<std::ptrdiff_t>(k)) {
      fail("trends: power ", powers[k], " of ", name, "(s) is given twice");
    }
  }
}

std::vector<Index> powers_down_from(Index highest) {
  std::vector<Index> powers;
  for (Index power = highest; power >= 0; --power) powers.push_back(power);
  return powers;
}

/// p(q^-1) (1 + c q^-1), within the length of p.
Eigen::VectorXd times_binomial(const Eigen::VectorXd& p, double c) {
  Eigen::VectorXd product = p;
  product.tail(p.size() - 1) += c * p.head(p.size() - 1);
  return product;
}

/// factor q^-shift (1 - q^-1)^differences (1 + q^-1)^sums, (m + 1,).
Eigen::VectorXd trend_polynomial(Index order, double factor, Index shift, Index differences, Index sums) {
  Eigen::VectorXd p = Eigen::VectorXd::Zero(order + 1);
  p[shift] = factor;
  for (Index k = 0; k < differences; ++k) p = times_binomial(p, -1.0);
  for (Index k = 0; k < sums; ++k) p = times_binomial(p, 1.0);
  return p;
}

void check_power(Index power, Index highest) {
  if (power < 0 || power > highest) fail("trends: expected a power in 0..", highest, ", got ", power);
}

void push_newest(Eigen::VectorXd& samples, double value) {
  std::copy_backward(samples.data(), samples.data() + samples.size() - 1, samples.data() + samples.size());
  samples[0] = value;
}

}  // namespace

TrendStructure full_trends(TrendScheme scheme, Index nb, Index order, Index delay) {
  if (nb < 0 || nb >= order) fail("trends: expected 0 <= nb < order, got nb=", nb, " and order ", order);
  return {scheme, order, powers_down_from(order - 1), powers_down_from(nb), delay};
}

void check(const TrendStructure& structure) {
  if (structure.order < 1) fail("trends: expected an order of at least 1, got ", structure.order);
  check_powers(structure.a, structure.order, "A");
  check_powers(structure.b, structure.order, "B");
  if (structure.b.empty()) fail("trends: expected at least one power of B(s), got none");
  if (structure.delay < 0) fail("trends: expected a delay of at least 0 samples, got ", structure.delay);
}

Eigen::VectorXd output_trend(TrendScheme scheme, Index order, Index power, double sample_time_s) {
  check_power(power, order);
  const double scale = std::pow(sample_time_s, static_cast<double>(order - power));
  if (scheme == TrendScheme::goodwin) return trend_polynomial(order, scale, order - power, power, 0);
  return trend_polynomial(order, std::ldexp(scale, static_cast<int>(power)), 0, power, order - power);
}

Eigen::VectorXd input_trend(TrendScheme scheme, Index order, Index power, double sample_time_s) {
  check_power(power, order - 1);
  const double scale = std::pow(sample_time_s, static_cast<double>(order - power));
  if (scheme == TrendScheme::goodwin) return trend_polynomial(order, scale, order - power, power, 0);
  return trend_polynomial(order, std::ldexp(scale, static_cast<int>(power) + 1), 1, power, order - power - 1);
}

TrendRows::TrendRows(const TrendStructure& structure, double sample_time_s)
    : order_(structure.order), delay_(structure.delay) {
  check(structure);
  if (!(sample_time_s > 0.0) || !std::isfinite(sample_time_s)) {
    fail("trends: expected a positive sample time in seconds, got ", sample_time_s);
  }
  const Index na = std::ssize(structure.a);
  const Index nb = std::ssize(structure.b);
  output_trends_.resize(na, order_ + 1);
  input_trends_.resize(nb, order_ + 1);
  for (Index i = 0; i < na; ++i) {
    output_trends_.row(i) =
        -output_trend(structure.scheme, order_, structure.a[static_cast<std::size_t>(i)], sample_time_s).transpose();
  }
  for (Index i = 0; i < nb; ++i) {
    input_trends_.row(i) =
        input_trend(structure.scheme, order_, structure.b[static_cast<std::size_t>(i)], sample_time_s).transpose();
  }
  leading_trend_ = output_trend(structure.scheme, order_, order_, sample_time_s);
  outputs_ = Eigen::VectorXd::Zero(order_ + 1);
  inputs_ = Eigen::VectorXd::Zero(order_ + 1 + delay_);
  regressors_ = Eigen::VectorXd::Zero(na + nb);
}

bool TrendRows::push(double u, double y) {
  push_newest(inputs_, u);
  push_newest(outputs_, y);
  inputs_known_ = std::isfinite(u) ? std::min(inputs_known_ + 1, inputs_.size()) : 0;
  outputs_known_ = std::isfinite(y) ? std::min(outputs_known_ + 1, outputs_.size()) : 0;
  if (inputs_known_ < inputs_.size() || outputs_known_ < outputs_.size()) return false;
  regressors_.head(output_trends_.rows()).noalias() = output_trends_.lazyProduct(outputs_);
  regressors_.tail(input_trends_.rows()).noalias() = input_trends_.lazyProduct(inputs_.tail(order_ + 1));
  regressand_ = leading_trend_.dot(outputs_);
  return true;
}

}  // namespace blockid
