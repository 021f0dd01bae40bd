#include <blockid/init/detail/lagged_regression.hpp>

#include <blockid/blocks/block.hpp>
#include <blockid/estimators/detail/complete_windows.hpp>

#include <algorithm>

namespace blockid::detail {

void add_lagged_rows(const std::vector<LaggedColumns>& columns, const Eigen::VectorXd& target, Index first,
                     const std::vector<bool>& usable, NormalEquations& sums) {
  const Index stride = padded_columns(sums.columns());
  std::vector<double> tile(static_cast<std::size_t>(kMaxTileRows * stride), 0.0);
  Index rows = 0;
  for (Index t = first; t < target.size(); ++t) {
    if (!usable[static_cast<std::size_t>(t)]) continue;
    double* row = tile.data() + rows * stride;
    for (const LaggedColumns& group : columns) {
      for (Index k = group.first; k < group.first + group.count; ++k) *row++ = group.sign * group.x[t - k];
    }
    *row = target[t];
    if (++rows == kMaxTileRows) {
      sums.add(tile.data(), rows, stride);
      rows = 0;
    }
  }
  sums.add(tile.data(), rows, stride);
}

Eigen::VectorXd arx_coefficients(const DataSet& data, const BlaOrders& orders, Index warmup) {
  NormalEquations sums(orders.nb + 1 + orders.na + 1);
  for (const Record& record : data.records) {
    add_lagged_rows({{record.u, orders.nk, orders.nb + 1}, {record.y, 1, orders.na, -1.0}}, record.y,
                    std::max({orders.na, orders.nb + orders.nk, warmup}), complete_windows(record, orders.na), sums);
  }
  return solve_least_squares(sums.gram()).x;
}

Means means_of(const DataSet& data, Index warmup) {
  Means sum;
  double count = 0.0;
  double samples = 0.0;
  for (const Record& record : data.records) {
    sum.u += record.u.sum();
    samples += static_cast<double>(record.u.size());
    for (Index t = warmup; t < record.u.size(); ++t) {
      if (is_missing(record, t)) continue;
      sum.y += record.y[t];
      count += 1.0;
    }
  }
  return {sum.u / samples, count > 0.0 ? sum.y / count : 0.0};
}

DataSet deviations(const DataSet& data, const Means& means) {
  DataSet result = data;
  for (Record& record : result.records) {
    record.u.array() -= means.u;
    double last = 0.0;
    for (Index t = 0; t < record.y.size(); ++t) {
      if (!is_missing(record, t)) last = record.y[t] - means.y;
      record.y[t] = last;
    }
  }
  return result;
}

}  // namespace blockid::detail
