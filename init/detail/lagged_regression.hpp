// Linear least squares on delayed signals.
#pragma once

#include <blockid/data/data_set.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/init/bla.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid::detail {

/// Columns sign x_{t-first}, sign x_{t-first-1}, ..., `count` of them.
struct LaggedColumns {
  const Eigen::VectorXd& x;
  Index first;
  Index count;
  double sign = 1.0;
};

/// Adds the rows [columns, target_t] of the samples from `first` on that are `usable`.
void add_lagged_rows(const std::vector<LaggedColumns>& columns, const Eigen::VectorXd& target, Index first,
                     const std::vector<bool>& usable, NormalEquations& sums);

/// [b, a] = argmin sum_t (A(q) y_t - B(q) u_{t-nk})^2, whatever the roots of A, over rows that touch neither missing
/// samples nor the past of a record.
Eigen::VectorXd arx_coefficients(const DataSet& data, const BlaOrders& orders, Index warmup);

/// Means of the inputs, and of the outputs that are present after the warm-up.
struct Means {
  double u = 0.0;
  double y = 0.0;
};
Means means_of(const DataSet& data, Index warmup);

/// Deviations from the means; missing outputs keep their last present value so that filters can pass over them.
DataSet deviations(const DataSet& data, const Means& means);

}  // namespace blockid::detail
