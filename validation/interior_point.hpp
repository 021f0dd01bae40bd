// The interior-point method of the closed-loop programmes: minimises the last variable over a cone of symmetric
// matrices and of rows.
#pragma once

#include <blockid/validation/dense_product.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

enum class ProgrammeStatus {
  converged,       ///< the gap is below the tolerance
  target_reached,  ///< the value or the lower bound passed the target
  stalled,         ///< rounding ended the iteration: the certified gap is what it is
  max_iterations,
  cap_exceeded,  ///< no alpha up to the cap explains the data; lower_bound proves it
};

struct ProgrammeOptions {
  double tolerance = 1e-7;  ///< relative gap of value and lower bound
  int max_iterations = 100;
  double alpha_cap = 1024.0;  ///< where smallest_alpha() gives up
};

/// Symmetric blocks and vectors; inside the cone when all blocks are positive definite and all vectors positive.
struct Cone {
  std::vector<Eigen::MatrixXd> blocks;
  std::vector<Eigen::VectorXd> rows;
};

/// min y_last such that Z(y) = Z_0 + sum_i y_i A_i is in the cone; the variables are of size one.
class ConicForm {
 public:
  ConicForm() = default;
  ConicForm(const ConicForm&) = delete;
  ConicForm& operator=(const ConicForm&) = delete;
  virtual ~ConicForm() = default;

  /// Z(y).
  virtual Cone slack(const Eigen::VectorXd& y) const = 0;
  /// sum_i dy_i A_i.
  virtual Cone slack_direction(const Eigen::VectorXd& dy) const = 0;
  /// g_i = <A_i, x>; the blocks of x need not be symmetric.
  virtual Eigen::VectorXd adjoint(const Cone& x) const = 0;
  /// S_ij = <A_i, X A_j W>, symmetric; rows are taken as diagonal matrices.
  virtual Eigen::MatrixXd normal_matrix(const Cone& x, const Cone& w) const = 0;
  /// A lower bound of the minimum that holds for every x in the cone.
  virtual double bound(const Cone& x) const = 0;
};

/// Primal-dual method with the HKM direction and Mehrotra's predictor and corrector. y stays feasible: Z is recomputed
/// from it.
/// Source: Helmberg, Rendl, Vanderbei, Wolkowicz, "An interior-point method for semidefinite programming", 1996.
class InteriorPoint {
 public:
  /// Keeps a reference to the form. Z(y) must be inside the cone.
  InteriorPoint(const ConicForm& form, Eigen::VectorXd y);

  const Eigen::VectorXd& y() const { return y_; }
  double value() const { return y_[y_.size() - 1]; }
  /// The largest bound so far, and the dual point that proves it.
  double bound() const { return bound_; }
  const Cone& certificate() const { return best_; }

  /// One step. False when rounding lets it go no further.
  bool iterate();

 private:
  struct Factors {
    std::vector<CholeskyFactor> blocks;
  };

  static bool factorise(const Cone& point, Factors& factors);
  static double step_length(const Cone& point, const Factors& factors, const Cone& direction);
  double order() const;
  Cone dual_direction(double center, const Cone& dz, const std::vector<Eigen::MatrixXd>& turned,
                      const Cone* second) const;
  std::vector<Eigen::MatrixXd> times_inverse(const Cone& dz) const;
  void set_inverse();
  bool set_normal_matrix();
  Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  bool move(const Eigen::VectorXd& step, const Cone& dz, const Cone& dx);
  void update_bound();

  const ConicForm& form_;
  Eigen::VectorXd y_;
  Cone z_;
  Cone x_dual_;
  Cone inverse_;
  Factors z_factors_;
  Factors x_factors_;
  Eigen::MatrixXd normal_;
  Eigen::VectorXd scale_;
  CholeskyFactor normal_factors_;
  Cone best_;
  double bound_ = 0.0;
};

struct ProgrammeRun {
  ProgrammeStatus status = ProgrammeStatus::max_iterations;
  int iterations = 0;
};

/// Iterates until the relative gap is below the tolerance, the value is at most `zero`, or, for a target of at least 0,
/// the value is at most the target or the bound above it.
ProgrammeRun run(InteriorPoint& method, const ProgrammeOptions& options, double target, double zero);

}  // namespace blockid
