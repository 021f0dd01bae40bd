// Continuous-time coefficients on line: trends and recursive least squares, sample by sample.
#pragma once

#include <blockid/estimators/recursive_least_squares.hpp>
#include <blockid/estimators/trend_structure.hpp>

#include <Eigen/Core>

namespace blockid {

/// The estimate of fit_trends() after every sample, in constant memory and time a sample.
class RecursiveTrends {
 public:
  /// sample_time_s: D > 0 in seconds. forgetting: lambda in (0, 1], one step for every complete row.
  RecursiveTrends(const TrendStructure& structure, double sample_time_s, double forgetting = 1.0);

  /// Takes u(k) and y(k); y is NaN where it is missing. True when the estimate has changed and is determined.
  bool update(double u, double y);

  /// True once the samples determine every coefficient.
  bool is_determined() const { return least_squares_.is_determined(); }

  /// (P,) free coefficients in the structure's order, `a` then `b`. Throws Error while they are not determined.
  Eigen::VectorXd estimate() const { return least_squares_.estimate(); }
  /// (P, P), as RecursiveLeastSquares::covariance().
  Eigen::MatrixXd covariance() const { return least_squares_.covariance(); }

  const RecursiveLeastSquares& least_squares() const { return least_squares_; }

 private:
  TrendRows rows_;
  RecursiveLeastSquares least_squares_;
};

/// (n, P) estimates after every sample of a record, NaN until they are determined.
Eigen::MatrixXd trend_history(const Eigen::VectorXd& u, const Eigen::VectorXd& y, const TrendStructure& structure,
                              double sample_time_s, double forgetting = 1.0);

/// CONV: mean over samples first..last-1 of the largest relative step max_i |theta_i(k) - theta_i(k-1)| / |theta_i(k)|.
///
/// history: (n, P). Throws Error unless 1 <= first < last <= n, or when an estimate among them is not finite. The paper
/// prints the name only; this reading fits its figures within a quarter. Source: Janiszowski 1999, table 1.
double convergence(const Eigen::MatrixXd& history, Index first, Index last);

/// First sample from which on all coefficients stay within `fraction` of their last values; n when the last itself does
/// not count. Source: Janiszowski 1999, table 1 (T_ss).
Index settling_sample(const Eigen::MatrixXd& history, double fraction = 0.1);

}  // namespace blockid
