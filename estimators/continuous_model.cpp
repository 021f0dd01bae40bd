#include <blockid/estimators/continuous_model.hpp>

#include <blockid/blocks/localising_basis.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/orthogonal_factor.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

namespace blockid {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

/// Ascending modulus; of a pair the root with positive imaginary part first.
bool before(const Complex& left, const Complex& right) {
  const double a = std::abs(left);
  const double b = std::abs(right);
  return a != b ? a < b : left.imag() > right.imag();
}

VectorXcd sorted(VectorXcd roots) {
  std::sort(roots.begin(), roots.end(), before);
  return roots;
}

struct EigenSystem {
  VectorXcd values;
  MatrixXcd right;
  MatrixXcd left;  ///< inverse of `right`
};

/// In long double: Eigen's iteration takes for zero what is below epsilon^2 of the norm, 5e-32 in double, 1e-38 in long
/// double, and the rows of a matrix over many decades differ by more than the former.
EigenSystem eigensystem(const MatrixXd& matrix, bool vectors) {
  using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Matrix wide = matrix.cast<long double>();
  const Eigen::EigenSolver<Matrix> solver(wide, vectors);
  if (solver.info() != Eigen::Success) fail("continuous model: the eigenvalue iteration did not converge");
  EigenSystem result{solver.eigenvalues().cast<Complex>(), {}, {}};
  if (!vectors) return result;
  // Of a pair the columns of `real` are the real and the imaginary part of the first eigenvector.
  const Matrix& real = solver.pseudoEigenvectors();
  const Matrix inverse = real.fullPivLu().inverse();
  result.right = real.cast<Complex>();
  result.left = inverse.cast<Complex>();
  for (Index k = 0; k + 1 < real.cols(); ++k) {
    if (!(result.values[k].imag() > 0.0)) continue;
    const Complex i(0.0, 1.0);
    result.right.col(k) += i * result.right.col(k + 1);
    result.right.col(k + 1) = result.right.col(k).conjugate();
    result.left.row(k) = 0.5 * (result.left.row(k) - i * result.left.row(k + 1)).eval();
    result.left.row(k + 1) = result.left.row(k).conjugate();
  }
  return result;
}

VectorXcd eigenvalues(const MatrixXd& matrix) {
  if (matrix.rows() == 0) return {};
  return sorted(eigensystem(matrix, false).values);
}

/// Of A - B c / d: the zeros of d + c (sI - A)^-1 B.
VectorXcd zeros_of_proper(const MatrixXd& a, const VectorXd& b, const RowVectorXd& c, double d) {
  return eigenvalues(a - b * (c / d));
}

[[noreturn]] void fail_degree(Index m) {
  fail("zeros: the numerator's coefficient of s^", m, " vanishes, expected a numerator of full degree");
}

/// sum_{k <= m+1} b_k phi_k times (s + p_(m+1)) is proper on the first m states.
VectorXcd localising_zeros(const ContinuousTransferFunction& model) {
  const Index m = model.basis.numerator_degree;
  const VectorXd& p = model.basis.points;
  const VectorXd& b = model.numerator;
  const double last = b[m] * p[m];
  RowVectorXd c(m);
  double sum = last;
  for (Index j = m - 1; j >= 0; --j) {
    sum += b[j] * p[j];
    c[j] = p[m] * b[j] - sum;
  }
  if (sum == 0.0) fail_degree(m);
  if (m == 0) return {};
  FilterBank bank = filter_bank(localising_basis(p.head(m), m - 1));
  return zeros_of_proper(bank.a.reverse(), bank.b.reverse(), c.reverse(), sum);
}

/// Of a polynomial in the basis: its comrade matrix.
VectorXcd polynomial_zeros(const ContinuousTransferFunction& model) {
  const Index m = model.basis.numerator_degree;
  if (model.numerator[m] == 0.0) fail_degree(m);
  if (m == 0) return {};
  RationalBasis basis = model.basis;
  basis.order = m;
  basis.numerator_degree = 0;
  const FilterBank bank = filter_bank(basis);
  return eigenvalues(bank.a - bank.b * (model.numerator.head(m).transpose() / model.numerator[m]));
}

/// Of c (sI - A)^-1 B with g = c B: eigenvalues of (I - B c / g) A on the null space of c.
VectorXcd zeros_of_strictly_proper(const FilterBank& bank, const RowVectorXd& c) {
  const Index n = c.size();
  const double g = c * bank.b;
  if (g == 0.0) fail_degree(n - 1);
  if (n == 1) return {};
  const Eigen::HouseholderQR<MatrixXd> qr(c.transpose());
  const MatrixXd null_space = q_times(qr.householderQ(), MatrixXd::Identity(n, n).rightCols(n - 1));
  const MatrixXd image = bank.a * null_space;
  return eigenvalues(null_space.transpose() * (image - bank.b * (c * image / g)));
}

/// sqrt(j C j'): of a quantity with the gradient j.
double deviation(const RowVectorXd& gradient, const MatrixXd& covariance) {
  return std::sqrt(std::max((gradient * covariance * gradient.transpose()).value(), 0.0));
}

/// log|prod (s - root)| and its phase.
struct LogProduct {
  double logarithm = 0.0;
  double phase = 0.0;
};
LogProduct product_of_distances(const VectorXcd& roots, const Complex& s) {
  LogProduct result;
  for (const Complex& root : roots) {
    result.logarithm += std::log(std::abs(s - root));
    result.phase += std::arg(s - root);
  }
  return result;
}

double reference_frequency(const RationalBasis& basis) {
  return basis.kind == BasisKind::localising ? std::exp(basis.points.array().log().mean()) : basis.points[0];
}

/// Roots in groups of at most two: pairs, and real ones with their neighbours.
std::vector<std::vector<Complex>> in_pairs(const VectorXcd& roots) {
  std::vector<std::vector<Complex>> groups;
  std::vector<Complex> reals;
  for (const Complex& root : roots) {
    if (root.imag() == 0.0) reals.push_back(root);
    if (root.imag() > 0.0) groups.push_back({root, std::conj(root)});
  }
  for (std::size_t k = 0; k < reals.size(); k += 2) {
    groups.emplace_back(reals.begin() + static_cast<std::ptrdiff_t>(k),
                        reals.begin() + static_cast<std::ptrdiff_t>(std::min(k + 2, reals.size())));
  }
  return groups;
}

double frequency_of(const std::vector<Complex>& roots) {
  double logarithm = 0.0;
  for (const Complex& root : roots) logarithm += std::log(std::max(std::abs(root), 1e-300));
  return std::exp(logarithm / static_cast<double>(roots.size()));
}

/// prod (z - root / scale), lowest power first.
Eigen::Vector3d monic(const std::vector<Complex>& roots, double scale) {
  if (roots.empty()) return {1.0, 0.0, 0.0};
  if (roots.size() == 1) return {-roots[0].real() / scale, 1.0, 0.0};
  return {(roots[0] / scale * (roots[1] / scale)).real(), -((roots[0] + roots[1]) / scale).real(), 1.0};
}

Complex value(const SecondOrderSection& section, const Complex& s) {
  const Complex z = s / section.scale_rad_s;
  const auto at = [&](const Eigen::Vector3d& c) { return c[0] + z * (c[1] + z * c[2]); };
  return at(section.numerator) / at(section.denominator);
}

/// For each group of zeros the free group of poles nearest in frequency, wide groups first.
std::vector<std::vector<Complex>> assigned(const std::vector<std::vector<Complex>>& poles,
                                           std::vector<std::vector<Complex>> zeros) {
  std::vector<std::vector<Complex>> result(poles.size());
  std::stable_sort(zeros.begin(), zeros.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  for (const std::vector<Complex>& group : zeros) {
    const double frequency = std::log(frequency_of(group));
    const auto distance = [&](std::size_t k) { return std::abs(std::log(frequency_of(poles[k])) - frequency); };
    std::size_t best = poles.size();
    for (std::size_t k = 0; k < poles.size(); ++k) {
      const bool fits = result[k].empty() && group.size() <= poles[k].size();
      if (fits && (best == poles.size() || distance(k) < distance(best))) best = k;
    }
    if (best < poles.size()) result[best] = group;
  }
  return result;
}

}  // namespace

void check(const ContinuousTransferFunction& model) {
  check(model.basis);
  if (model.denominator.size() != model.basis.order) {
    fail("continuous model: expected ", model.basis.order, " denominator coefficients, got ", model.denominator.size());
  }
  if (model.numerator.size() != model.basis.numerator_degree + 1) {
    fail("continuous model: expected ", model.basis.numerator_degree + 1, " numerator coefficients, got ",
         model.numerator.size());
  }
  if (!model.denominator.allFinite() || !model.numerator.allFinite()) {
    fail("continuous model: expected finite coefficients");
  }
}

VectorXcd response_at(const ContinuousTransferFunction& model, const VectorXd& omega_rad_s) {
  check(model);
  const BasisValues values = evaluate(model.basis, omega_rad_s);
  return (values.psi * model.numerator).array() / (values.lead + values.phi * model.denominator).array();
}

FrequencyResponse frequency_response(const ContinuousTransferFunction& model, const VectorXd& omega_rad_s) {
  return {omega_rad_s, response_at(model, omega_rad_s), {}, 0.0};
}

double denominator_drift(const ContinuousTransferFunction& model, const VectorXd& omega_rad_s) {
  check(model);
  const BasisValues values = evaluate(model.basis, omega_rad_s);
  const Eigen::ArrayXd size = (values.lead + values.phi * model.denominator).array().abs();
  return size.maxCoeff() / size.minCoeff();
}

StateSpace state_space(const ContinuousTransferFunction& model) {
  check(model);
  const Index n = model.basis.order;
  const FilterBank bank = filter_bank(model.basis);
  const VectorXd output = numerator_map(model.basis) * model.numerator;
  StateSpace result;
  result.a = bank.a - bank.b * model.denominator.transpose();
  result.b = bank.b;
  result.d = output[n];
  result.c = (output.head(n) - output[n] * model.denominator).transpose();
  if (model.basis.kind != BasisKind::localising) return result;
  return {result.a.reverse(), result.b.reverse(), result.c.reverse(), result.d};
}

VectorXcd poles(const ContinuousTransferFunction& model) {
  const StateSpace system = state_space(model);
  if (model.basis.kind != BasisKind::localising) return eigenvalues(system.a);
  const VectorXd& p = model.basis.points;
  return sorted(LocalisingBasis({p.begin(), p.end()}).poles(model.denominator));
}

VectorXcd zeros(const ContinuousTransferFunction& model) {
  check(model);
  if (model.numerator.isZero(0.0)) return {};
  const Index n = model.basis.order;
  if (model.basis.kind == BasisKind::monomial || model.basis.kind == BasisKind::chebyshev) {
    return polynomial_zeros(model);
  }
  if (model.basis.numerator_degree < n) {
    if (model.basis.kind == BasisKind::localising) return localising_zeros(model);
    return zeros_of_strictly_proper(filter_bank(model.basis), model.numerator.transpose());
  }
  const StateSpace system = state_space(model);
  if (system.d == 0.0) fail_degree(n);
  return zeros_of_proper(system.a, system.b, system.c, system.d);
}

bool is_stable(const ContinuousTransferFunction& model) { return (poles(model).real().array() < 0.0).all(); }

MatrixXcd pole_sensitivities(const ContinuousTransferFunction& model) {
  const StateSpace system = state_space(model);
  const EigenSystem eigen = eigensystem(system.a, true);
  std::vector<Index> order(static_cast<std::size_t>(eigen.values.size()));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [&](Index i, Index j) { return before(eigen.values[i], eigen.values[j]); });
  MatrixXcd result(eigen.values.size(), eigen.values.size());
  for (Index k = 0; k < result.rows(); ++k) {
    const Index place = order[static_cast<std::size_t>(k)];
    const Complex drive = eigen.left.row(place) * system.b.cast<Complex>();
    result.row(k) = -drive * eigen.right.col(place).transpose();
  }
  if (model.basis.kind == BasisKind::localising) return result.rowwise().reverse();
  return result;
}

PoleDeviations pole_deviations(const ContinuousTransferFunction& model, const MatrixXd& covariance) {
  const Index n = model.basis.order;
  const VectorXcd roots = poles(model);
  const MatrixXcd sensitivities = pole_sensitivities(model);
  const MatrixXd denominator = covariance.topLeftCorner(n, n);
  PoleDeviations result{VectorXd(n), VectorXd(n), VectorXd(n), VectorXd(n)};
  for (Index k = 0; k < n; ++k) {
    // d log(pole) = d log(modulus) + j d angle, and d(-cos angle) = sin(angle) d angle.
    const double modulus = std::max(std::abs(roots[k]), std::numeric_limits<double>::min());
    const MatrixXcd relative = sensitivities.row(k) / (roots[k] == 0.0 ? Complex(modulus) : roots[k]);
    result.real[k] = deviation(sensitivities.row(k).real(), denominator);
    result.imaginary[k] = deviation(sensitivities.row(k).imag(), denominator);
    result.frequency[k] = modulus * deviation(relative.real(), denominator);
    result.damping[k] = std::abs(roots[k].imag()) / modulus * deviation(relative.imag(), denominator);
  }
  return result;
}

VectorXd response_deviation(const ContinuousTransferFunction& model, const MatrixXd& covariance,
                            const VectorXd& omega_rad_s) {
  const BasisValues values = evaluate(model.basis, omega_rad_s);
  const VectorXcd scale = (values.lead + values.phi * model.denominator).cwiseInverse();
  const VectorXcd g = response_at(model, omega_rad_s);
  MatrixXcd sensitivity(omega_rad_s.size(), covariance.rows());
  sensitivity << scale.cwiseProduct(-g).asDiagonal() * values.phi, scale.asDiagonal() * values.psi;
  VectorXd result(omega_rad_s.size());
  for (Index k = 0; k < result.size(); ++k) {
    result[k] =
        std::hypot(deviation(sensitivity.row(k).real(), covariance), deviation(sensitivity.row(k).imag(), covariance));
  }
  return result;
}

RationalPolynomials polynomials(const ContinuousTransferFunction& model) {
  return polynomials(model, reference_frequency(model.basis));
}

RationalPolynomials polynomials(const ContinuousTransferFunction& model, double scale_rad_s) {
  check(model);
  if (!(scale_rad_s > 0.0) || !std::isfinite(scale_rad_s)) {
    fail("continuous model: expected a positive frequency scale, got ", scale_rad_s);
  }
  const BasisPolynomials basis = polynomials(model.basis, scale_rad_s);
  const VectorXd denominator = basis.lead + basis.phi * model.denominator;
  const double leading = denominator[denominator.size() - 1];
  RationalPolynomials result{(basis.psi * model.numerator / leading).head(model.numerator.size()),
                             denominator / leading, scale_rad_s};
  if (!result.numerator.allFinite() || !result.denominator.allFinite()) {
    fail(
        "continuous model: polynomial coefficients overflow over a band this wide, expected the basis form, poles and "
        "zeros, or second-order sections to be used");
  }
  return result;
}

ZeroPoleGain zero_pole_gain(const ContinuousTransferFunction& model) {
  ZeroPoleGain result{zeros(model), poles(model), 0.0};
  if (model.numerator.isZero(0.0)) return result;
  const double omega = reference_frequency(model.basis);
  const Complex s(0.0, omega);
  const Complex g = response_at(model, VectorXd::Constant(1, omega))[0];
  const LogProduct top = product_of_distances(result.zeros, s);
  const LogProduct bottom = product_of_distances(result.poles, s);
  const double size = std::exp(std::log(std::abs(g)) + bottom.logarithm - top.logarithm);
  if (!std::isnormal(size)) {
    fail(
        "continuous model: the gain of the zero-pole form is beyond the range of numbers, expected second-order "
        "sections to be used");
  }
  result.gain = std::copysign(size, std::cos(std::arg(g) + bottom.phase - top.phase));
  return result;
}

std::vector<SecondOrderSection> second_order_sections(const ContinuousTransferFunction& model) {
  std::vector<std::vector<Complex>> pole_groups = in_pairs(poles(model));
  std::sort(pole_groups.begin(), pole_groups.end(),
            [](const auto& a, const auto& b) { return frequency_of(a) < frequency_of(b); });
  const std::vector<std::vector<Complex>> zero_groups = assigned(pole_groups, in_pairs(zeros(model)));
  std::vector<SecondOrderSection> sections;
  for (std::size_t k = 0; k < pole_groups.size(); ++k) {
    SecondOrderSection section;
    section.scale_rad_s = frequency_of(pole_groups[k]);
    section.denominator = monic(pole_groups[k], section.scale_rad_s);
    section.numerator = monic(zero_groups[k], section.scale_rad_s);
    sections.push_back(section);
  }
  // One gain for all, shared out evenly so that no section overflows.
  const double omega = reference_frequency(model.basis);
  double logarithm = 0.0;
  double phase = 0.0;
  for (const SecondOrderSection& section : sections) {
    const Complex part = value(section, Complex(0.0, omega));
    logarithm += std::log(std::abs(part));
    phase += std::arg(part);
  }
  const Complex g = response_at(model, VectorXd::Constant(1, omega))[0];
  const double share = std::exp((std::log(std::abs(g)) - logarithm) / static_cast<double>(sections.size()));
  for (SecondOrderSection& section : sections) section.numerator *= share;
  if (std::cos(std::arg(g) - phase) < 0.0) sections.front().numerator *= -1.0;
  return sections;
}

}  // namespace blockid
