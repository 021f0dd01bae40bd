#include <blockid/validation/uncertainty_programme.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/hankel_products.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Llt = Eigen::LLT<MatrixXd>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<double, 2> kSigns = {1.0, -1.0};
/// How far a step goes towards the boundary of the cone.
constexpr double kStepFraction = 0.95;
/// A noise bound below this times max|w| is zero.
constexpr double kZeroNoise = 1e-9;
constexpr int kLanczosSteps = 40;
/// First alpha in units of max|w| / max|v| for which smallest_alpha() looks for an inner point.
constexpr double kFirstAlpha = 4.0;
/// Near the end, when this many iterations gain less than a tenth of the gap, rounding has the last word.
constexpr int kPatience = 4;
constexpr double kNearTheEnd = 1e-5;

enum class Mode { alpha, gamma };

/// Symmetric blocks for alpha I + K, alpha I - K, vectors for gamma - (w - A h), gamma + (w - A h).
struct Cone {
  std::array<MatrixXd, 2> blocks;
  std::array<VectorXd, 2> rows;
};

double inner(const Cone& a, const Cone& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 2; ++i) sum += a.blocks[i].cwiseProduct(b.blocks[i]).sum() + a.rows[i].dot(b.rows[i]);
  return sum;
}

Cone combination(const Cone& a, double step, const Cone& b) {
  Cone c = a;
  for (std::size_t i = 0; i < 2; ++i) {
    c.blocks[i] += step * b.blocks[i];
    c.rows[i] += step * b.rows[i];
  }
  return c;
}

struct Factors {
  std::array<Llt, 2> blocks;
};

/// False unless the point is inside the cone.
bool factorise(const Cone& point, Factors& factors) {
  for (std::size_t i = 0; i < 2; ++i) {
    if (!(point.rows[i].minCoeff() > 0.0)) return false;
    factors.blocks[i].compute(point.blocks[i]);
    if (factors.blocks[i].info() != Eigen::Success) return false;
  }
  return true;
}

/// A lower estimate of the smallest eigenvalue of L^-1 D L^-T, P = L L', by the Lanczos iteration.
double smallest_relative_eigenvalue(const Llt& p, const MatrixXd& d) {
  const Index n = d.rows();
  const Index steps = std::min<Index>(n, kLanczosSteps);
  MatrixXd basis(n, steps);
  VectorXd diagonal(steps);
  VectorXd beside(steps);
  VectorXd q = VectorXd::NullaryExpr(
      n, [](Index t) { return 1.0 + 0.5 * std::sin(static_cast<double>(t) * static_cast<double>(t)); });
  q.normalize();
  double estimate = 0.0;
  Eigen::SelfAdjointEigenSolver<MatrixXd> ritz;
  for (Index k = 0; k < steps; ++k) {
    basis.col(k) = q;
    const VectorXd solved = p.matrixU().solve(q);
    q = d.selfadjointView<Eigen::Lower>() * solved;
    p.matrixL().solveInPlace(q);
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

/// kStepFraction of the way from `point` along `direction` to the boundary, at most 1.
double step_length(const Cone& point, const Factors& factors, const Cone& direction) {
  double most_negative = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    most_negative = std::min(most_negative, direction.rows[i].cwiseQuotient(point.rows[i]).minCoeff());
    most_negative = std::min(most_negative, smallest_relative_eigenvalue(factors.blocks[i], direction.blocks[i]));
  }
  return most_negative < 0.0 ? std::min(1.0, -kStepFraction / most_negative) : 1.0;
}

struct Sums {
  double gain = 0.0;      // lambda'w
  double absolute = 0.0;  // |lambda|_1
  double weight = 0.0;    // tr X_1 + tr X_2 + |residual|_1
};

Sums certificate_sums(const UncertaintyProgramme& programme, const DualCertificate& certificate) {
  const VectorXd residual =
      hankel_adjoint(certificate.x2 - certificate.x1) - programme.a.transpose() * certificate.lambda;
  return {certificate.lambda.dot(programme.w), certificate.lambda.lpNorm<1>(),
          certificate.x1.trace() + certificate.x2.trace() + residual.lpNorm<1>()};
}

double alpha_bound(const Sums& sums, double gamma) {
  return std::max(0.0, (sums.gain - gamma * sums.absolute) / sums.weight);
}

double gamma_bound(const Sums& sums, double alpha) {
  return sums.absolute > 0.0 ? std::max(0.0, (sums.gain - sums.weight * alpha) / sums.absolute) : 0.0;
}

void check_definite(const MatrixXd& x, Index n) {
  if (x.rows() != n || x.cols() != n) fail("certificate: expected matrices of size ", n, ", got ", x.rows());
  if (Llt(x).info() != Eigen::Success) fail("certificate: expected a positive definite matrix");
}

Sums checked_sums(const UncertaintyProgramme& programme, const DualCertificate& certificate) {
  check_definite(certificate.x1, programme.a.cols());
  check_definite(certificate.x2, programme.a.cols());
  if (certificate.lambda.size() != programme.w.size()) {
    fail("certificate: expected ", programme.w.size(), " multipliers, got ", certificate.lambda.size());
  }
  return certificate_sums(programme, certificate);
}

/// Primal-dual method with the HKM direction and Mehrotra's predictor and corrector. The point (h, x) stays feasible:
/// Z is recomputed from it. x is alpha or gamma, `fixed` is the other one.
class InteriorPoint {
 public:
  InteriorPoint(const UncertaintyProgramme& programme, Mode mode, double fixed, VectorXd h, double x)
      : programme_(programme), mode_(mode), fixed_(fixed), h_(std::move(h)), x_(x), z_(slack(h_, x_)) {
    factorise(z_, z_factors_);
    const double mu = 10.0 * x_ / static_cast<double>(order());
    set_inverse();
    x_dual_ = inverse_;
    for (std::size_t i = 0; i < 2; ++i) {
      x_dual_.blocks[i] *= mu;
      x_dual_.rows[i] *= mu;
    }
    factorise(x_dual_, x_factors_);
    update_bound();
  }

  double value() const { return x_; }
  double bound() const { return bound_; }
  const VectorXd& h() const { return h_; }
  const DualCertificate& certificate() const { return best_; }

  /// False when rounding lets it go no further.
  bool iterate() {
    set_inverse();
    if (!set_normal_matrix()) return false;
    const double count = static_cast<double>(order());
    const double mu = inner(x_dual_, z_) / count;

    const VectorXd predictor = solve(-objective());
    const Cone dz_a = slack_direction(predictor);
    const std::array<MatrixXd, 2> turned_a = {dz_a.blocks[0] * inverse_.blocks[0], dz_a.blocks[1] * inverse_.blocks[1]};
    const Cone dx_a = dual_direction(0.0, dz_a, turned_a, nullptr);
    const double primal = step_length(x_dual_, x_factors_, dx_a);
    const double dual = step_length(z_, z_factors_, dz_a);
    const double mu_a = inner(combination(x_dual_, primal, dx_a), combination(z_, dual, dz_a)) / count;
    const double sigma = std::clamp(std::pow(std::max(mu_a, 0.0) / mu, 3.0), 1e-6, 1.0);

    Cone second;
    for (std::size_t i = 0; i < 2; ++i) {
      second.blocks[i].noalias() = dx_a.blocks[i] * turned_a[i];
      second.rows[i] = dx_a.rows[i].cwiseProduct(dz_a.rows[i]).cwiseProduct(inverse_.rows[i]);
    }
    const VectorXd step = solve(-objective() + sigma * mu * adjoint(inverse_) - adjoint(second));
    const Cone dz = slack_direction(step);
    const std::array<MatrixXd, 2> turned = {dz.blocks[0] * inverse_.blocks[0], dz.blocks[1] * inverse_.blocks[1]};
    const Cone dx = dual_direction(sigma * mu, dz, turned, &second);
    return move(step, dz, dx);
  }

 private:
  Index n() const { return programme_.a.cols(); }
  Index order() const { return 2 * (n() + programme_.w.size()); }

  Cone slack(const VectorXd& h, double x) const {
    const MatrixXd k = hankel(h);
    const VectorXd left = programme_.w - programme_.a * h;
    Cone z;
    for (std::size_t i = 0; i < 2; ++i) {
      z.blocks[i] = kSigns[i] * k;
      z.blocks[i].diagonal().array() += mode_ == Mode::alpha ? x : fixed_;
      z.rows[i] = (mode_ == Mode::gamma ? x : fixed_) - kSigns[i] * left.array();
    }
    return z;
  }

  Cone slack_direction(const VectorXd& step) const {
    const double dx = step[n()];
    const MatrixXd k = hankel(step.head(n()));
    const VectorXd moved = programme_.a * step.head(n());
    Cone dz;
    for (std::size_t i = 0; i < 2; ++i) {
      dz.blocks[i] = kSigns[i] * k;
      dz.rows[i] = kSigns[i] * moved;
      if (mode_ == Mode::alpha) {
        dz.blocks[i].diagonal().array() += dx;
      } else {
        dz.rows[i].array() += dx;
      }
    }
    return dz;
  }

  /// sigma mu Z^-1 - X - sym(X dZ Z^-1) - sym(second).
  Cone dual_direction(double center, const Cone& dz, const std::array<MatrixXd, 2>& turned, const Cone* second) const {
    Cone dx;
    for (std::size_t i = 0; i < 2; ++i) {
      MatrixXd m(n(), n());
      m.noalias() = x_dual_.blocks[i] * turned[i];
      if (second != nullptr) m += second->blocks[i];
      dx.blocks[i] = center * inverse_.blocks[i] - x_dual_.blocks[i] - 0.5 * (m + m.transpose());
      VectorXd r = x_dual_.rows[i].cwiseProduct(dz.rows[i]).cwiseProduct(inverse_.rows[i]);
      if (second != nullptr) r += second->rows[i];
      dx.rows[i] = center * inverse_.rows[i] - x_dual_.rows[i] - r;
    }
    return dx;
  }

  VectorXd objective() const { return VectorXd::Unit(n() + 1, n()); }

  VectorXd adjoint(const Cone& y) const {
    VectorXd g(n() + 1);
    g.head(n()) =
        hankel_adjoint(y.blocks[0]) - hankel_adjoint(y.blocks[1]) + programme_.a.transpose() * (y.rows[0] - y.rows[1]);
    g[n()] = mode_ == Mode::alpha ? y.blocks[0].trace() + y.blocks[1].trace() : y.rows[0].sum() + y.rows[1].sum();
    return g;
  }

  void set_inverse() {
    for (std::size_t i = 0; i < 2; ++i) {
      MatrixXd lower = MatrixXd::Identity(n(), n());
      z_factors_.blocks[i].matrixL().solveInPlace(lower);
      inverse_.blocks[i].setZero(n(), n());
      inverse_.blocks[i].selfadjointView<Eigen::Lower>().rankUpdate(lower.transpose());
      inverse_.blocks[i].triangularView<Eigen::StrictlyUpper>() = inverse_.blocks[i].transpose();
      inverse_.rows[i] = z_.rows[i].cwiseInverse();
    }
  }

  bool set_normal_matrix() {
    const VectorXd first = x_dual_.rows[0].cwiseProduct(inverse_.rows[0]);
    const VectorXd other = x_dual_.rows[1].cwiseProduct(inverse_.rows[1]);
    normal_.resize(n() + 1, n() + 1);
    normal_.topLeftCorner(n(), n()) =
        hankel_schur_complement(x_dual_.blocks[0], inverse_.blocks[0], x_dual_.blocks[1], inverse_.blocks[1]) +
        programme_.a.transpose() * (first + other).asDiagonal() * programme_.a;
    VectorXd beside;
    if (mode_ == Mode::alpha) {
      const MatrixXd one = x_dual_.blocks[0] * inverse_.blocks[0];
      const MatrixXd two = x_dual_.blocks[1] * inverse_.blocks[1];
      beside = hankel_adjoint(one) - hankel_adjoint(two);
      normal_(n(), n()) = one.trace() + two.trace();
    } else {
      beside = programme_.a.transpose() * (first - other);
      normal_(n(), n()) = first.sum() + other.sum();
    }
    normal_.topRightCorner(n(), 1) = beside;
    normal_.bottomLeftCorner(1, n()) = beside.transpose();
    if (!(normal_.diagonal().minCoeff() > 0.0)) return false;
    scale_ = normal_.diagonal().cwiseSqrt().cwiseInverse();
    normal_ = scale_.asDiagonal() * normal_ * scale_.asDiagonal();
    for (double ridge = 0.0; ridge <= 1e-6; ridge = std::max(1e-15, 10.0 * ridge)) {
      normal_factors_.compute(normal_ + ridge * MatrixXd::Identity(n() + 1, n() + 1));
      if (normal_factors_.info() == Eigen::Success) return true;
    }
    return false;
  }

  VectorXd solve(const VectorXd& right) const {
    const VectorXd scaled = scale_.cwiseProduct(right);
    VectorXd y = normal_factors_.solve(scaled);
    y += normal_factors_.solve(scaled - normal_ * y);
    return scale_.cwiseProduct(y);
  }

  /// Steps back until both points are inside their cones.
  bool move(const VectorXd& step, const Cone& dz, const Cone& dx) {
    if (!step.allFinite()) return false;
    Factors factors;
    double dual = step_length(z_, z_factors_, dz);
    double primal = step_length(x_dual_, x_factors_, dx);
    Cone z;
    for (int tries = 0;; ++tries, dual *= 0.7) {
      if (tries == 10) return false;
      z = slack(h_ + dual * step.head(n()), x_ + dual * step[n()]);
      if (factorise(z, factors)) break;
    }
    h_ += dual * step.head(n());
    x_ += dual * step[n()];
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

  void update_bound() {
    DualCertificate certificate{x_dual_.blocks[0], x_dual_.blocks[1], x_dual_.rows[0] - x_dual_.rows[1]};
    const Sums sums = certificate_sums(programme_, certificate);
    const double bound = mode_ == Mode::alpha ? alpha_bound(sums, fixed_) : gamma_bound(sums, fixed_);
    if (bound < bound_ || (bound == bound_ && best_.lambda.size() != 0)) return;
    bound_ = bound;
    best_ = std::move(certificate);
  }

  const UncertaintyProgramme& programme_;
  Mode mode_;
  double fixed_;
  VectorXd h_;
  double x_;
  Cone z_;
  Cone x_dual_;
  Cone inverse_;
  Factors z_factors_;
  Factors x_factors_;
  MatrixXd normal_;
  VectorXd scale_;
  Llt normal_factors_;
  DualCertificate best_;
  double bound_ = 0.0;
};

/// v divided by its largest sample, w by its own: alpha, gamma and h in these units are of size one.
struct Scaled {
  UncertaintyProgramme programme;
  double a = 1.0;
  double w = 1.0;

  double gain() const { return w / a; }
};

Scaled scaled(const UncertaintyProgramme& programme) {
  Scaled result;
  const double a = programme.a.cwiseAbs().maxCoeff();
  const double w = programme.w.cwiseAbs().maxCoeff();
  if (a > 0.0) result.a = a;
  if (w > 0.0) result.w = w;
  result.programme = {programme.a / result.a, programme.w / result.w};
  return result;
}

void check_programme(const UncertaintyProgramme& programme) {
  if (programme.a.rows() < 1 || programme.a.cols() < 1 || programme.a.rows() != programme.w.size()) {
    fail("uncertainty programme: expected as many rows as samples of w, at least 1, got ", programme.a.rows(), " and ",
         programme.w.size());
  }
}

struct Run {
  ProgrammeStatus status = ProgrammeStatus::max_iterations;
  int iterations = 0;
};

Run run(InteriorPoint& method, const ProgrammeOptions& options, double target, double zero) {
  Run result;
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

double slope_of(const DualCertificate& certificate) {
  return -certificate.lambda.lpNorm<1>() / (certificate.x1.trace() + certificate.x2.trace());
}

/// In the caller's units.
ProgrammeSolution solution_of(const InteriorPoint& method, const Run& end, const Scaled& data, double unit) {
  ProgrammeSolution solution;
  solution.status = end.status;
  solution.iterations = end.iterations;
  solution.value = unit * method.value();
  solution.lower_bound = unit * method.bound();
  solution.h = data.gain() * method.h();
  solution.certificate = method.certificate();
  // K, tr X in units of 1/alpha; lambda in units of 1/w.
  solution.certificate.lambda /= data.a;
  solution.slope = slope_of(solution.certificate);
  return solution;
}

InteriorPoint noise_problem(const UncertaintyProgramme& programme, double alpha) {
  const double start = 1.1 * std::max(programme.w.cwiseAbs().maxCoeff(), 1e-300);
  return {programme, Mode::gamma, alpha, VectorXd::Zero(programme.a.cols()), start};
}

/// alpha = 0 explains w that is no larger than the noise.
ProgrammeSolution nothing_to_explain(Index n, Index rows) {
  ProgrammeSolution solution;
  solution.status = ProgrammeStatus::converged;
  solution.h = VectorXd::Zero(n);
  solution.certificate = {MatrixXd::Identity(n, n), MatrixXd::Identity(n, n), VectorXd::Zero(rows)};
  return solution;
}

void check_window(const UncertaintyWindow& window) {
  const Index count = window.w.size();
  if (count < 1 || window.v.size() < count) {
    fail("uncertainty window: expected v at least as long as w, and w not empty, got ", window.v.size(), " and ",
         count);
  }
  if (!window.v.allFinite()) fail("uncertainty window: expected finite samples of v");
  if (window.w.array().isInf().any()) fail("uncertainty window: expected finite samples of w, or NaN where missing");
  if (window.shape.size() != 0 &&
      (window.shape.size() != count || !window.shape.allFinite() || !(window.shape.minCoeff() > 0.0))) {
    fail("uncertainty window: expected a noise shape of ", count, " finite samples above 0, or none");
  }
}

}  // namespace

UncertaintyWindow cut_window(const VectorXd& v, const VectorXd& w, Index first, Index count, Index past,
                             const VectorXd& shape) {
  if (v.size() != w.size()) fail("uncertainty window: expected v and w of one size, got ", v.size(), " and ", w.size());
  if (shape.size() != 0 && shape.size() != w.size()) {
    fail("uncertainty window: expected a noise shape of ", w.size(), " samples, or none, got ", shape.size());
  }
  if (past < 0 || past > first || count < 1 || count > w.size() - first) {
    fail("uncertainty window: expected ", count, " samples from ", first, " with ", past,
         " before them in a record of ", w.size());
  }
  UncertaintyWindow window;
  window.v = v.segment(first - past, past + count);
  window.w = w.segment(first, count);
  if (shape.size() != 0) window.shape = shape.segment(first, count);
  window.from_rest = past == first;
  return window;
}

UncertaintyProgramme uncertainty_programme(std::span<const UncertaintyWindow> windows) {
  Index rows = 0;
  Index n = 0;
  for (const UncertaintyWindow& window : windows) {
    check_window(window);
    rows += window.w.size() - static_cast<Index>(window.w.array().isNaN().count());
    n = std::max(n, window.v.size());
  }
  if (rows == 0) fail("uncertainty programme: expected at least one sample of w, got none");
  UncertaintyProgramme programme{MatrixXd::Zero(rows, n), VectorXd(rows)};
  Index row = 0;
  for (const UncertaintyWindow& window : windows) {
    const Index past = window.v.size() - window.w.size();
    for (Index t = 0; t < window.w.size(); ++t) {
      if (std::isnan(window.w[t])) continue;
      const double shape = window.shape.size() == 0 ? 1.0 : window.shape[t];
      const Index known = past + t + 1;
      programme.a.row(row).head(known) = window.v.head(known).reverse().transpose() / shape;
      programme.w[row++] = window.w[t] / shape;
    }
  }
  return programme;
}

UncertaintyProgramme uncertainty_programme(const UncertaintyWindow& window) {
  return uncertainty_programme(std::span<const UncertaintyWindow>(&window, 1));
}

double certified_alpha(const UncertaintyProgramme& programme, double gamma, const DualCertificate& certificate) {
  return alpha_bound(checked_sums(programme, certificate), gamma);
}

double certified_gamma(const UncertaintyProgramme& programme, double alpha, const DualCertificate& certificate) {
  return gamma_bound(checked_sums(programme, certificate), alpha);
}

ProgrammeSolution smallest_gamma(const UncertaintyProgramme& programme, double alpha, const ProgrammeOptions& options,
                                 double target) {
  check_programme(programme);
  if (!(alpha > 0.0) || !std::isfinite(alpha)) {
    fail("uncertainty programme: expected a finite alpha above 0, got ", alpha);
  }
  if (programme.w.isZero(0.0)) return nothing_to_explain(programme.a.cols(), programme.w.size());
  const Scaled data = scaled(programme);
  InteriorPoint method = noise_problem(data.programme, alpha / data.gain());
  const Run end = run(method, options, target / data.w, kZeroNoise);
  return solution_of(method, end, data, data.w);
}

ProgrammeSolution smallest_alpha(const UncertaintyProgramme& programme, double gamma, const ProgrammeOptions& options) {
  check_programme(programme);
  if (!(gamma > 0.0) || !std::isfinite(gamma)) {
    fail("uncertainty programme: expected a finite noise bound above 0, got ", gamma,
         "; without noise take noise_free_bound() or 1e-6 of the largest |w|");
  }
  if (programme.w.cwiseAbs().maxCoeff() <= gamma) {
    return nothing_to_explain(programme.a.cols(), programme.w.size());
  }
  const Scaled data = scaled(programme);
  const double noise = gamma / data.w;
  int before = 0;
  for (double alpha = std::min(kFirstAlpha, options.alpha_cap / data.gain());; alpha *= 4.0) {
    const bool last = alpha * data.gain() >= options.alpha_cap;
    if (last) alpha = options.alpha_cap / data.gain();
    // Well inside, so that the second problem has room; at the cap, what there is.
    InteriorPoint inside = noise_problem(data.programme, alpha);
    Run end = run(inside, options, 0.7 * noise, 0.0);
    before += end.iterations;
    if (inside.value() < 0.99 * noise) {
      InteriorPoint method(data.programme, Mode::alpha, noise, inside.h(), alpha);
      end = run(method, options, -1.0, 0.0);
      end.iterations += before;
      return solution_of(method, end, data, data.gain());
    }
    if (last) {
      ProgrammeSolution solution = solution_of(inside, end, data, data.gain());
      solution.status = ProgrammeStatus::cap_exceeded;
      solution.iterations = before;
      solution.value = kInfinity;
      solution.lower_bound = alpha_bound(certificate_sums(programme, solution.certificate), gamma);
      return solution;
    }
  }
}

}  // namespace blockid
