// The regression that time-domain estimators of continuous-time models share.
#pragma once

#include <blockid/data/data_set.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/estimators/continuous_fit.hpp>
#include <blockid/estimators/detail/held_states.hpp>
#include <blockid/estimators/rational_basis.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid::detail {

/// Unknowns of a continuous-time model and of its records.
struct ContinuousUnknowns {
  Eigen::VectorXd a;  ///< (n,)
  Eigen::VectorXd b;  ///< (m + 1,)
  /// (n,) for each run: C/E = sum_k c_k phi_k is what its initial state adds; none unless they are estimated.
  std::vector<Eigen::VectorXd> c;
};

/// A run of present output samples: its own initial state, its own rows.
struct ContinuousRun {
  Index record = 0;
  Index first = 0;
  Eigen::VectorXd u;
  Eigen::VectorXd y;
  Eigen::VectorXd weights;
  Index period = 0;
  HeldSignal held_u;
  HeldSignal held_y;
};

/// The model A y = B u + C, filtered by 1/D with D / E = lead + phi d: with x_v = (phi / D) v, the states of a filter
/// bank, and f its impulse responses
///
///   y = -x_y (a - d) + [x_u, u - x_u d] T b + f c,       T = numerator_map.
///
/// d = 0 (or that of (s + p)^n in powers of s) makes it the equation error of the state-variable filter methods, d = a
/// the output error. Rows are weighted by the records' weights.
class ContinuousEquation {
 public:
  /// Throws Error for what fit_continuous() refuses.
  ContinuousEquation(const DataSet& data, const RationalBasis& basis, const ContinuousFitOptions& options);

  const RationalBasis& basis() const { return basis_; }
  const std::vector<ContinuousRun>& runs() const { return runs_; }
  double sample_time_s() const { return sample_time_s_; }
  Index order() const { return basis_.order; }
  Index numerators() const { return basis_.numerator_degree + 1; }
  /// Columns of f of all runs.
  Index initial_columns() const { return initial_each_ * static_cast<Index>(runs_.size()); }
  /// P = initial_columns() + m + 1 + n.
  Index unknowns() const { return initial_columns() + numerators() + order(); }
  /// Rows that count.
  Index rows() const { return rows_; }

  /// Triangle of all rows [f of each run, [x_u, u - x_u d] T, -x_y | y].
  QrTriangle regression(const Eigen::VectorXd& d) const;
  /// The same with -x_z after the columns of u, z = B/A u + C/A the output of a model: [f, u-part, -x_z, -x_y | y].
  /// Exact for the input's hold.
  QrTriangle regression(const Eigen::VectorXd& d, const ContinuousUnknowns& model) const;

  /// x = [c.., b, a - d] of a regression, taken apart.
  ContinuousUnknowns unknowns_of(const Eigen::VectorXd& x, const Eigen::VectorXd& d) const;
  /// The inverse.
  Eigen::VectorXd coordinates_of(const ContinuousUnknowns& theta, const Eigen::VectorXd& d) const;

 private:
  struct Filter;
  Filter filter_of(const Eigen::VectorXd& d) const;
  bool counts(const ContinuousRun& run, Index t) const;
  void add_runs(const DataSet& data);
  HeldStates modelled_states(const Filter& filter, const Filter& model, const ContinuousUnknowns& theta,
                             std::size_t run) const;
  QrTriangle run_triangle(const Filter& filter, const ContinuousRun& run, HeldStates* modelled) const;
  QrTriangle joined(const std::vector<QrTriangle>& triangles) const;

  RationalBasis basis_;
  ContinuousFitOptions options_;
  Eigen::MatrixXd numerator_map_;
  double sample_time_s_ = 1.0;
  Index initial_each_ = 0;
  Index rows_ = 0;
  std::vector<ContinuousRun> runs_;
};

}  // namespace blockid::detail
