// Continuous-time models refitted by their output error.
#pragma once

#include <blockid/blocks/continuous_rational.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/continuous_model.hpp>
#include <blockid/estimators/refit.hpp>

#include <Eigen/Core>

namespace blockid {

/// The transfer function of a block with parameters theta, (nb + 1 + na,), in localising functions of its break points:
/// the inverse of as_model(). Throws Error for another number of parameters.
ContinuousTransferFunction transfer_function_of(const ContinuousRational& block, const Eigen::VectorXd& theta);

/// A continuous-time model that was refitted: the chain of one ContinuousRational block with its report, and the
/// transfer function that it stands for.
struct ContinuousRefit {
  /// Its status is ill_conditioned also when only initial states are undetermined, as those of spline holds always are.
  RefitReport report;
  ContinuousTransferFunction transfer_function;
  /// Covariance of [a, b], (P, P), and what follows from it for the poles; empty when it was not asked for.
  Eigen::MatrixXd covariance;
  PoleDeviations pole_deviations;
};

/// argmin over a and b (and initial states on request) of sum_t r_t^2, r_t = w_t (y_t - yhat_t), by refit(): gaps and
/// weights are taken as they are. The chain is that of as_model(). A start that is not stable, whose simulation
/// explodes and tells little, is tried beside the one with its poles mirrored into the left half plane; the better fit
/// is kept. Where it begins with more than a thousand times the error that the latter ends with it is not searched
/// from.
///
/// The block with a spline hold looks hold_latency() samples ahead and twice that far back: where it would see beyond
/// an end of a record the output does not count. Throws Error for what refit() refuses.
ContinuousRefit refit(const ContinuousTransferFunction& start, const DataSet& data, Hold hold,
                      const RefitOptions& options = {});

}  // namespace blockid
