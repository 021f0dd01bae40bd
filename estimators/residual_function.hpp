// What a search, a cost function and a covariance need to know of a model and its data.
#pragma once

#include <blockid/estimators/accumulators.hpp>

#include <Eigen/Core>

namespace blockid {

/// Weighted residuals r_t(p), t = 1..N, of P unknowns p, with their derivatives J = dr/dp.
///
/// N counts all samples of all records; r_t is zero for those that do not count. A residual that is not finite is a
/// result, never an exception: the search rejects the step that led there.
class ResidualFunction {
 public:
  virtual ~ResidualFunction() = default;

  /// P.
  virtual Index unknown_count() const = 0;
  /// N, rows of residuals and Jacobian.
  virtual Index sample_count() const = 0;
  /// Samples that count.
  virtual Index counted_samples() const = 0;

  /// r: (N,). False when a residual is not finite.
  virtual bool residuals(const Eigen::VectorXd& p, double* r) const = 0;
  /// r'r; infinite when a residual is not finite.
  virtual double sum_of_squares(const Eigen::VectorXd& p) const = 0;
  /// r: (N,) and J: (N, P) row-major. False when a residual or a derivative is not finite.
  virtual bool jacobian(const Eigen::VectorXd& p, double* r, double* jacobian) const = 0;
  /// Adds the rows [J_t, r_t] to `sums`, P + 1 columns wide. False, with `sums` as they were, when not finite.
  virtual bool accumulate(const Eigen::VectorXd& p, NormalEquations& sums) const = 0;
  virtual bool accumulate(const Eigen::VectorXd& p, QrTriangle& sums) const = 0;

 protected:
  ResidualFunction() = default;
  ResidualFunction(const ResidualFunction&) = default;
  ResidualFunction(ResidualFunction&&) = default;
  ResidualFunction& operator=(const ResidualFunction&) = default;
  ResidualFunction& operator=(ResidualFunction&&) = default;
};

}  // namespace blockid
