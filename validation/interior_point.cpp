#include <blockid/validation/interior_point.hpp>

#include <blockid/blocks/detail/infinity.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

using detail::kInfinity;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How far a step goes towards the boundary of the cone.
constexpr double kStepFraction = 0.95;
constexpr int kLanczosSteps = 40;
/// Negative powers of ten that are added to the scaled normal matrix when it is not positive definite.
constexpr int kFirstRidge = 15;
constexpr int kLastRidge = 6;
/// Near the end, when this many iterations gain less than a tenth of the gap, rounding has the last word.
constexpr int kPatience = 4;
constexpr double kNearTheEnd = 1e-5;

double inner(const Cone& a, const Cone& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.blocks.size(); ++i) sum += a.blocks[i].cwiseProduct(b.blocks[i]).sum();
  for (std::size_t i = 0; i < a.rows.size(); ++i) sum += a.rows[i].dot(b.rows[i]);
  return sum;
}

Cone combination(const Cone& a, double step, const Cone& b) {
  Cone c = a;
  for (std::size_t i = 0; i < a.blocks.size(); ++i) c.blocks[i] += step * b.blocks[i];
  for (std::size_t i = 0; i < a.rows.size(); ++i) c.rows[i] += step * b.rows[i];
  return c;
}

/// A lower estimate of the smallest eigenvalue of L^-1 D L^-T, P = L L', by the Lanczos iteration.
double smallest_relative_eigenvalue(const CholeskyFactor& p, const MatrixXd& d) {
  const Index n = d.rows();
  const Index steps = std::min<Index>(n, kLanczosSteps);
  MatrixXd basis(n, steps);
  const auto lower = p.lower().triangularView<Eigen::Lower>();
  VectorXd diagonal(steps);
  VectorXd beside(steps);
  VectorXd q = VectorXd::NullaryExpr(
      n, [](Index t) { return 1.0 + 0.5 * std::sin(static_cast<double>(t) * static_cast<double>(t)); });
  q.normalize();
  double estimate = 0.0;
  Eigen::SelfAdjointEigenSolver<MatrixXd> ritz;
  for (Index k = 0; k < steps; ++k) {
    basis.col(k) = q;
    const VectorXd solved = lower.transpose().solve(q);
    q = d.selfadjointView<Eigen::Lower>() * solved;
    lower.solveInPlace(q);
    diagonal[k] = basis.col(k).dot(q);
    for (int pass = 0; pass < 2; ++pass) {
      const VectorXd along = basis.leftCols(k + 1).transpose() * q;
      q -= basis.leftCols(k + 1) * along;
    }
    beside[k] = q.norm();
    ritz.computeFromTridiagonal(diagonal.head(k + 1), beside.head(k));
    const double error = beside[k] * std::abs(ritz.eigenvectors()(k, 0));
    estimate = ritz.eigenvalues()[0] - error;
    if (error <= 1e-2 * std::abs(ritz.eigenvalues()[0]) || beside[k] == 0.0) break;
    q /= beside[k];
  }
  return estimate;
}

}  // namespace

InteriorPoint::InteriorPoint(const ConicForm& form, VectorXd y) : form_(form), y_(std::move(y)), z_(form_.slack(y_)) {
  factorise(z_, z_factors_);
  const double mu = 10.0 * value() / order();
  set_inverse();
  x_dual_ = inverse_;
  for (MatrixXd& block : x_dual_.blocks) block *= mu;
  for (VectorXd& row : x_dual_.rows) row *= mu;
  factorise(x_dual_, x_factors_);
  update_bound();
}

bool InteriorPoint::iterate() {
  set_inverse();
  if (!set_normal_matrix()) return false;
  const double mu = inner(x_dual_, z_) / order();
  const VectorXd objective = VectorXd::Unit(y_.size(), y_.size() - 1);

  const Cone dz_a = form_.slack_direction(solve(-objective));
  const std::vector<MatrixXd> turned_a = times_inverse(dz_a);
  const Cone dx_a = dual_direction(0.0, dz_a, turned_a, nullptr);
  const double primal = step_length(x_dual_, x_factors_, dx_a);
  const double dual = step_length(z_, z_factors_, dz_a);
  const double mu_a = inner(combination(x_dual_, primal, dx_a), combination(z_, dual, dz_a)) / order();
  const double sigma = std::clamp(std::pow(std::max(mu_a, 0.0) / mu, 3.0), 1e-6, 1.0);

  Cone second = dx_a;
  for (std::size_t i = 0; i < second.blocks.size(); ++i) second.blocks[i] = product(dx_a.blocks[i], turned_a[i]);
  for (std::size_t i = 0; i < second.rows.size(); ++i) {
    second.rows[i] = dx_a.rows[i].cwiseProduct(dz_a.rows[i]).cwiseProduct(inverse_.rows[i]);
  }
  const VectorXd step = solve(-objective + sigma * mu * form_.adjoint(inverse_) - form_.adjoint(second));
  const Cone dz = form_.slack_direction(step);
  const Cone dx = dual_direction(sigma * mu, dz, times_inverse(dz), &second);
  return move(step, dz, dx);
}

/// False unless the point is inside the cone.
bool InteriorPoint::factorise(const Cone& point, Factors& factors) {
  for (const VectorXd& row : point.rows) {
    if (!(row.minCoeff() > 0.0)) return false;
  }
  factors.blocks.resize(point.blocks.size());
  for (std::size_t i = 0; i < point.blocks.size(); ++i) {
    factors.blocks[i] = CholeskyFactor(point.blocks[i]);
    if (!factors.blocks[i].positive()) return false;
  }
  return true;
}

/// kStepFraction of the way from `point` along `direction` to the boundary, at most 1.
double InteriorPoint::step_length(const Cone& point, const Factors& factors, const Cone& direction) {
  double most_negative = 0.0;
  for (std::size_t i = 0; i < point.rows.size(); ++i) {
    most_negative = std::min(most_negative, direction.rows[i].cwiseQuotient(point.rows[i]).minCoeff());
  }
  for (std::size_t i = 0; i < point.blocks.size(); ++i) {
    most_negative = std::min(most_negative, smallest_relative_eigenvalue(factors.blocks[i], direction.blocks[i]));
  }
  return most_negative < 0.0 ? std::min(1.0, -kStepFraction / most_negative) : 1.0;
}

double InteriorPoint::order() const {
  Index order = 0;
  for (const MatrixXd& block : z_.blocks) order += block.rows();
  for (const VectorXd& row : z_.rows) order += row.size();
  return static_cast<double>(order);
}

/// dZ Z^-1.
std::vector<MatrixXd> InteriorPoint::times_inverse(const Cone& dz) const {
  std::vector<MatrixXd> turned(dz.blocks.size());
  for (std::size_t i = 0; i < turned.size(); ++i) turned[i] = product(dz.blocks[i], inverse_.blocks[i]);
  return turned;
}

/// sigma mu Z^-1 - X - sym(X dZ Z^-1) - sym(second).
Cone InteriorPoint::dual_direction(double center, const Cone& dz, const std::vector<MatrixXd>& turned,
                                   const Cone* second) const {
  Cone dx = dz;
  for (std::size_t i = 0; i < dx.blocks.size(); ++i) {
    MatrixXd m = product(x_dual_.blocks[i], turned[i]);
    if (second != nullptr) m += second->blocks[i];
    dx.blocks[i] = center * inverse_.blocks[i] - x_dual_.blocks[i] - 0.5 * (m + m.transpose());
  }
  for (std::size_t i = 0; i < dx.rows.size(); ++i) {
    VectorXd r = x_dual_.rows[i].cwiseProduct(dz.rows[i]).cwiseProduct(inverse_.rows[i]);
    if (second != nullptr) r += second->rows[i];
    dx.rows[i] = center * inverse_.rows[i] - x_dual_.rows[i] - r;
  }
  return dx;
}

void InteriorPoint::set_inverse() {
  inverse_.blocks.resize(z_.blocks.size());
  inverse_.rows.resize(z_.rows.size());
  for (std::size_t i = 0; i < z_.blocks.size(); ++i) inverse_.blocks[i] = z_factors_.blocks[i].inverse();
  for (std::size_t i = 0; i < z_.rows.size(); ++i) inverse_.rows[i] = z_.rows[i].cwiseInverse();
}

bool InteriorPoint::set_normal_matrix() {
  normal_ = form_.normal_matrix(x_dual_, inverse_);
  if (!(normal_.diagonal().minCoeff() > 0.0)) return false;
  scale_ = normal_.diagonal().cwiseSqrt().cwiseInverse();
  normal_ = scale_.asDiagonal() * normal_ * scale_.asDiagonal();
  normal_factors_ = CholeskyFactor(normal_);
  for (int decade = kFirstRidge; decade >= kLastRidge && !normal_factors_.positive(); --decade) {
    MatrixXd raised = normal_;
    raised.diagonal().array() += std::pow(10.0, -decade);
    normal_factors_ = CholeskyFactor(std::move(raised));
  }
  return normal_factors_.positive();
}

VectorXd InteriorPoint::solve(const VectorXd& right) const {
  const VectorXd scaled = scale_.cwiseProduct(right);
  VectorXd y = normal_factors_.solve(scaled);
  y += normal_factors_.solve(scaled - normal_ * y);
  return scale_.cwiseProduct(y);
}

/// Steps back until both points are inside their cones.
bool InteriorPoint::move(const VectorXd& step, const Cone& dz, const Cone& dx) {
  if (!step.allFinite()) return false;
  Factors factors;
  double dual = step_length(z_, z_factors_, dz);
  double primal = step_length(x_dual_, x_factors_, dx);
  Cone z;
  for (int tries = 0;; ++tries, dual *= 0.7) {
    if (tries == 10) return false;
    z = form_.slack(y_ + dual * step);
    if (factorise(z, factors)) break;
  }
  y_ += dual * step;
  z_ = std::move(z);
  z_factors_ = std::move(factors);
  Cone x;
  for (int tries = 0;; ++tries, primal *= 0.7) {
    if (tries == 10) return false;
    x = combination(x_dual_, primal, dx);
    if (factorise(x, x_factors_)) break;
  }
  x_dual_ = std::move(x);
  update_bound();
  return true;
}

void InteriorPoint::update_bound() {
  const double bound = form_.bound(x_dual_);
  if (bound < bound_ || (bound == bound_ && !best_.blocks.empty())) return;
  bound_ = bound;
  best_ = x_dual_;
}

ProgrammeRun run(InteriorPoint& method, const ProgrammeOptions& options, double target, double zero) {
  ProgrammeRun result;
  double gap_before = kInfinity;
  for (;; ++result.iterations) {
    const double value = method.value();
    const double gap = value - method.bound();
    if (value <= target || method.bound() > target) {
      if (target >= 0.0) {
        result.status = ProgrammeStatus::target_reached;
        return result;
      }
    }
    if (gap <= options.tolerance * value || value <= zero) {
      result.status = ProgrammeStatus::converged;
      return result;
    }
    if (result.iterations == options.max_iterations) return result;
    const bool judged = result.iterations % kPatience == 0;
    const bool no_gain = judged && gap < kNearTheEnd * value && gap > 0.9 * gap_before;
    if (judged) gap_before = gap;
    if (no_gain || !method.iterate()) {
      result.status = ProgrammeStatus::stalled;
      return result;
    }
  }
}

}  // namespace blockid
