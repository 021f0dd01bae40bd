// Residuals of a chain over a data set, tile by tile.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/estimators/residual_function.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// What the state of the chain is at the first sample of each record.
enum class InitialState {
  zero,       ///< rest; leave the transient out of the sum by a warm-up
  estimated,  ///< unknown numbers of each record, fitted with the parameters
  periodic    ///< steady state: whole periods of the input run before the record
};

struct PredictionOptions {
  InitialState initial_state = InitialState::zero;
  /// Samples at the start of each record that do not count.
  Index warmup = 0;
  /// Periods that run before the record when the initial state is periodic; more for chains whose memory is longer than
  /// one period.
  Index run_in_periods = 1;
};

/// r_t = w_t (y_t - yhat_t) over all records; w_t = 0 in the warm-up and for missing samples.
///
/// The unknowns are p = [theta, x0 of record 1, x0 of record 2, ...]; the states are there only when estimated.
/// Memory does not grow with the length of the records. The data set must outlive the predictor.
class Predictor final : public ResidualFunction {
 public:
  /// Throws Error when the data set does not pass check(), when a record is no longer than the warm-up, or when a
  /// periodic state is asked of a record without a period.
  Predictor(AnyBlock chain, const DataSet& data, PredictionOptions options = {});
  Predictor(AnyBlock chain, DataSet&& data, PredictionOptions options = {}) = delete;

  const AnyBlock& chain() const { return chain_; }
  const DataSet& data() const { return *data_; }
  const PredictionOptions& options() const { return options_; }

  /// n_theta.
  Index parameter_count() const { return chain_.parameter_count(); }
  /// P = n_theta, plus n_x for each record when the initial states are estimated.
  Index unknown_count() const override;
  /// N, all samples of all records; rows of residuals and Jacobian.
  Index sample_count() const override { return samples_; }
  /// Samples with w_t > 0.
  Index counted_samples() const override { return counted_; }

  /// r: (N,). False when a prediction is not finite.
  bool residuals(const Eigen::VectorXd& p, double* r) const override;
  /// r'r; infinite when a prediction is not finite.
  double sum_of_squares(const Eigen::VectorXd& p) const override;
  /// r: (N,) and J = dr/dp: (N, P) row-major. False when a prediction or a derivative is not finite.
  bool jacobian(const Eigen::VectorXd& p, double* r, double* jacobian) const override;
  /// Adds the rows [dr/dp, r] to `sums`, P + 1 columns wide. False, with `sums` as they were, when not finite.
  bool accumulate(const Eigen::VectorXd& p, NormalEquations& sums) const override;
  bool accumulate(const Eigen::VectorXd& p, QrTriangle& sums) const override;

  /// (batches, P): sum of r_t dr_t/dp over batches of `batch` samples in a row within each record. Throws nothing; rows
  /// are not finite when a prediction is not.
  Eigen::MatrixXd score_batches(const Eigen::VectorXd& p, Index batch) const;

  /// yhat (N_i,) of record i.
  Eigen::VectorXd predict(const Eigen::VectorXd& p, Index record) const;

 private:
  struct Timeline;

  template <class Sink>
  bool run_values(const Eigen::VectorXd& p, Index record, Sink&& sink) const;
  template <class Sink>
  bool run_tangents(const Eigen::VectorXd& p, Index record, Sink&& sink) const;
  template <class Target, class Sink>
  bool run_tangents(const Eigen::VectorXd& p, Index record, Target&& target, Sink&& sink) const;

  Eigen::VectorXd start_state(const Eigen::VectorXd& p, Index record) const;
  /// For each tangent column of record i the unknown it belongs to.
  std::vector<Index> unknown_of_column(Index record) const;
  void check_unknowns(const Eigen::VectorXd& p) const;
  OwnColumns own() const;

  AnyBlock chain_;
  const DataSet* data_;
  PredictionOptions options_;
  Index samples_ = 0;
  Index counted_ = 0;
};

}  // namespace blockid
