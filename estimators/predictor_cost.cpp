#include <blockid/estimators/predictor_cost.hpp>

#include <blockid/estimators/detail/gram_parts.hpp>
#include <blockid/estimators/detail/row_major.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

using detail::RowMajor;

/// Share of the cost before the least-squares step below which the cost after it is computed anew from residuals.
constexpr double kCancellation = 1e-6;

/// Sum of squares above which derivatives are looked at before a step is taken: Ceres writes to stderr when they
/// overflow behind a step that it has accepted.
constexpr double kHuge = 1e100;

/// Writes compressed rows into Ceres's buffers.
void hand_over(const CompressedRows& rows, double* residuals, double* jacobian) {
  Eigen::Map<Eigen::VectorXd>(residuals, rows.residuals.size()) = rows.residuals;
  Eigen::Map<RowMajor>(jacobian, rows.jacobian.rows(), rows.jacobian.cols()) = rows.jacobian;
}

bool hand_over_cost(double sum_of_squares, double* residuals, Index count) {
  if (!std::isfinite(sum_of_squares)) return false;
  std::fill(residuals, residuals + count, 0.0);
  residuals[0] = std::sqrt(sum_of_squares);
  return true;
}

}  // namespace

PredictorCost::PredictorCost(const ResidualFunction& function, Handover handover)
    : function_(function), handover_(handover) {
  const Index unknowns = function.unknown_count();
  mutable_parameter_block_sizes()->push_back(static_cast<int>(unknowns));
  set_num_residuals(static_cast<int>(handover == Handover::full ? function.sample_count() : unknowns + 1));
}

bool PredictorCost::overflows(const Eigen::VectorXd& p, double sum_of_squares) const {
  if (sum_of_squares <= kHuge) return false;
  NormalEquations sums(function_.unknown_count() + 1);
  return !function_.accumulate(p, sums);
}

bool PredictorCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Index unknowns = function_.unknown_count();
  const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(parameters[0], unknowns);
  double* jacobian = jacobians == nullptr ? nullptr : jacobians[0];
  if (handover_ == Handover::full) {
    if (jacobian != nullptr) return function_.jacobian(p, residuals, jacobian);
    if (!function_.residuals(p, residuals)) return false;
    return !overflows(p, Eigen::Map<const Eigen::VectorXd>(residuals, num_residuals()).squaredNorm());
  }
  if (jacobian == nullptr) {
    const double sum = function_.sum_of_squares(p);
    return !overflows(p, sum) && hand_over_cost(sum, residuals, unknowns + 1);
  }
  if (handover_ == Handover::triangle) {
    QrTriangle sums(unknowns + 1);
    if (!function_.accumulate(p, sums)) return false;
    hand_over(compress(sums), residuals, jacobian);
    return true;
  }
  NormalEquations sums(unknowns + 1);
  if (!function_.accumulate(p, sums)) return false;
  hand_over(compress(sums.gram()), residuals, jacobian);
  return true;
}

namespace {

/// The bases without the parameters that are not listed; `listed` ascending.
std::vector<LocalBasis> restricted(std::vector<LocalBasis> bases, const std::vector<Index>& listed) {
  for (LocalBasis& basis : bases) {
    std::erase_if(basis, [&](Index k) { return !std::binary_search(listed.begin(), listed.end(), k); });
  }
  return bases;
}

}  // namespace

/// Everything that one evaluation at q knows.
struct EliminatedCost::Solved {
  Eigen::VectorXd p;
  Eigen::MatrixXd gram;
  LinearSolution affine;
};

EliminatedCost::EliminatedCost(const ResidualFunction& function, std::vector<Index> eliminated, Eigen::VectorXd start,
                               std::vector<LocalBasis> local)
    : function_(function),
      eliminated_(std::move(eliminated)),
      remaining_(detail::complement(eliminated_, function.unknown_count())),
      local_(restricted(std::move(local), eliminated_)),
      last_(std::move(start)) {
  mutable_parameter_block_sizes()->push_back(static_cast<int>(remaining_.size()));
  set_num_residuals(static_cast<int>(remaining_.size()) + 1);
}

/// Sums at (q, c) for the last known c, and the least-squares step of c from there.
bool EliminatedCost::solve(const Eigen::VectorXd& q, Solved& solved) const {
  solved.p = last_;
  solved.p(remaining_) = q;
  NormalEquations sums(function_.unknown_count() + 1);
  if (!function_.accumulate(solved.p, sums)) return false;
  solved.gram = sums.gram();
  detail::leave_out(detail::untouched_parameters(solved.gram, local_), solved.gram);
  solved.affine = solve_least_squares(detail::gram_of(solved.gram, eliminated_));
  return true;
}

/// |r(q, c*)|^2 where last_ = (q, c*).
double EliminatedCost::reduced_cost(const Solved& solved) const {
  const double cost = solved.affine.residual_sum_of_squares;
  const double before = solved.gram(solved.gram.rows() - 1, solved.gram.cols() - 1);
  // A small difference of large numbers is rounding, at unstable filters nothing else: it must not pass for a good fit.
  return cost > kCancellation * before ? cost : function_.sum_of_squares(last_);
}

bool EliminatedCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Index count = static_cast<Index>(remaining_.size());
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(parameters[0], count);
  const bool known = last_is_solved_ && last_(remaining_) == q;
  Solved solved;
  if (!solve(q, solved)) return false;
  const bool wants_jacobian = jacobians != nullptr && jacobians[0] != nullptr;
  if (!wants_jacobian || !known) {
    last_ = solved.p;
    last_(eliminated_) -= solved.affine.x;
    last_is_solved_ = true;
    if (!wants_jacobian) return hand_over_cost(reduced_cost(solved), residuals, count + 1);
    if (!solve(q, solved)) return false;
  }
  // Projection off dr/dc: G_rr - G_rc G_cc^+ G_cr over the remaining unknowns and the residual.
  std::vector<Index> kept = remaining_;
  kept.push_back(function_.unknown_count());
  const Eigen::MatrixXd coupling = solved.gram(eliminated_, kept);
  const PseudoInverse inverse = scaled_pseudo_inverse(solved.gram(eliminated_, eliminated_));
  const Eigen::MatrixXd reduced = solved.gram(kept, kept) - coupling.transpose() * inverse.matrix * coupling;
  if (!reduced.allFinite()) return false;
  hand_over(compress(0.5 * (reduced + reduced.transpose())), residuals, jacobians[0]);
  return true;
}

Eigen::VectorXd EliminatedCost::complete(const Eigen::VectorXd& q) const {
  Solved solved;
  if (!solve(q, solved)) return {};
  Eigen::VectorXd p = solved.p;
  p(eliminated_) -= solved.affine.x;
  return p;
}

}  // namespace blockid
