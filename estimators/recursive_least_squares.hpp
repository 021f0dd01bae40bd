// Least squares that follow the data row by row.
#pragma once

#include <blockid/estimators/detail/row_major.hpp>

#include <Eigen/Core>
#include <span>

namespace blockid {

/// argmin_theta sum_k lambda^{n-k} w_k^2 (d_k - v_k theta)^2 after n rows, kept as a triangle R with
/// R'R = sum lambda^{n-k} w_k^2 v_k' v_k, which plane rotations update row by row.
///
/// Equal to least squares over all rows at every step: unlike a recursion of the covariance it needs no start value,
/// and no scaling of the columns. One row costs O(P^2) and allocates nothing. Source: Golub and Van Loan, Matrix
/// Computations, section 12.5 (updating a QR factorisation).
class RecursiveLeastSquares {
 public:
  /// parameters: P >= 1. forgetting: lambda in (0, 1]; rows 1/(1 - lambda) ago weigh e^-1. Throws Error outside.
  explicit RecursiveLeastSquares(Eigen::Index parameters, double forgetting = 1.0);

  Eigen::Index parameter_count() const { return parameters_; }
  /// Number of rows so far.
  Eigen::Index rows() const { return rows_; }

  /// Adds (P,) knowledge theta_i = mean_i +- standard_deviation_i, in units of the noise of a row of weight one; it is
  /// forgotten like a row. Throws Error for sizes that differ or a deviation that is not positive.
  void add_prior(const Eigen::VectorXd& mean, const Eigen::VectorXd& standard_deviation);

  /// Adds a row: regressors v (P,), regressand d, weight w >= 0. Throws Error for another number of regressors; a row
  /// that is not finite is refused with an Error and changes nothing.
  void update(std::span<const double> regressors, double regressand, double weight = 1.0);

  /// True once the rows determine every parameter.
  bool is_determined() const;

  /// (P,) minimiser. Throws Error while is_determined() is false.
  Eigen::VectorXd estimate() const;
  /// The same into (P,) numbers of the caller, without allocation.
  void estimate(std::span<double> theta) const;

  /// (P, P) (R'R)^-1 times the mean squared residual, e'e / (rows - P) for lambda = 1.
  Eigen::MatrixXd covariance() const;
  /// sum lambda^{n-k} w_k^2 e_k^2 at the minimum.
  double residual_sum_of_squares() const { return residual_; }

 private:
  void rotate_in();

  Eigen::Index parameters_;
  double forgetting_;
  Eigen::Index rows_ = 0;
  /// Sum of lambda^{n-k} over the rows.
  double effective_rows_ = 0.0;
  double residual_ = 0.0;
  /// (P, P + 1) [R, Q'd].
  detail::RowMajor triangle_;
  Eigen::VectorXd row_;
};

}  // namespace blockid
