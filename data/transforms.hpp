#pragma once

#include <Eigen/Core>

#include "blockid/data/record.hpp"

namespace blockid {

/// forward: z = (x - offset) / scale;  inverse: x = z scale + offset.
struct Affine {
  double offset = 0.0;
  double scale = 1.0;  ///< not 0

  [[nodiscard]] double forward(double x) const { return (x - offset) / scale; }
  [[nodiscard]] double inverse(double z) const { return z * scale + offset; }
};

/// forward: z_t = (x_t - slope t - offset) / scale;  inverse: x_t = z_t scale + offset + slope t, t
/// = 0..N-1 in samples.
struct SignalTransform {
  Affine affine;
  double slope_per_sample = 0.0;

  /// x (N,) -> z (N,)
  [[nodiscard]] Eigen::VectorXd forward(const Eigen::VectorXd& x) const;
  /// z (N,) -> x (N,), equal to the original up to rounding
  [[nodiscard]] Eigen::VectorXd inverse(const Eigen::VectorXd& z) const;
};

/// A record in transformed units together with the way back.
struct Standardised {
  Record record;
  SignalTransform u;
  SignalTransform y;
};

/// Removes the least-squares polynomial trend of u and of y: min over c of sum_t w_t^2 (x_t - c_0 -
/// c_1 t)^2.
/// @param order 0 removes the mean, 1 the straight line.
/// Samples of weight 0 take no part in the fit of either signal; a missing y_t that is NaN stays
/// NaN.
/// @throws Error for an invalid record, another order, or fewer than order + 1 present samples.
[[nodiscard]] Standardised detrend(const Record& record, int order = 0);

/// z_t = (x_t - mean) / std for u and y, mean = sum w_t^2 x_t / sum w_t^2, std^2 = sum w_t^2 (x_t -
/// mean)^2 / sum w_t^2.
/// @throws Error for an invalid record or a signal that is constant over the present samples.
[[nodiscard]] Standardised standardise(const Record& record);

/// The record in its original units.
[[nodiscard]] Record undo(const Standardised& standardised);

}  // namespace blockid
