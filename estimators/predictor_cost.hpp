// The bridge to Ceres: residuals as cost functions.
#pragma once

#include <blockid/estimators/residual_function.hpp>
#include <blockid/estimators/static_parameters.hpp>

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// What Ceres sees of the N residuals; cost, gradient and Gauss-Newton matrix are the same in all three.
enum class Handover {
  full,        ///< N residuals, the Jacobian written into Ceres's own buffer
  compressed,  ///< P + 1 residuals from J'J, J'r, r'r; O(P^2) memory
  triangle     ///< P + 1 residuals from a QR triangle; O(P^2) memory, condition number not squared
};

/// r(p) of a residual function as one parameter block of P = unknown_count() numbers.
///
/// Evaluate() returns false for residuals that are not finite, so that Levenberg-Marquardt rejects the step; for huge
/// ones also where derivatives are not.
/// Without a Jacobian the compressed residuals are [sqrt(r'r), 0, ..., 0].
class PredictorCost final : public ceres::CostFunction {
 public:
  PredictorCost(const ResidualFunction& function, Handover handover);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  /// Whether derivatives behind so large a sum are not finite.
  bool overflows(const Eigen::VectorXd& p, double sum_of_squares) const;

  const ResidualFunction& function_;
  Handover handover_;
};

/// r(q, c*(q)) with the affine parameters c eliminated: variable projection with Kaufman's approximation.
///
/// One parameter block of the remaining Q unknowns q, Q + 1 residuals. At each q the affine parameters are the
/// least-squares solution c*(q); the Jacobian is that of the residuals projected off dr/dc, a Schur complement of J'J.
/// Source: Golub and Pereyra 1973; Kaufman 1975.
class EliminatedCost final : public ceres::CostFunction {
 public:
  /// eliminated: ascending indices into the unknowns, in which the residuals are affine. start: (P,) all unknowns.
  /// local: bases of which the parameters that the data hardly touch keep the value that they have in `start`.
  EliminatedCost(const ResidualFunction& function, std::vector<Index> eliminated, Eigen::VectorXd start,
                 std::vector<LocalBasis> local = {});

  const std::vector<Index>& remaining() const { return remaining_; }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  /// (P,) all unknowns for q, the eliminated ones at c*(q); empty when not finite.
  Eigen::VectorXd complete(const Eigen::VectorXd& q) const;

 private:
  struct Solved;
  bool solve(const Eigen::VectorXd& q, Solved& solved) const;
  double reduced_cost(const Solved& solved) const;

  const ResidualFunction& function_;
  std::vector<Index> eliminated_;
  std::vector<Index> remaining_;
  std::vector<LocalBasis> local_;
  // Ceres asks for the Jacobian where it has just asked for the cost: c* is kept for that.
  mutable Eigen::VectorXd last_;
  // False as long as last_ is the caller's start, whose affine parameters are not c*.
  mutable bool last_is_solved_ = false;
};

}  // namespace blockid
