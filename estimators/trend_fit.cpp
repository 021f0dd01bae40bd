#include <blockid/estimators/trend_fit.hpp>

#include <blockid/blocks/detail/hold.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/estimators/detail/row_major.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

using detail::RowMajor;

constexpr Index kTileRows = 256;

void check_records(const DataSet& data) {
  if (data.records.empty()) fail("trends: expected at least one record, got none");
  for (const Record& record : data.records) {
    check(record);
    check_excitation(record);
    if (record.sample_time_s != data.records.front().sample_time_s) {
      fail("trends: expected one sample time in all records, got ", data.records.front().sample_time_s, " s and ",
           record.sample_time_s, " s (", describe(record), ")");
    }
  }
}

/// sink(row, regressand, weight) for every complete row whose newest sample is `first` or later.
template <class Sink>
void for_each_row(const DataSet& data, const TrendStructure& structure, Index first, Sink&& sink) {
  for (const Record& record : data.records) {
    TrendRows rows(structure, record.sample_time_s);
    for (Index k = 0; k < record.u.size(); ++k) {
      const double y = is_missing(record, k) ? std::numeric_limits<double>::quiet_NaN() : record.y[k];
      if (rows.push(record.u[k], y) && k >= first) sink(rows.regressors(), rows.regressand(), weight(record, k));
    }
  }
}

QrTriangle summed_rows(const DataSet& data, const TrendStructure& structure, Index columns, Index first) {
  QrTriangle sums(columns + 1);
  RowMajor tile(kTileRows, columns + 1);
  Index filled = 0;
  const auto flush = [&] {
    sums.add(tile.data(), filled, columns + 1);
    filled = 0;
  };
  for_each_row(data, structure, first, [&](const Eigen::VectorXd& regressors, double regressand, double w) {
    tile.row(filled) << w * regressors.transpose(), w * regressand;
    if (++filled == kTileRows) flush();
  });
  if (filled > 0) flush();
  return sums;
}

void place_coefficients(const Eigen::VectorXd& theta, TrendFit& fit) {
  const TrendStructure& structure = fit.structure;
  fit.a = Eigen::VectorXd::Unit(structure.order + 1, structure.order);
  fit.b = Eigen::VectorXd::Zero(structure.order);
  Index next = 0;
  for (const Index power : structure.a) fit.a[power] = theta[next++];
  for (const Index power : structure.b) fit.b[power] = theta[next++];
}

/// alpha = sum_i a_i r_0^i, by which an error of the equation exceeds that of the prediction.
double leading_weight(const TrendFit& fit, double sample_time_s) {
  double sum = 0.0;
  for (Index power = 0; power <= fit.structure.order; ++power) {
    sum += fit.a[power] * output_trend(fit.structure.scheme, fit.structure.order, power, sample_time_s)[0];
  }
  return sum;
}

/// Rows whose newest sample comes before `first` are left out.
TrendFit fit_from(const DataSet& data, const TrendStructure& structure, Index first) {
  const Index columns = std::ssize(structure.a) + std::ssize(structure.b);
  const QrTriangle sums = summed_rows(data, structure, columns, first);
  if (sums.rows() < columns) {
    fail("trends: expected at least ", columns, " complete rows for ", columns, " coefficients, got ", sums.rows());
  }
  const LinearSolution solution = solve_least_squares(sums);
  TrendFit fit;
  fit.structure = structure;
  fit.rows = sums.rows();
  fit.rank = solution.rank;
  fit.condition = solution.condition;
  const double freedom = static_cast<double>(std::max<Index>(fit.rows - columns, 1));
  fit.covariance = solution.residual_sum_of_squares / freedom * scaled_pseudo_inverse(sums).matrix;
  place_coefficients(solution.x, fit);
  const double alpha = leading_weight(fit, data.records.front().sample_time_s);
  for_each_row(data, structure, first, [&](const Eigen::VectorXd& regressors, double regressand, double) {
    const double error = (regressand - regressors.dot(solution.x)) / alpha;
    fit.squared_error += error * error;
    fit.absolute_error += std::abs(error);
  });
  return fit;
}

/// The frequency in whose units the monic polynomial with ascending coefficients a has none above one.
double radius_of(const Eigen::VectorXd& a) {
  const Index order = a.size() - 1;
  double radius = 0.0;
  for (Index power = 0; power < order; ++power) {
    radius = std::max(radius, std::pow(std::abs(a[power]), 1.0 / static_cast<double>(order - power)));
  }
  return radius;
}

/// Companion matrix of a in units of `radius`, its first row the coefficients, highest power first.
Eigen::MatrixXd companion_matrix(const Eigen::VectorXd& a, double radius) {
  const Index order = a.size() - 1;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(order, order);
  for (Index power = 0; power < order; ++power) {
    companion(0, order - 1 - power) = -a[power] / std::pow(radius, static_cast<double>(order - power));
  }
  for (Index k = 1; k < order; ++k) companion(k, k - 1) = 1.0;
  return companion;
}

/// Roots of the monic polynomial with ascending coefficients a, a[0] != 0.
Eigen::VectorXcd roots(const Eigen::VectorXd& a) {
  const double radius = radius_of(a);
  return radius * companion_matrix(a, radius).eigenvalues();
}

}  // namespace

TrendFit fit_trends(const DataSet& data, const TrendStructure& structure) {
  check(structure);
  check_records(data);
  return fit_from(data, structure, 0);
}

Eigen::VectorXcd poles(const TrendFit& fit) {
  const Index order = fit.structure.order;
  // Integrators are exact: their poles do not pass through the eigenvalue problem.
  Index integrators = 0;
  while (integrators < order && fit.a[integrators] == 0.0) ++integrators;
  Eigen::VectorXcd result = Eigen::VectorXcd::Zero(order);
  result.tail(order - integrators) = roots(fit.a.tail(order + 1 - integrators));
  return result;
}

bool is_stable(const TrendFit& fit) { return (poles(fit).real().array() < 0.0).all(); }

Eigen::VectorXd simulate(const TrendFit& fit, const Eigen::VectorXd& u, double sample_time_s) {
  const Index order = fit.structure.order;
  const double coefficients = radius_of(fit.a);
  const double radius = coefficients > 0.0 ? coefficients : 1.0 / sample_time_s;
  // States are derivatives in units of the radius.
  const Eigen::MatrixXd derivatives = companion_matrix(fit.a, radius);
  const Eigen::VectorXd drive = Eigen::VectorXd::Unit(order, 0);
  const detail::SampledSystem<double> step =
      detail::sampled_system<double>(derivatives, drive, {radius * sample_time_s, Hold::zero_order});
  Eigen::VectorXd output(order);
  for (Index power = 0; power < order; ++power) {
    output[order - 1 - power] = fit.b[power] / std::pow(radius, static_cast<double>(order - power));
  }
  Eigen::VectorXd x = Eigen::VectorXd::Zero(order);
  Eigen::VectorXd next(order);
  Eigen::VectorXd y(u.size());
  for (Index k = 0; k < u.size(); ++k) {
    y[k] = output.dot(x);
    next.noalias() = step.transition * x;
    if (k >= fit.structure.delay) next += step.gains.col(step.gains.cols() - 1) * u[k - fit.structure.delay];
    x.swap(next);
  }
  return y;
}

std::vector<TrendFit> delay_table(const DataSet& data, const TrendStructure& structure, Index longest) {
  if (longest < 0) fail("trends: expected a longest delay of at least 0 samples, got ", longest);
  check(structure);
  check_records(data);
  std::vector<TrendFit> table;
  for (Index delay = 0; delay <= longest; ++delay) {
    TrendStructure delayed = structure;
    delayed.delay = delay;
    table.push_back(fit_from(data, delayed, structure.order + longest));
  }
  return table;
}

TrendFit fit_trends_with_delay(const DataSet& data, const TrendStructure& structure, Index longest,
                               TrendCriterion criterion) {
  const std::vector<TrendFit> table = delay_table(data, structure, longest);
  const auto value = [&](const TrendFit& fit) {
    return criterion == TrendCriterion::squared ? fit.squared_error : fit.absolute_error;
  };
  return *std::min_element(table.begin(), table.end(),
                           [&](const TrendFit& left, const TrendFit& right) { return value(left) < value(right); });
}

}  // namespace blockid
