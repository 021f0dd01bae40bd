// One-step-ahead prediction errors of linear models with a model of their noise.
#pragma once

#include <blockid/data/data_set.hpp>
#include <blockid/estimators/polynomial_model.hpp>
#include <blockid/estimators/predictor.hpp>
#include <blockid/estimators/residual_function.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// r_t = w_t e_t over all records,
///
///     e = D/C (A y - q^-nk B/F u) + X/(C F) delta,
///
/// y and u being deviations from the given means, delta the unit pulse at the first sample of the record and X(q) a
/// polynomial of `state_count()` coefficients: what the unknown past adds, whatever it was. X is zero for
/// InitialState::zero (rest) and unknown for each record for InitialState::estimated.
///
/// The unknowns are p = [theta, X of record 1, X of record 2, ...]. w_t is the record's weight, and zero in the warm-up
/// and for missing samples. An e_t is known only when the outputs that it takes are there: na + nd of them before
/// sample t when C = 1; all of them otherwise. So records with missing samples are refused when nc > 0.
/// Derivatives are filtered signals and their shifts; memory is a dozen signals as long as the longest record.
/// Source: Ljung 1999, equations (4.33), (7.94) and (10.53).
class PredictionError final : public ResidualFunction {
 public:
  /// Throws Error for orders below zero, data that do not pass check(), records no longer than the warm-up, a periodic
  /// initial state (noise is not periodic), missing samples with nc > 0.
  PredictionError(const PolynomialOrders& orders, const DataSet& data, const PredictionOptions& options,
                  double u_mean = 0.0, double y_mean = 0.0);

  /// max(nc + nf, na + nd + nf, nk + nb + nd) when states are estimated, else 0.
  Index state_count() const { return states_; }
  Index unknown_count() const override;
  Index sample_count() const override { return samples_; }
  Index counted_samples() const override { return counted_; }

  bool residuals(const Eigen::VectorXd& p, double* r) const override;
  double sum_of_squares(const Eigen::VectorXd& p) const override;
  bool jacobian(const Eigen::VectorXd& p, double* r, double* jacobian) const override;
  bool accumulate(const Eigen::VectorXd& p, NormalEquations& sums) const override;
  bool accumulate(const Eigen::VectorXd& p, QrTriangle& sums) const override;

  /// e (N_i,) of record i, unweighted; not a number where it is not known.
  Eigen::VectorXd errors(const Eigen::VectorXd& p, Index record) const;

  /// p with theta as given and the X of each record that minimises its sum of squares, by linear least squares.
  Eigen::VectorXd with_fitted_states(const Eigen::VectorXd& theta) const;

 private:
  /// Deviations from the means, missing outputs zero, and w_t with zeros wherever e_t is not known.
  struct Series {
    Eigen::VectorXd u;
    Eigen::VectorXd y;
    Eigen::VectorXd weights;
    std::vector<bool> known;
  };
  struct Evaluated;

  void check_unknowns(const Eigen::VectorXd& p) const;
  Eigen::VectorXd error_of(const Eigen::VectorXd& p, Index record) const;
  Evaluated evaluate(const Eigen::VectorXd& p, Index record) const;
  void write_rows(const Evaluated& evaluated, Index record, Index first, Index rows, double* data, Index stride) const;
  template <class Sums>
  bool add_all(const Eigen::VectorXd& p, Sums& sums) const;

  PolynomialOrders orders_;
  std::vector<Series> series_;
  Index states_ = 0;
  Index samples_ = 0;
  Index counted_ = 0;
};

}  // namespace blockid
