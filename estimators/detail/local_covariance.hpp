// The covariance of the unknowns of any residual function.
#pragma once

#include <blockid/estimators/refit.hpp>
#include <blockid/estimators/residual_function.hpp>

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace blockid::detail {

/// (batches, P) sums of r_t J_t over batches of samples.
using ScoreBatches = std::function<Eigen::MatrixXd()>;

/// s^2 (J'J)^+ at p over the unknowns that are not `fixed` (ascending); reported for the first names.size() of them,
/// the parameters. With `scores` the sandwich.
Covariance local_covariance(const ResidualFunction& residuals, const Eigen::VectorXd& p,
                            const std::vector<Index>& fixed, const std::vector<std::string>& names,
                            const ScoreBatches& scores = {});

/// Some directions are undetermined, or nearly so.
inline bool is_poor(const Covariance& covariance) {
  /// Condition number of the scaled Jacobian from which a minimum is called ill conditioned.
  constexpr double kIllConditioned = 1e10;
  return covariance.rank < covariance.free_count || covariance.condition > kIllConditioned;
}

}  // namespace blockid::detail
