// The delay of the input of a continuous-time model.
#pragma once

#include <blockid/estimators/continuous_fit.hpp>

#include <vector>

namespace blockid {

/// The outputs of each record from sample `first` on beside the inputs `delay` samples before them. Throws Error unless
/// 0 <= delay <= first, and for records of no more than `first` samples.
DataSet with_late_input(const DataSet& data, Index delay, Index first);

/// A fit with one delay.
struct DelayTrial {
  Index delay = 0;
  ContinuousFit fit;
  /// IQ = sum (y - yhat)^2 and IV = sum |y - yhat|, yhat the simulation with the start of the options. Infinite where
  /// it is not finite.
  double squared_error = 0.0;
  double absolute_error = 0.0;
};

/// Fits with delays 0 .. longest to the same outputs, those from sample `longest` on; element d belongs to delay d.
/// The criteria are those of Janiszowski 1999, (11), over the simulation instead of the prediction. Throws Error as
/// fit_continuous() does.
std::vector<DelayTrial> delay_table(const DataSet& data, const RationalBasis& basis,
                                    const ContinuousFitOptions& options, Index longest);

/// The trial of least squared error.
const DelayTrial& best_delay(const std::vector<DelayTrial>& table);

}  // namespace blockid
