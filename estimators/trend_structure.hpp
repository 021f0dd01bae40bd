// Discrete-time trends: continuous-time coefficients from differences and sums of samples.
#pragma once

#include <blockid/blocks/block.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// How s is written in q^-1, the shift by one sample of D seconds.
enum class TrendScheme {
  /// s = (1 - q^-1) / (D q^-1), the delta operator. Errors of order D.
  goodwin,
  /// s = 2 (1 - q^-1) / (D (1 + q^-1)), with the hold 2 q^-1 / (1 + q^-1) behind the input. Errors of order D^2.
  tustin
};

/// A(s) y = B(s) e^{-s d D} u with A(s) = s^m + sum_i a_i s^i over the powers in `a`, B(s) = sum_i b_i s^i over those
/// in `b`; coefficients of all other powers are zero.
///
/// Without power 0 in `a` the model has an integrator. Source: Janiszowski 1999, equations (1) and (12).
struct TrendStructure {
  TrendScheme scheme = TrendScheme::tustin;
  /// m >= 1.
  Index order = 1;
  /// Powers with a free coefficient, each in 0..m-1, none twice, in the order of the parameters.
  std::vector<Index> a;
  std::vector<Index> b;
  /// d >= 0, whole samples.
  Index delay = 0;
};

/// All powers m-1..0 of A(s), and nb..0 of B(s). Throws Error unless 0 <= nb < m.
TrendStructure full_trends(TrendScheme scheme, Index nb, Index order, Index delay = 0);

/// Throws Error for an order below 1, a power outside 0..m-1 or given twice, no power in `b`, a negative delay.
void check(const TrendStructure& structure);

/// R_m^i, (m + 1,) coefficients of q^0, q^-1, ..., q^-m; i in 0..m, R_m^m being that of the regressand:
///   Goodwin  D^{m-i} (1 - q^-1)^i q^{-(m-i)}
///   Tustin   2^i D^{m-i} (1 - q^-1)^i (1 + q^-1)^{m-i}
/// Source: Janiszowski 1999, equations (4) and (8).
Eigen::VectorXd output_trend(TrendScheme scheme, Index order, Index power, double sample_time_s);

/// P_m^i without the delay, (m + 1,) coefficients of q^0, ..., q^-m; i in 0..m-1:
///   Goodwin  D^{m-i} (1 - q^-1)^i q^{-(m-i)}
///   Tustin   2^{i+1} D^{m-i} q^-1 (1 - q^-1)^i (1 + q^-1)^{m-i-1}
Eigen::VectorXd input_trend(TrendScheme scheme, Index order, Index power, double sample_time_s);

/// Rows of the regression R_m^m y = -sum_i a_i R_m^i y + sum_i b_i P_m^i u, one sample after the other.
class TrendRows {
 public:
  /// sample_time_s: D > 0 in seconds. Throws Error for a structure that check() refuses.
  TrendRows(const TrendStructure& structure, double sample_time_s);

  /// Number of free coefficients.
  Index columns() const { return static_cast<Index>(regressors_.size()); }

  /// Takes u(k) and y(k); y is NaN where it is missing. True when this sample completes a row, which needs the last
  /// m + 1 outputs and m + 1 inputs d samples ago.
  bool push(double u, double y);

  /// (columns(),) [-R_m^i y for the powers in `a`, P_m^i u for those in `b`] of the last row.
  const Eigen::VectorXd& regressors() const { return regressors_; }
  /// R_m^m y of the last row.
  double regressand() const { return regressand_; }

 private:
  Index order_;
  Index delay_;
  Eigen::MatrixXd output_trends_;
  Eigen::MatrixXd input_trends_;
  Eigen::VectorXd leading_trend_;
  /// Newest first.
  Eigen::VectorXd outputs_;
  Eigen::VectorXd inputs_;
  Index outputs_known_ = 0;
  Index inputs_known_ = 0;
  Eigen::VectorXd regressors_;
  double regressand_ = 0.0;
};

}  // namespace blockid
