#include "support/rational_rivals.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

namespace blockid::testing {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

// ------------------------------------------------------------------------------------------------- vector fitting

/// Poles in the order pair, pair, ..., real, real, ...; of a pair the one in the upper half plane.
struct PoleSet {
  std::vector<Complex> pairs;
  std::vector<double> reals;
};

PoleSet start_poles(const FrequencyResponse& data, Index order) {
  constexpr double kDamping = 0.01;
  PoleSet poles;
  const double low = std::log(data.omega_rad_s[0]);
  const double high = std::log(data.omega_rad_s[data.omega_rad_s.size() - 1]);
  const Index pairs = order / 2;
  for (Index k = 0; k < pairs; ++k) {
    const double share = pairs > 1 ? static_cast<double>(k) / static_cast<double>(pairs - 1) : 0.5;
    const double omega = std::exp(low + share * (high - low));
    poles.pairs.emplace_back(-kDamping * omega, omega);
  }
  return poles;
}

/// (F, n) real partial fractions: of a pair their sum, and j times their difference.
MatrixXcd partial_fractions(const PoleSet& poles, const VectorXcd& s) {
  MatrixXcd phi(s.size(), 2 * std::ssize(poles.pairs) + std::ssize(poles.reals));
  Index column = 0;
  for (const Complex& pole : poles.pairs) {
    const VectorXcd upper = (s.array() - pole).inverse();
    const VectorXcd lower = (s.array() - std::conj(pole)).inverse();
    phi.col(column++) = upper + lower;
    phi.col(column++) = Complex(0.0, 1.0) * (upper - lower);
  }
  for (const double pole : poles.reals) phi.col(column++) = (s.array() - pole).inverse();
  return phi;
}

VectorXd least_squares(MatrixXd x, const VectorXd& y) {
  VectorXd norms = x.colwise().norm();
  for (Index k = 0; k < norms.size(); ++k) {
    if (norms[k] > 0.0) x.col(k) /= norms[k];
  }
  return x.householderQr().solve(y).cwiseQuotient(norms);
}

MatrixXd real_over_imaginary(const MatrixXcd& x) {
  MatrixXd result(2 * x.rows(), x.cols());
  result << x.real(), x.imag();
  return result;
}

/// c_1 .. c_n and d of sigma.
VectorXd sigma_coefficients(const MatrixXcd& phi, const VectorXcd& g, const VectorXd& weights) {
  const Index n = phi.cols();
  const Index tones = phi.rows();
  MatrixXcd x(tones, 2 * n + 1);
  x << phi, -(g.asDiagonal() * phi), -g;
  const MatrixXd rows = real_over_imaginary(weights.asDiagonal() * x);
  MatrixXd all(rows.rows() + 1, rows.cols());
  const double scale = weights.cwiseProduct(g.cwiseAbs()).norm() / static_cast<double>(tones);
  all.topRows(rows.rows()) = rows;
  all.bottomRows(1).setZero();
  all.block(rows.rows(), n, 1, n) = scale * phi.real().colwise().sum();
  all(rows.rows(), 2 * n) = scale * static_cast<double>(tones);
  VectorXd right = VectorXd::Zero(all.rows());
  right[rows.rows()] = scale * static_cast<double>(tones);
  return least_squares(all, right).tail(n + 1);
}

/// Eigenvalues of A - b c / d, reflected into the left half plane. Rows in descending size keep slow ones exact.
PoleSet moved(const PoleSet& poles, const VectorXd& sigma) {
  const Index n = sigma.size() - 1;
  MatrixXd a = MatrixXd::Zero(n, n);
  VectorXd b = VectorXd::Ones(n);
  Index k = 0;
  for (const Complex& pole : poles.pairs) {
    a.block(k, k, 2, 2) << pole.real(), pole.imag(), -pole.imag(), pole.real();
    b.segment(k, 2) << 2.0, 0.0;
    k += 2;
  }
  for (const double pole : poles.reals) {
    a(k, k) = pole;
    ++k;
  }
  const MatrixXd next = a - b * sigma.head(n).transpose() / sigma[n];
  PoleSet result;
  const VectorXcd values = Eigen::EigenSolver<MatrixXd>(MatrixXd(next.reverse()), false).eigenvalues();
  for (const Complex& value : values) {
    const Complex stable(-std::abs(value.real()), value.imag());
    if (value.imag() > 0.0) result.pairs.push_back(stable);
    if (value.imag() == 0.0) result.reals.push_back(stable.real());
  }
  const auto by_modulus = [](const auto& left, const auto& right) { return std::abs(left) < std::abs(right); };
  std::sort(result.pairs.begin(), result.pairs.end(), by_modulus);
  std::sort(result.reals.begin(), result.reals.end(), by_modulus);
  return result;
}

/// Relative move of a pole below which it stands still.
constexpr double kStill = 1e-10;

bool stands_still(const PoleSet& before, const PoleSet& after) {
  if (before.pairs.size() != after.pairs.size() || before.reals.size() != after.reals.size()) return false;
  const auto near = [](const auto& left, const auto& right) {
    return std::abs(left - right) < kStill * std::abs(right);
  };
  return std::equal(before.pairs.begin(), before.pairs.end(), after.pairs.begin(), near) &&
         std::equal(before.reals.begin(), before.reals.end(), after.reals.begin(), near);
}

PoleResidueModel with_residues(const PoleSet& poles, const VectorXd& coefficients) {
  PoleResidueModel model{VectorXcd(coefficients.size()), VectorXcd(coefficients.size())};
  Index k = 0;
  for (const Complex& pole : poles.pairs) {
    const Complex residue(coefficients[k], coefficients[k + 1]);
    model.poles.segment(k, 2) << pole, std::conj(pole);
    model.residues.segment(k, 2) << residue, std::conj(residue);
    k += 2;
  }
  for (const double pole : poles.reals) {
    model.poles[k] = pole;
    model.residues[k] = coefficients[k];
    ++k;
  }
  return model;
}

// ------------------------------------------------------------------------------------------------------------- AAA

VectorXcd evaluate(const BarycentricModel& model, const VectorXcd& s) {
  VectorXcd result(s.size());
  for (Index i = 0; i < s.size(); ++i) {
    Complex top = 0.0;
    Complex bottom = 0.0;
    bool exact = false;
    for (Index j = 0; j < model.support.size() && !exact; ++j) {
      exact = s[i] == model.support[j];
      if (exact) result[i] = model.values[j];
      const Complex share = model.weights[j] / (s[i] - model.support[j]);
      top += share * model.values[j];
      bottom += share;
    }
    if (!exact) result[i] = top / bottom;
  }
  return result;
}

/// Smallest right singular vector of the Loewner matrix over the tones that are no support points.
VectorXcd loewner_weights(const VectorXcd& z, const VectorXcd& f, const std::vector<Index>& support,
                          const std::vector<Index>& rest) {
  MatrixXcd loewner(std::ssize(rest), std::ssize(support));
  for (Index i = 0; i < loewner.rows(); ++i) {
    const Index row = rest[static_cast<std::size_t>(i)];
    for (Index j = 0; j < loewner.cols(); ++j) {
      const Index column = support[static_cast<std::size_t>(j)];
      loewner(i, j) = (f[row] - f[column]) / (z[row] - z[column]) / std::abs(f[row]);
    }
  }
  return Eigen::BDCSVD<MatrixXcd>(loewner, Eigen::ComputeFullV).matrixV().rightCols(1);
}

}  // namespace

VectorXcd response_at(const PoleResidueModel& model, const VectorXd& omega_rad_s) {
  VectorXcd g = VectorXcd::Zero(omega_rad_s.size());
  for (Index k = 0; k < model.poles.size(); ++k) {
    g.array() += model.residues[k] / (Complex(0.0, 1.0) * omega_rad_s.array() - model.poles[k]);
  }
  return g;
}

VectorFitting vector_fitting(const FrequencyResponse& data, const VectorXd& weights, Index order, int iterations) {
  const VectorXcd s = Complex(0.0, 1.0) * data.omega_rad_s;
  PoleSet poles = start_poles(data, order);
  VectorFitting result;
  for (bool still = false; !still && result.iterations < iterations; ++result.iterations) {
    PoleSet next = moved(poles, sigma_coefficients(partial_fractions(poles, s), data.response, weights));
    still = stands_still(poles, next);
    poles = std::move(next);
  }
  const MatrixXd x = real_over_imaginary(weights.asDiagonal() * partial_fractions(poles, s));
  const VectorXd y = real_over_imaginary(weights.asDiagonal() * data.response);
  result.model = with_residues(poles, least_squares(x, y));
  return result;
}

VectorXcd response_at(const BarycentricModel& model, const VectorXd& omega_rad_s) {
  return evaluate(model, Complex(0.0, 1.0) * omega_rad_s);
}

VectorXcd poles(const BarycentricModel& model) {
  // Zeros of c (s - Z)^-1 1, c = w': eigenvalues of (I - 1 c / (c 1)) Z besides one at zero.
  const Index count = model.support.size();
  const Complex sum = model.weights.sum();
  const MatrixXcd matrix = MatrixXcd(model.support.asDiagonal()) -
                           VectorXcd::Ones(count) * model.weights.cwiseProduct(model.support).transpose() / sum;
  VectorXcd values = Eigen::ComplexEigenSolver<MatrixXcd>(matrix, false).eigenvalues();
  std::sort(values.begin(), values.end(),
            [](const Complex& left, const Complex& right) { return std::abs(left) < std::abs(right); });
  return values.tail(count - 1);
}

BarycentricModel aaa(const FrequencyResponse& data, double tolerance, Index max_degree) {
  const Index tones = data.response.size();
  VectorXcd z(2 * tones);
  VectorXcd f(2 * tones);
  z << Complex(0.0, 1.0) * data.omega_rad_s, Complex(0.0, -1.0) * data.omega_rad_s;
  f << data.response, data.response.conjugate();
  std::vector<Index> support;
  std::vector<Index> rest;
  for (Index k = 0; k < 2 * tones; ++k) rest.push_back(k);
  BarycentricModel model;
  VectorXcd fitted = VectorXcd::Constant(2 * tones, f.mean());
  while (std::ssize(support) + 1 <= max_degree && std::ssize(rest) > std::ssize(support) + 2) {
    const Eigen::ArrayXd error = (fitted - f).array().abs() / f.array().abs();
    Index worst = 0;
    if (error.head(tones).maxCoeff(&worst) <= tolerance) break;
    for (const Index chosen : {worst, worst + tones}) {
      support.push_back(chosen);
      rest.erase(std::find(rest.begin(), rest.end(), chosen));
    }
    model = {z(support), f(support), loewner_weights(z, f, support, rest)};
    fitted = evaluate(model, z);
  }
  return model;
}

}  // namespace blockid::testing
