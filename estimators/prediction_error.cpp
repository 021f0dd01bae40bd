#include <blockid/estimators/prediction_error.hpp>

#include <blockid/blocks/detail/infinity.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/complete_windows.hpp>
#include <blockid/estimators/detail/filtered.hpp>
#include <blockid/estimators/detail/flush_denormals.hpp>
#include <blockid/estimators/detail/gram_parts.hpp>

#include <algorithm>
#include <limits>
#include <numeric>

namespace blockid {
namespace {

using detail::convolved;
using detail::filtered;
using detail::kInfinity;
using Eigen::VectorXd;

/// X/(C F) delta.
VectorXd free_response(const VectorXd& x, const VectorXd& denominator, Index length) {
  VectorXd pulse = VectorXd::Zero(length);
  pulse.head(std::min(length, x.size())) = x.head(std::min(length, x.size()));
  return filtered(VectorXd::Ones(1), denominator, pulse);
}

Index states_of(const PolynomialOrders& orders) {
  const auto& [na, nb, nc, nd, nf, nk] = orders;
  return std::max({nc + nf, na + nd + nf, nk + nb + nd});
}

void check_record(const Record& record, const PolynomialOrders& orders, const PredictionOptions& options) {
  if (record.u.size() <= options.warmup) {
    fail(describe(record), ": has ", record.u.size(), " samples, no more than the warm-up of ", options.warmup);
  }
  if (orders.nc == 0) return;
  for (Index t = 0; t < record.y.size(); ++t) {
    if (!is_missing(record, t)) continue;
    fail(describe(record), ": output sample ", t,
         " is missing, and with nc > 0 no prediction error after it is known; expected complete records (cut them at "
         "the gaps) or nc = 0");
  }
}

}  // namespace

PredictionError::PredictionError(const PolynomialOrders& orders, const DataSet& data, const PredictionOptions& options,
                                 double u_mean, double y_mean)
    : orders_(orders) {
  check(orders);
  check(data);
  if (options.warmup < 0) fail("prediction error: the warm-up must be >= 0 samples, got ", options.warmup);
  if (options.initial_state == InitialState::periodic) {
    fail("prediction error: the initial state is zero or estimated; noise is not periodic");
  }
  if (options.initial_state == InitialState::estimated) states_ = states_of(orders);
  for (const Record& record : data.records) {
    check_record(record, orders, options);
    const Index length = record.u.size();
    Series series{record.u.array() - u_mean, VectorXd::Zero(length), VectorXd::Zero(length),
                  detail::complete_windows(record, orders.na + orders.nd)};
    for (Index t = 0; t < length; ++t) {
      if (!is_missing(record, t)) series.y[t] = record.y[t] - y_mean;
      if (t < options.warmup || !series.known[static_cast<std::size_t>(t)]) continue;
      series.weights[t] = weight(record, t);
      ++counted_;
    }
    samples_ += length;
    series_.push_back(std::move(series));
  }
}

Index PredictionError::unknown_count() const { return parameter_count(orders_) + states_ * std::ssize(series_); }

void PredictionError::check_unknowns(const VectorXd& p) const {
  if (p.size() != unknown_count()) {
    fail("prediction error: expected ", unknown_count(), " unknowns (", parameter_count(orders_),
         " parameters and the estimated initial states), got ", p.size());
  }
}

/// e of a record and the signals whose shifts are its derivatives.
struct PredictionError::Evaluated {
  VectorXd e;
  VectorXd by_a;
  VectorXd by_b;
  VectorXd by_c;
  VectorXd by_d;
  VectorXd by_f;
  VectorXd by_state;
};

VectorXd PredictionError::error_of(const VectorXd& p, Index record) const {
  const detail::FlushDenormals no_subnormals;
  const Series& series = series_[static_cast<std::size_t>(record)];
  const auto [a, b, c, d, f] = polynomials(orders_, p.head(parameter_count(orders_)));
  const VectorXd one = VectorXd::Ones(1);
  const VectorXd v = filtered(a, one, series.y) - filtered(b, f, series.u);
  VectorXd e = filtered(d, c, v);
  if (states_ > 0) {
    const VectorXd x = p.segment(parameter_count(orders_) + record * states_, states_);
    e += free_response(x, convolved(c, f), e.size());
  }
  return e;
}

PredictionError::Evaluated PredictionError::evaluate(const VectorXd& p, Index record) const {
  const detail::FlushDenormals no_subnormals;
  const Series& series = series_[static_cast<std::size_t>(record)];
  const Polynomials polynomial = polynomials(orders_, p.head(parameter_count(orders_)));
  const auto& [a, b, c, d, f] = polynomial;
  const VectorXd one = VectorXd::Ones(1);
  const VectorXd w = filtered(b, f, series.u);
  const VectorXd v = filtered(a, one, series.y) - w;
  const VectorXd both = convolved(c, f);
  VectorXd free = VectorXd::Zero(v.size());
  Evaluated result;
  if (states_ > 0) {
    free = free_response(p.segment(parameter_count(orders_) + record * states_, states_), both, v.size());
    result.by_state = free_response(one, both, v.size());
  }
  result.e = filtered(d, c, v) + free;
  if (orders_.na > 0) result.by_a = filtered(d, c, series.y);
  result.by_b = -filtered(d, both, series.u);
  if (orders_.nc > 0) result.by_c = -filtered(one, c, result.e);
  if (orders_.nd > 0) result.by_d = filtered(one, c, v);
  if (orders_.nf > 0) result.by_f = filtered(d, both, w) - filtered(one, f, free);
  return result;
}

/// Rows w_t de_t/dp of samples first .. first + rows - 1, columns of other records zero.
void PredictionError::write_rows(const Evaluated& evaluated, Index record, Index first, Index rows, double* data,
                                 Index stride) const {
  const VectorXd& weights = series_[static_cast<std::size_t>(record)].weights;
  Index column = 0;
  const auto write = [&](const VectorXd& signal, Index shift, Index count) {
    for (Index k = shift; k < shift + count; ++k, ++column) {
      for (Index t = first; t < first + rows; ++t) {
        const double w = weights[t];
        data[(t - first) * stride + column] = t < k || w == 0.0 ? 0.0 : w * signal[t - k];
      }
    }
  };
  const auto skip = [&](Index count) {
    for (Index t = 0; t < rows; ++t) std::fill_n(data + t * stride + column, count, 0.0);
    column += count;
  };
  write(evaluated.by_a, 1, orders_.na);
  write(evaluated.by_b, orders_.nk, orders_.nb + 1);
  write(evaluated.by_c, 1, orders_.nc);
  write(evaluated.by_d, 1, orders_.nd);
  write(evaluated.by_f, 1, orders_.nf);
  skip(record * states_);
  write(evaluated.by_state, 0, states_);
  skip(unknown_count() - column);
}

bool PredictionError::residuals(const VectorXd& p, double* r) const {
  check_unknowns(p);
  for (Index i = 0; i < std::ssize(series_); ++i) {
    const Series& series = series_[static_cast<std::size_t>(i)];
    Eigen::Map<VectorXd> of_record(r, series.u.size());
    of_record = series.weights.cwiseProduct(error_of(p, i));
    if (!of_record.allFinite()) return false;
    r += series.u.size();
  }
  return true;
}

double PredictionError::sum_of_squares(const VectorXd& p) const {
  VectorXd r(samples_);
  return residuals(p, r.data()) ? r.squaredNorm() : kInfinity;
}

bool PredictionError::jacobian(const VectorXd& p, double* r, double* jacobian) const {
  check_unknowns(p);
  const Index unknowns = unknown_count();
  for (Index i = 0; i < std::ssize(series_); ++i) {
    const Series& series = series_[static_cast<std::size_t>(i)];
    const Index length = series.u.size();
    const Evaluated evaluated = evaluate(p, i);
    Eigen::Map<VectorXd> of_record(r, length);
    of_record = series.weights.cwiseProduct(evaluated.e);
    write_rows(evaluated, i, 0, length, jacobian, unknowns);
    if (!of_record.allFinite() || !Eigen::Map<const VectorXd>(jacobian, length * unknowns).allFinite()) return false;
    r += length;
    jacobian += length * unknowns;
  }
  return true;
}

template <class Sums>
bool PredictionError::add_all(const VectorXd& p, Sums& sums) const {
  check_unknowns(p);
  const Index unknowns = unknown_count();
  const Index stride = padded_columns(unknowns + 1);
  VectorXd tile = VectorXd::Zero(kMaxTileRows * stride);
  Sums total = sums;
  for (Index i = 0; i < std::ssize(series_); ++i) {
    const Series& series = series_[static_cast<std::size_t>(i)];
    const Evaluated evaluated = evaluate(p, i);
    for (Index first = 0; first < series.u.size(); first += kMaxTileRows) {
      const Index rows = std::min(kMaxTileRows, series.u.size() - first);
      write_rows(evaluated, i, first, rows, tile.data(), stride);
      for (Index k = 0; k < rows; ++k) {
        tile[k * stride + unknowns] = series.weights[first + k] * evaluated.e[first + k];
      }
      if (!tile.head(rows * stride).allFinite()) return false;
      total.add(tile.data(), rows, stride);
    }
  }
  sums = total;
  return true;
}

bool PredictionError::accumulate(const VectorXd& p, NormalEquations& sums) const { return add_all(p, sums); }

bool PredictionError::accumulate(const VectorXd& p, QrTriangle& sums) const { return add_all(p, sums); }

VectorXd PredictionError::errors(const VectorXd& p, Index record) const {
  check_unknowns(p);
  const Series& series = series_[static_cast<std::size_t>(record)];
  VectorXd e = error_of(p, record);
  for (Index t = 0; t < e.size(); ++t) {
    if (!series.known[static_cast<std::size_t>(t)]) e[t] = std::numeric_limits<double>::quiet_NaN();
  }
  return e;
}

VectorXd PredictionError::with_fitted_states(const VectorXd& theta) const {
  VectorXd p = VectorXd::Zero(unknown_count());
  p.head(theta.size()) = theta;
  if (states_ == 0) return p;
  QrTriangle sums(unknown_count() + 1);
  if (!accumulate(p, sums)) return p;
  std::vector<Index> kept(static_cast<std::size_t>(p.size() - theta.size()) + 1);
  std::iota(kept.begin(), kept.end(), theta.size());
  QrTriangle of_states(std::ssize(kept));
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = sums.triangle()(Eigen::all, kept);
  of_states.add(rows.data(), rows.rows(), rows.cols());
  p.tail(p.size() - theta.size()) = -solve_least_squares(of_states).x;
  return p;
}

}  // namespace blockid
