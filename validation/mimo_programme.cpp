#include <blockid/validation/mimo_programme.hpp>

#include <blockid/data/error.hpp>
#include <blockid/validation/correlation.hpp>
#include <blockid/validation/dense_product.hpp>
#include <blockid/validation/detail/relative_tau.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How far above the least the first beta is.
constexpr double kStartFactor = 2.0;

void check_signals(const MatrixXd& v, const MatrixXd& w, double relative_tau) {
  if (v.size() == 0 || w.size() == 0) fail("uncertainty bound: expected samples of v and w, got none");
  if (!v.allFinite() || !w.allFinite()) fail("uncertainty bound: expected finite samples");
  detail::check_relative_tau(relative_tau);
}

double largest_eigenvalue(const MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(symmetric, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

/// R of [T; tau I] = Q R.
MatrixXd regular_triangle(const MatrixXd& t, double tau) {
  const Index n = t.cols();
  MatrixXd stacked(t.rows() + n, n);
  stacked << t, tau * MatrixXd::Identity(n, n);
  return Eigen::HouseholderQR<MatrixXd>(stacked).matrixQR().topRows(n).triangularView<Eigen::Upper>();
}

/// sigma_max(T R^-1).
double ratio_norm(const MatrixXd& t, const MatrixXd& r) {
  const MatrixXd ratio = r.triangularView<Eigen::Upper>().transpose().solve(t.transpose());
  return std::sqrt(std::max(0.0, largest_eigenvalue(ratio * ratio.transpose())));
}

/// y = (z_{0,0}..z_{p-1,0}, z_{0,1}.., beta): one block [beta G, T_z'; T_z, I] with the outputs channel by channel,
/// rows gamma - (w - z), gamma + (w - z) in the window.
class GramForm : public ConicForm {
 public:
  GramForm(MatrixXd gram, MatrixXd w, double gamma, double input_norm)
      : gram_(std::move(gram)), w_(std::move(w)), gamma_(gamma), input_norm_(input_norm) {}

  Index n() const { return gram_.rows(); }
  Index p() const { return w_.rows(); }
  Index past() const { return n() - w_.cols(); }

  Cone slack(const VectorXd& y) const override {
    Cone z = slack_direction(y);
    z.blocks[0].bottomRightCorner(p() * n(), p() * n()).diagonal().setOnes();
    for (std::size_t i = 0; i < 2; ++i) {
      const double sign = i == 0 ? 1.0 : -1.0;
      z.rows[i].array() += gamma_ - sign * w_.reshaped().array();
    }
    return z;
  }

  Cone slack_direction(const VectorXd& dy) const override {
    MatrixXd block = MatrixXd::Zero((1 + p()) * n(), (1 + p()) * n());
    block.topLeftCorner(n(), n()) = dy[p() * n()] * gram_;
    for (Index a = 0; a < p(); ++a) {
      for (Index j = 0; j < n(); ++j) {
        for (Index i = j; i < n(); ++i) {
          block((1 + a) * n() + i, j) = block(j, (1 + a) * n() + i) = dy[(i - j) * p() + a];
        }
      }
    }
    const VectorXd window = dy.segment(past() * p(), w_.size());
    return {{block}, {window, -window}};
  }

  VectorXd adjoint(const Cone& x) const override {
    VectorXd g(p() * n() + 1);
    for (Index a = 0; a < p(); ++a) {
      const MatrixXd beside = x.blocks[0].block(0, (1 + a) * n(), n(), n());
      const VectorXd sums = diagonal_sums(coupling(x.blocks[0], a)) + diagonal_sums(beside.transpose());
      for (Index k = 0; k < n(); ++k) g[k * p() + a] = sums[k];
    }
    g.segment(past() * p(), w_.size()) += x.rows[0] - x.rows[1];
    g[p() * n()] = corner(x.blocks[0]).cwiseProduct(gram_).sum();
    return g;
  }

  MatrixXd normal_matrix(const Cone& x, const Cone& w) const override {
    MatrixXd normal = MatrixXd::Zero(p() * n() + 1, p() * n() + 1);
    set_output_part(x.blocks[0], w.blocks[0], normal);
    const VectorXd rows = x.rows[0].cwiseProduct(w.rows[0]) + x.rows[1].cwiseProduct(w.rows[1]);
    normal.diagonal().segment(past() * p(), w_.size()) += rows;
    set_beta_part(x.blocks[0], w.blocks[0], normal);
    return normal;
  }

  /// beta tr(X_11 G) + sqrt(beta) |v| |r| >= -tr X_cc + lambda'w - gamma |lambda|_1, with lambda = -2 diagonal sums of
  /// the coupling in the window, which leaves r, those of the past; |z| <= alpha |v| bounds what multiplies them.
  double bound(const Cone& x) const override {
    VectorXd sums = adjoint({x.blocks, {VectorXd::Zero(w_.size()), VectorXd::Zero(w_.size())}});
    const double traced = sums[p() * n()];
    const VectorXd lambda = -sums.segment(past() * p(), w_.size());
    const double free = input_norm_ * sums.head(past() * p()).norm();
    const double gain = lambda.dot(w_.reshaped()) - gamma_ * lambda.lpNorm<1>() -
                        x.blocks[0].bottomRightCorner(p() * n(), p() * n()).trace();
    if (!(gain > 0.0) || !(traced > 0.0)) return 0.0;
    const double alpha = (std::sqrt(free * free + 4.0 * traced * gain) - free) / (2.0 * traced);
    return alpha * alpha;
  }

 private:
  using Part = Eigen::Block<const MatrixXd>;

  Part corner(const MatrixXd& x) const { return x.topLeftCorner(n(), n()); }
  /// Rows of output a, columns of the input.
  Part coupling(const MatrixXd& x, Index a) const { return x.block((1 + a) * n(), 0, n(), n()); }
  Part outputs(const MatrixXd& x, Index a, Index b) const { return x.block((1 + a) * n(), (1 + b) * n(), n(), n()); }

  /// g_k = sum_i m_{i+k,i}.
  VectorXd diagonal_sums(const MatrixXd& m) const {
    VectorXd g(n());
    for (Index k = 0; k < n(); ++k) g[k] = m.diagonal(-k).sum();
    return g;
  }

  /// With A_{ka} = U_a S^k V' + V S^k' U_a', S the shift down by one, V and U_a the places of the input and of output
  /// a, tr(A_ka X A_lb W) has four terms. In c(P, Q)_{kl} = sum_ij P_ij Q_{i+k,j+l} they are c(X_11, W_ab) + c(W_11,
  /// X_ab) at (k, l) and c(X_b', W_a) + c(W_b', X_a) at (k, -l), the couplings being X_a, W_a.
  void set_output_part(const MatrixXd& x, const MatrixXd& w, MatrixXd& normal) const {
    const Correlation correlation(n());
    const auto spectra = [&](const MatrixXd& of, bool transposed) {
      std::vector<Correlation::Spectrum> all;
      for (Index a = 0; a < p(); ++a) {
        const MatrixXd part = coupling(of, a);
        all.push_back(correlation.spectrum(transposed ? MatrixXd(part.transpose()) : part));
      }
      return all;
    };
    const Correlation::Spectrum x11 = correlation.spectrum(corner(x));
    const Correlation::Spectrum w11 = correlation.spectrum(corner(w));
    const std::vector<Correlation::Spectrum> xa = spectra(x, false);
    const std::vector<Correlation::Spectrum> wa = spectra(w, false);
    const std::vector<Correlation::Spectrum> xb = spectra(x, true);
    const std::vector<Correlation::Spectrum> wb = spectra(w, true);
    for (Index a = 0; a < p(); ++a) {
      for (Index b = 0; b <= a; ++b) {
        const std::size_t i = static_cast<std::size_t>(a);
        const std::size_t j = static_cast<std::size_t>(b);
        const MatrixXd straight =
            correlation.sums(x11, correlation.spectrum(outputs(w, a, b)), w11, correlation.spectrum(outputs(x, a, b)));
        const MatrixXd crossed = correlation.crossed_sums(xb[j], wa[i], wb[j], xa[i]);
        for (Index l = 0; l < n(); ++l) {
          for (Index k = 0; k < n(); ++k) {
            const double sum = straight(k, l) + crossed(k, l);
            normal(k * p() + a, l * p() + b) = sum;
            normal(l * p() + b, k * p() + a) = sum;
          }
        }
      }
    }
  }

  /// tr(A_ka X (V G V') W) and tr(V G V' X V G V' W).
  void set_beta_part(const MatrixXd& x, const MatrixXd& w, MatrixXd& normal) const {
    const Index last = p() * n();
    const MatrixXd xg = corner(x) * gram_;
    const MatrixXd wg = corner(w) * gram_;
    for (Index a = 0; a < p(); ++a) {
      const VectorXd sums = diagonal_sums(coupling(w, a) * xg.transpose() + coupling(x, a) * wg.transpose());
      for (Index k = 0; k < n(); ++k) normal(k * p() + a, last) = normal(last, k * p() + a) = sums[k];
    }
    normal(last, last) = xg.cwiseProduct(wg.transpose()).sum();
  }

  MatrixXd gram_;
  MatrixXd w_;
  double gamma_;
  double input_norm_;
};

void check_programme(const MatrixXd& v, const MatrixXd& w, double gamma, double relative_tau) {
  check_signals(v, w, relative_tau);
  if (w.cols() > v.cols()) {
    fail("uncertainty programme: expected at least as many samples of v as of w, got ", v.cols(), " and ", w.cols());
  }
  if (!(gamma > 0.0) || !std::isfinite(gamma)) {
    fail("uncertainty programme: expected a finite noise bound above 0, got ", gamma);
  }
  if (v.isZero(0.0)) fail("uncertainty programme: the signal v is zero, nothing excites the loop");
}

}  // namespace

MatrixXd block_toeplitz(const MatrixXd& v) {
  const Index m = v.rows();
  const Index n = v.cols();
  MatrixXd t = MatrixXd::Zero(m * n, n);
  for (Index k = 0; k < n; ++k) t.col(k).tail(m * (n - k)) = v.leftCols(n - k).reshaped();
  return t;
}

double block_toeplitz_norm(const MatrixXd& v) {
  if (v.size() == 0) return 0.0;
  const MatrixXd t = block_toeplitz(v);
  return std::sqrt(std::max(0.0, largest_eigenvalue(t.transpose() * t)));
}

double mimo_noise_free_bound(const MatrixXd& v, const MatrixXd& w, double relative_tau) {
  check_signals(v, w, relative_tau);
  if (v.cols() != w.cols()) {
    fail("uncertainty bound: expected v and w with as many samples, got ", v.cols(), " and ", w.cols());
  }
  if (v.isZero(0.0)) return w.isZero(0.0) ? 0.0 : std::numeric_limits<double>::infinity();
  const double tau = relative_tau * block_toeplitz_norm(v);
  return ratio_norm(block_toeplitz(w), regular_triangle(block_toeplitz(v), tau));
}

double certified_mimo_alpha(const MatrixXd& v, const MatrixXd& w, double gamma, const MimoCertificate& x,
                            double relative_tau) {
  check_programme(v, w, gamma, relative_tau);
  if (x.size() == 0) return 0.0;
  const Index n = v.cols();
  const Index p = w.rows();
  const Index past = n - w.cols();
  if (x.rows() != (1 + p) * n || x.cols() != (1 + p) * n) {
    fail("certificate: expected ", (1 + p) * n, " rows and columns, got ", x.rows(), " and ", x.cols());
  }
  if (!CholeskyFactor(x).positive()) fail("certificate: expected a positive definite matrix");
  const double largest = w.cwiseAbs().maxCoeff();
  if (largest == 0.0) return 0.0;
  const double norm = block_toeplitz_norm(v);
  const MatrixXd t = block_toeplitz(v) / norm;
  const MatrixXd corner = x.topLeftCorner(n, n);
  const double traced = (t * corner).cwiseProduct(t).sum() + relative_tau * relative_tau * corner.trace();
  double gain = -x.bottomRightCorner(p * n, p * n).trace();
  double free = 0.0;
  for (Index a = 0; a < p; ++a) {
    for (Index k = 0; k < n; ++k) {
      const double s = 2.0 * x.block((1 + a) * n, 0, n, n).diagonal(-k).sum();
      if (k < past) {
        free += s * s;
      } else {
        gain -= s * w(a, k - past) / largest + std::abs(s) * gamma / largest;
      }
    }
  }
  if (!(gain > 0.0) || !(traced > 0.0)) return 0.0;
  const double before = std::sqrt(free) * v.norm() / norm;
  return largest / norm * (std::sqrt(before * before + 4.0 * traced * gain) - before) / (2.0 * traced);
}

MimoSolution smallest_mimo_alpha(const MatrixXd& v, const MatrixXd& w, double gamma, const ProgrammeOptions& options,
                                 double relative_tau, double target) {
  check_programme(v, w, gamma, relative_tau);
  MimoSolution solution;
  solution.output = MatrixXd::Zero(w.rows(), v.cols());
  const double largest = w.cwiseAbs().maxCoeff();
  if (largest <= gamma) {
    solution.status = ProgrammeStatus::converged;
    return solution;
  }
  // v and w in units in which T_v and w are of size one.
  const double norm = block_toeplitz_norm(v);
  const MatrixXd t = block_toeplitz(v) / norm;
  const MatrixXd r = regular_triangle(t, relative_tau);
  const MatrixXd gram = t.transpose() * t + relative_tau * relative_tau * MatrixXd::Identity(t.cols(), t.cols());
  const GramForm form(gram, w / largest, gamma / largest, v.norm() / norm);
  solution.output.rightCols(w.cols()) = w / largest;
  const double least = ratio_norm(block_toeplitz(solution.output), r);
  VectorXd y(solution.output.size() + 1);
  y << solution.output.reshaped(), kStartFactor * least * least;
  InteriorPoint method(form, y);
  ProgrammeOptions squared = options;
  squared.tolerance = 2.0 * options.tolerance;  // of beta = alpha^2
  const double gain = largest / norm;
  const ProgrammeRun end = run(method, squared, target < 0.0 ? -1.0 : target * target / (gain * gain), 0.0);
  solution.status = end.status;
  solution.iterations = end.iterations;
  solution.value = gain * std::sqrt(method.value());
  solution.lower_bound = gain * std::sqrt(method.bound());
  if (!method.certificate().blocks.empty()) solution.certificate = method.certificate().blocks[0];
  solution.output = largest * method.y().head(solution.output.size()).reshaped(w.rows(), v.cols());
  return solution;
}

}  // namespace blockid
