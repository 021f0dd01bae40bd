// Taylor coefficients of both filters of a Wiener-Hammerstein system from data, without iteration.
#pragma once

#include <blockid/data/data_set.hpp>

#include <Eigen/Core>

namespace blockid {

using Index = Eigen::Index;

struct CoefficientRegression {
  /// (n + 1,) of G_W and G_H, both with leading 1.
  Eigen::VectorXd first;
  Eigen::VectorXd second;
  /// (degree,) theta_1 .. theta_degree of f(v) = theta_1 v + ... + theta_degree v^degree.
  Eigen::VectorXd polynomial;
  /// Second over first singular value of the two rank-one steps: 0 for exact data of this form.
  double first_ratio = 0.0;
  double second_ratio = 0.0;
  /// Root mean square error of the regression.
  double rmse = 0.0;
  /// Number of its regressors, and how many directions of them the data determine.
  Index regressors = 0;
  Index rank = 0;
};

/// Largest number of regressors, binomial(n + 1 + degree, degree).
inline constexpr Index kMaxRegressors = 1000;

/// Giordano and Sjoberg 2015, (30) and (31): y_t = sum_h B_h sum_d theta_d (sum_k A_k u_{t-k})^d, A_0 = B_0 = 1.
///
/// 1. y by least squares on all products of up to `degree` of the inputs u_t .. u_{t-n}, each product once.
/// 2. A product that contains u_t comes from h = 0 alone: its coefficient is theta_d A_k A_l ... times a count.
///    Such coefficients, a row for each product of d - 1 inputs with u_t among them and a column for each further
///    input, form a matrix of rank one; its leading right singular vector is A.
/// 3. With A known all coefficients of degree d are linear in B_h theta_d: least squares, and a second rank-one step.
///
/// Products of inputs older than n are left out; for white Gaussian input this biases only the coefficients of lower
/// degrees. The input is scaled to unit deviation inside. For small n and degree. Throws Error when degree < 2, n < 0,
/// there are more than kMaxRegressors products or fewer samples than that, or when no product of two or more inputs
/// explains anything.
CoefficientRegression coefficient_regression(const DataSet& data, Index n, Index degree);

}  // namespace blockid
