#include <blockid/validation/uncertainty_programme.hpp>

#include <blockid/blocks/detail/infinity.hpp>
#include <blockid/data/error.hpp>
#include <blockid/validation/dense_product.hpp>
#include <blockid/validation/hankel_products.hpp>
#include <blockid/validation/interior_point.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace blockid {
namespace {

using detail::kInfinity;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::array<double, 2> kSigns = {1.0, -1.0};
/// A noise bound below this times max|w| is zero.
constexpr double kZeroNoise = 1e-9;
/// First alpha in units of max|w| / max|v| for which smallest_alpha() looks for an inner point.
constexpr double kFirstAlpha = 4.0;

enum class Mode { alpha, gamma };

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
  if (!CholeskyFactor(x).positive()) fail("certificate: expected a positive definite matrix");
}

Sums checked_sums(const UncertaintyProgramme& programme, const DualCertificate& certificate) {
  check_definite(certificate.x1, programme.a.cols());
  check_definite(certificate.x2, programme.a.cols());
  if (certificate.lambda.size() != programme.w.size()) {
    fail("certificate: expected ", programme.w.size(), " multipliers, got ", certificate.lambda.size());
  }
  return certificate_sums(programme, certificate);
}

DualCertificate certificate_of(const Cone& x) { return {x.blocks[0], x.blocks[1], x.rows[0] - x.rows[1]}; }

/// y = (h, x): blocks alpha I + K(h), alpha I - K(h), rows gamma - (w - A h), gamma + (w - A h). x is alpha or gamma,
/// `fixed` is the other one.
class HankelForm : public ConicForm {
 public:
  HankelForm(const UncertaintyProgramme& programme, Mode mode, double fixed)
      : programme_(programme), mode_(mode), fixed_(fixed) {}

  Cone slack(const VectorXd& y) const override {
    const double x = y[n()];
    const MatrixXd k = hankel(y.head(n()));
    const VectorXd left = programme_.w - programme_.a * y.head(n());
    Cone z{std::vector<MatrixXd>(2), std::vector<VectorXd>(2)};
    for (std::size_t i = 0; i < 2; ++i) {
      z.blocks[i] = kSigns[i] * k;
      z.blocks[i].diagonal().array() += mode_ == Mode::alpha ? x : fixed_;
      z.rows[i] = (mode_ == Mode::gamma ? x : fixed_) - kSigns[i] * left.array();
    }
    return z;
  }

  Cone slack_direction(const VectorXd& dy) const override {
    const double dx = dy[n()];
    const MatrixXd k = hankel(dy.head(n()));
    const VectorXd moved = programme_.a * dy.head(n());
    Cone dz{std::vector<MatrixXd>(2), std::vector<VectorXd>(2)};
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

  VectorXd adjoint(const Cone& x) const override {
    VectorXd g(n() + 1);
    g.head(n()) =
        hankel_adjoint(x.blocks[0]) - hankel_adjoint(x.blocks[1]) + programme_.a.transpose() * (x.rows[0] - x.rows[1]);
    g[n()] = mode_ == Mode::alpha ? x.blocks[0].trace() + x.blocks[1].trace() : x.rows[0].sum() + x.rows[1].sum();
    return g;
  }

  MatrixXd normal_matrix(const Cone& x, const Cone& w) const override {
    const VectorXd first = x.rows[0].cwiseProduct(w.rows[0]);
    const VectorXd other = x.rows[1].cwiseProduct(w.rows[1]);
    MatrixXd normal(n() + 1, n() + 1);
    normal.topLeftCorner(n(), n()) = hankel_schur_complement(x.blocks[0], w.blocks[0], x.blocks[1], w.blocks[1]) +
                                     weighted_gram(programme_.a, first + other);
    VectorXd beside;
    if (mode_ == Mode::alpha) {
      const MatrixXd one = product(x.blocks[0], w.blocks[0]);
      const MatrixXd two = product(x.blocks[1], w.blocks[1]);
      beside = hankel_adjoint(one) - hankel_adjoint(two);
      normal(n(), n()) = one.trace() + two.trace();
    } else {
      beside = programme_.a.transpose() * (first - other);
      normal(n(), n()) = first.sum() + other.sum();
    }
    normal.topRightCorner(n(), 1) = beside;
    normal.bottomLeftCorner(1, n()) = beside.transpose();
    return normal;
  }

  double bound(const Cone& x) const override {
    const Sums sums = certificate_sums(programme_, certificate_of(x));
    return mode_ == Mode::alpha ? alpha_bound(sums, fixed_) : gamma_bound(sums, fixed_);
  }

 private:
  Index n() const { return programme_.a.cols(); }

  const UncertaintyProgramme& programme_;
  Mode mode_;
  double fixed_;
};

VectorXd start_of(const VectorXd& h, double x) {
  VectorXd y(h.size() + 1);
  y << h, x;
  return y;
}

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

double slope_of(const DualCertificate& certificate) {
  return -certificate.lambda.lpNorm<1>() / (certificate.x1.trace() + certificate.x2.trace());
}

/// In the caller's units.
ProgrammeSolution solution_of(const InteriorPoint& method, const ProgrammeRun& end, const Scaled& data, double unit) {
  ProgrammeSolution solution;
  solution.status = end.status;
  solution.iterations = end.iterations;
  solution.value = unit * method.value();
  solution.lower_bound = unit * method.bound();
  solution.h = data.gain() * method.y().head(method.y().size() - 1);
  solution.certificate = certificate_of(method.certificate());
  // K, tr X in units of 1/alpha; lambda in units of 1/w.
  solution.certificate.lambda /= data.a;
  solution.slope = slope_of(solution.certificate);
  return solution;
}

/// h = 0 leaves all of w to the noise.
VectorXd start_of_noise(const UncertaintyProgramme& programme) {
  const double largest = std::max(programme.w.cwiseAbs().maxCoeff(), 1e-300);
  return start_of(VectorXd::Zero(programme.a.cols()), 1.1 * largest);
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
  const HankelForm form(data.programme, Mode::gamma, alpha / data.gain());
  InteriorPoint method(form, start_of_noise(data.programme));
  const ProgrammeRun end = run(method, options, target / data.w, kZeroNoise);
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
    const HankelForm wide(data.programme, Mode::gamma, alpha);
    InteriorPoint inside(wide, start_of_noise(data.programme));
    ProgrammeRun end = run(inside, options, 0.7 * noise, 0.0);
    before += end.iterations;
    if (inside.value() < 0.99 * noise) {
      const HankelForm form(data.programme, Mode::alpha, noise);
      InteriorPoint method(form, start_of(inside.y().head(inside.y().size() - 1), alpha));
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
