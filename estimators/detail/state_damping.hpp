// Keeps a search from throwing initial states about that the data hardly determine.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/estimators/predictor.hpp>

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <vector>

namespace blockid::detail {

/// (n_x,) mean squares of the chain's states while it runs from rest over u.
Eigen::VectorXd state_powers(const AnyBlock& chain, const Eigen::VectorXd& theta, const Eigen::VectorXd& u);

/// Rows of value zero with the derivative `weight` by one unknown each: they add weight^2 to the diagonal of the
/// Gauss-Newton matrix and nothing to cost and gradient.
///
/// Levenberg-Marquardt measures steps by the columns of the Jacobian: an unknown of small effect, such as a state that
/// has died away within the warm-up, may move far, and drives static blocks out of where they are nearly linear. With
/// weight^2 = rmse^2 / mean square of the state a step is that of an estimate with the prior that the state is as large
/// as it is later; the minimum is where it was. The weight falls with the progress of the search, so that its end is as
/// fast as without.
class StateDamping final : public ceres::CostFunction {
 public:
  /// shown: the unknowns of the predictor that Ceres sees, ascending. rmse: of the residuals at the start.
  StateDamping(const Predictor& predictor, const Eigen::VectorXd& p, const std::vector<Index>& shown, double rmse);

  /// Whether there is anything to damp.
  bool empty() const { return rows_.empty(); }

  /// After a step that led to `rmse` and took the share `decrease` off the cost.
  void follow(double rmse, double decrease);

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override;

 private:
  struct Row {
    Index position;
    /// One over the root mean square of the state.
    double inverse_size;
  };
  std::vector<Row> rows_;
  double share_;
  double weight_;
};

}  // namespace blockid::detail
