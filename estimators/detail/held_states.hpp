// States of a continuous-time filter over a whole sampled signal.
#pragma once

#include <blockid/blocks/hold.hpp>

#include <Eigen/Core>

namespace blockid::detail {

using Index = Eigen::Index;

/// A sampled signal as it runs between its samples: coefficients of the spline through all of them (the samples
/// themselves for zero- and first-order hold), (N + 2 reach,). With a period the spline is periodic.
struct HeldSignal {
  Eigen::VectorXd coefficients;
  Hold hold = Hold::first_order;
  Index reach = 0;
  Index count = 0;
};
/// period 0: not periodic. Throws Error when there are too few samples for the spline.
HeldSignal held_signal(const Eigen::VectorXd& samples, Hold hold, Index period = 0);

/// x' = A x + B v, sample by sample, exact for the held signal v.
class HeldStates {
 public:
  /// At rest at the first sample, or, for a positive period, in the steady state of a v that repeats.
  HeldStates(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const HeldSignal& signal, double sample_time_s,
             Index period = 0);

  /// Another state at the first sample.
  void start_at(const Eigen::VectorXd& x) { x_ = x; }
  /// (n,) at the present sample.
  const Eigen::VectorXd& state() const { return x_; }
  /// On to the next sample; at most count - 1 times.
  void step();

 private:
  /// x(0) = (I - Phi^period)^-1 x(period), x(period) from rest.
  void start_periodic(Index period);

  const HeldSignal* signal_;
  Eigen::MatrixXd transition_;
  /// (n, taps), oldest coefficient first.
  Eigen::MatrixXd gains_;
  Eigen::VectorXd x_;
  Eigen::VectorXd next_;
  Index t_ = 0;
};

}  // namespace blockid::detail
