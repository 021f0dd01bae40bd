// Continuous-time coefficients by least squares over discrete-time trends.
#pragma once

#include <blockid/data/data_set.hpp>
#include <blockid/estimators/trend_structure.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// Least squares over trends, or what a recursion has reached.
struct TrendFit {
  TrendStructure structure;
  /// (m + 1,) coefficients of A(s), ascending powers, a[m] = 1, zero where the structure has none.
  Eigen::VectorXd a;
  /// (m,) coefficients of B(s), ascending powers.
  Eigen::VectorXd b;
  /// (P, P) s^2 (X'X)^-1 with s^2 = e'e / (rows - P), in the structure's order (`a`, then `b`). Right for a white
  /// equation error only: noise on y makes it neither white nor free of bias.
  Eigen::MatrixXd covariance;
  /// Number of rows that counted.
  Index rows = 0;
  Index rank = 0;
  /// Of the regressors with columns of unit norm, cond(X); infinite when rank deficient.
  double condition = 1.0;
  /// IQ = sum_k (y(k) - yhat(k))^2, yhat being the prediction from the samples before k. Source: equations (10), (11).
  double squared_error = 0.0;
  /// IV = sum_k |y(k) - yhat(k)|.
  double absolute_error = 0.0;
};

/// argmin over a, b of sum_k w_k^2 (R_m^m y - v(k) theta)^2 over the records, by QR of the columns scaled to unit norm.
///
/// A row counts when the m + 1 outputs that it takes are there; w_k is the weight of its newest sample. All records
/// must have the same sample time. Throws Error for a structure that check() refuses, a constant input, fewer rows than
/// coefficients. Rank loss is a result: rank < P, and the solution of smallest norm. Source: Janiszowski 1999, (12).
TrendFit fit_trends(const DataSet& data, const TrendStructure& structure);

/// Poles of B(s)/A(s), (m,) in rad/s.
Eigen::VectorXcd poles(const TrendFit& fit);
/// True when every pole has a negative real part.
bool is_stable(const TrendFit& fit);

/// (N,) response from rest to an input that is held between samples, exact whatever the sample time.
Eigen::VectorXd simulate(const TrendFit& fit, const Eigen::VectorXd& u, double sample_time_s);

/// Which of the criteria (11) chooses a delay.
enum class TrendCriterion { squared, absolute };

/// Fits with delays 0..longest over the same rows; element d belongs to delay d.
std::vector<TrendFit> delay_table(const DataSet& data, const TrendStructure& structure, Index longest);

/// The fit of delay_table() with the least criterion. Source: Janiszowski 1999, section 2.
TrendFit fit_trends_with_delay(const DataSet& data, const TrendStructure& structure, Index longest,
                               TrendCriterion criterion = TrendCriterion::squared);

}  // namespace blockid
