#include <blockid/estimators/detail/held_states.hpp>

#include <blockid/blocks/detail/hold.hpp>

#include <Eigen/LU>

namespace blockid::detail {
namespace {

/// Samples put before and behind a period, beyond which a spline forgets its ends to 1e-16 at every degree.
constexpr Index kMargin = 100;

/// Samples -kMargin .. N - 1 + kMargin of a signal that repeats.
Eigen::VectorXd extended(const Eigen::VectorXd& samples, Index period) {
  const Index count = samples.size();
  return Eigen::VectorXd::NullaryExpr(count + 2 * kMargin, [&](Index k) {
    Index t = k - kMargin;
    if (t < 0) t = period - 1 - (-t - 1) % period;
    while (t >= count) t -= period;
    return samples[t];
  });
}

}  // namespace

HeldSignal held_signal(const Eigen::VectorXd& samples, Hold hold, Index period) {
  const Index reach = hold_pieces(hold).reach;
  const Index count = samples.size();
  if (period == 0 || reach == 0) return {interpolation_coefficients(samples, hold), hold, reach, count};
  const Eigen::VectorXd all = interpolation_coefficients(extended(samples, period), hold);
  return {all.segment(kMargin, count + 2 * reach), hold, reach, count};
}

HeldStates::HeldStates(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const HeldSignal& signal,
                       double sample_time_s, Index period)
    : signal_(&signal), x_(Eigen::VectorXd::Zero(a.rows())), next_(a.rows()) {
  SampledSystem<double> system = sampled_system<double>(a, b, {sample_time_s, signal.hold});
  transition_ = std::move(system.transition);
  gains_ = system.gains.rowwise().reverse();
  if (period > 0) start_periodic(period);
}

void HeldStates::step() {
  const Index newest = t_ + 1 + 2 * signal_->reach;
  next_.noalias() = transition_ * x_;
  next_.noalias() += gains_ * signal_->coefficients.segment(newest + 1 - gains_.cols(), gains_.cols());
  x_.swap(next_);
  ++t_;
}

void HeldStates::start_periodic(Index period) {
  const Index n = x_.size();
  // The last step of a period needs the first coefficient of the next: one more step over what repeats.
  for (Index t = 0; t + 1 < period; ++t) step();
  const Index first = t_ + 1 + 2 * signal_->reach + 1 - gains_.cols();
  Eigen::VectorXd window(gains_.cols());
  for (Index k = 0; k < window.size(); ++k) {
    const Index place = first + k;
    window[k] = signal_->coefficients[place < signal_->coefficients.size() ? place : place - period];
  }
  const Eigen::VectorXd end = transition_ * x_ + gains_ * window;
  Eigen::MatrixXd power = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd square = transition_;
  for (Index rest = period; rest > 0; rest /= 2) {
    if (rest % 2 == 1) power = (power * square).eval();
    square = (square * square).eval();
  }
  x_ = (Eigen::MatrixXd::Identity(n, n) - power).partialPivLu().solve(end);
  t_ = 0;
}

}  // namespace blockid::detail
