// The test along a record, window by window, each with the response to its past.
#pragma once

#include <blockid/validation/verdict.hpp>

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace blockid {

struct WindowPlan {
  Eigen::Index count = 200;    ///< samples of w in a window
  Eigen::Index step = 50;      ///< from window to window
  Eigen::Index past = -1;      ///< samples of v before it, fewer at the start of the record; -1 for all that fit
  Eigen::Index longest = 500;  ///< most samples of v in one programme: its time grows with the third power
};

/// What one window says, and what the record from its start to the window's end says.
struct WindowedVerdict {
  Eigen::Index first = 0;  ///< from zero
  Eigen::Index past = 0;
  UncertaintyVerdict window;                 ///< h and certificate are dropped
  std::optional<UncertaintyVerdict> record;  ///< empty beyond plan.longest samples
};

/// The verdicts of windows first = 0, step, 2 step, ... of a record that starts at rest.
///
/// A window sees only its own samples of w and leaves Delta free to explain them from the recorded past; the whole
/// record up to the same sample is a sharper test. Without the past, windows after the first contradict every Delta.
/// shape (N,) of the noise or empty. Throws Error for a record shorter than a window, a plan with sizes below 1 or a
/// past that does not fit into plan.longest, and as judge_uncertainty() does.
/// Source: Crowder and de Callafon, figure 3, with the initial conditions that their section III asks for.
std::vector<WindowedVerdict> windowed_test(const Eigen::VectorXd& v, const Eigen::VectorXd& w, double noise_bound,
                                           const WindowPlan& plan, const VerdictOptions& options = {},
                                           const Eigen::VectorXd& shape = {});

}  // namespace blockid
