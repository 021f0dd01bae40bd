#include <blockid/estimators/continuous_fit.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/estimators/detail/break_point_relocation.hpp>
#include <blockid/estimators/detail/continuous_equation.hpp>
#include <blockid/estimators/detail/held_states.hpp>
#include <blockid/estimators/excited_band.hpp>
#include <blockid/estimators/frequency_fit.hpp>

#include <blockid/blocks/detail/hold.hpp>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace blockid {
namespace {

using detail::ContinuousEquation;
using detail::ContinuousUnknowns;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::array<std::pair<ContinuousMethod, const char*>, 3> kMethods = {
    {{ContinuousMethod::least_squares, "ls"},
     {ContinuousMethod::instrumental_variables, "iv"},
     {ContinuousMethod::refined_instrumental_variables, "srivc"}}};

/// A step that moves the output by less, relative to it, is rounding: that of a recursion over N = 1e5..1e6 samples, a
/// random walk of epsilon sqrt(N) = 1e-13 in every column, a hundred times larger after columns have cancelled.
constexpr double kRounding = 1e-10;
/// Where a pole on the imaginary axis is put, relative to its modulus.
constexpr double kLeastDamping = 1e-6;
constexpr int kMaxRelocations = 5;
/// Fits whose simulations differ by less are one: then the smaller drift is better.
constexpr double kSameRms = 1.0 + 1e-6;

// ------------------------------------------------------------------------------------------------------- prefilters

/// d of the fixed prefilter 1/E: (z + 1)^n = z^n + sum_k (n over k-1) z^(k-1) in powers of z = s / p.
VectorXd fixed_prefilter(const RationalBasis& basis) {
  VectorXd d = VectorXd::Zero(basis.order);
  if (basis.kind != BasisKind::monomial) return d;
  double binomial = 1.0;
  for (Index k = 0; k < basis.order; ++k) {
    d[k] = binomial;
    binomial *= static_cast<double>(basis.order - k) / static_cast<double>(k + 1);
  }
  return d;
}

VectorXcd poles_of(const RationalBasis& basis, const VectorXd& a) {
  return poles({basis, a, VectorXd::Zero(basis.numerator_degree + 1)});
}

/// A/E times prod (s - mirrored pole) / (s - pole) over the poles that are not stable: of the same modulus at all
/// frequencies. Back into the basis by least squares over frequencies around the poles, where the equation is exact.
VectorXd stabilised(const RationalBasis& basis, const VectorXd& a) {
  const VectorXcd roots = poles_of(basis, a);
  if ((roots.real().array() < 0.0).all()) return a;
  const VectorXd moduli = roots.cwiseAbs();
  const double highest = std::max(moduli.maxCoeff(), basis.points[0]);
  const double lowest = std::max(moduli.minCoeff(), 1e-12 * highest);
  const VectorXd omega = break_points(lowest / 3.0, 3.0 * highest, 6 * basis.order);
  const BasisValues values = evaluate(basis, omega);
  VectorXcd denominator = values.lead + values.phi * a;
  for (const Complex& root : roots) {
    if (root.real() < 0.0) continue;
    const Complex mirrored(std::min(-root.real(), -kLeastDamping * std::abs(root)), root.imag());
    for (Index k = 0; k < omega.size(); ++k) {
      const Complex s(0.0, omega[k]);
      denominator[k] *= (s - mirrored) / (s - root);
    }
  }
  // Rows of equal size, columns of equal size.
  const VectorXcd weights = denominator.cwiseAbs().cwiseInverse().cast<Complex>();
  const MatrixXd x = stacked(weights.asDiagonal() * values.phi);
  const VectorXd y = stacked(weights.cwiseProduct(denominator - values.lead));
  const VectorXd norms = x.colwise().norm();
  return (x * norms.cwiseInverse().asDiagonal()).colPivHouseholderQr().solve(y).cwiseQuotient(norms);
}

// -------------------------------------------------------------------------------------------------------- estimates

/// An estimate under one prefilter, x = [c.., b, a - d].
struct Estimate {
  VectorXd x;
  Index rank = 0;
  /// e'e of the filtered equation.
  double sum_of_squares = 0.0;
  /// (P, P) covariance of x for s = 1.
  MatrixXd covariance;
};

Estimate least_squares(const QrTriangle& regression) {
  const LinearSolution solution = solve_least_squares(regression);
  return {solution.x, solution.rank, solution.residual_sum_of_squares, scaled_pseudo_inverse(regression).matrix};
}

/// The triangle of rows of upper triangular matrices: a QrTriangle of a part of another.
QrTriangle triangle_of(const MatrixXd& rows) {
  const RowMajor tile = rows;
  QrTriangle result(tile.cols());
  result.add(tile.data(), tile.rows(), tile.cols());
  return result;
}

/// R of the columns [Z, X_y | y], Z = [f, u-part, instruments of y], X = [f, u-part, X_y].
class InstrumentTriangle {
 public:
  InstrumentTriangle(const QrTriangle& triangle, Index order)
      : r_(triangle.triangle()), order_(order), unknowns_(triangle.columns() - 1 - order) {}

  /// Z'X x = Z'y is R_zx x = r_z, Z = Q R_zz.
  Estimate estimate() const {
    const QrTriangle square = triangle_of(equations(unknowns_));
    const LinearSolution solution = solve_least_squares(square);
    const MatrixXd all = equations(r_.rows());
    return {solution.x, solution.rank, (all.leftCols(unknowns_) * solution.x - all.col(unknowns_)).squaredNorm(),
            scaled_pseudo_inverse(square).matrix};
  }
  /// (Z'Z)^+.
  MatrixXd instrument_covariance() const {
    return scaled_pseudo_inverse(triangle_of(r_.topLeftCorner(unknowns_, unknowns_ + 1))).matrix;
  }
  /// |Z step|: how far a step moves the output, to first order.
  double moved(const VectorXd& step) const {
    return (r_.topLeftCorner(unknowns_, unknowns_).triangularView<Eigen::Upper>() * step).norm();
  }

 private:
  /// The first rows of [f, u-part, X_y | y].
  MatrixXd equations(Index rows) const {
    MatrixXd result(rows, unknowns_ + 1);
    result << r_.topLeftCorner(rows, unknowns_ - order_), r_.topRows(rows).rightCols(order_ + 1);
    return result;
  }

  MatrixXd r_;
  Index order_;
  Index unknowns_;
};

/// An estimate with the prefilter under which it was found.
struct Found {
  ContinuousUnknowns theta;
  Estimate estimate;
  int iterations = 1;
  bool converged = true;
};

/// Instruments from the output of theta, its denominator made stable.
InstrumentTriangle instruments(const ContinuousEquation& equation, const ContinuousUnknowns& theta, const VectorXd& d) {
  ContinuousUnknowns stable = theta;
  stable.a = stabilised(equation.basis(), theta.a);
  return {equation.regression(d, stable), equation.order()};
}

Found instrumental_variables(const ContinuousEquation& equation, const Found& start) {
  const VectorXd d = fixed_prefilter(equation.basis());
  Estimate estimate = instruments(equation, start.theta, d).estimate();
  ContinuousUnknowns theta = equation.unknowns_of(estimate.x, d);
  return {std::move(theta), std::move(estimate), start.iterations + 1, true};
}

double deviation(const ContinuousEquation& equation, double sum_of_squares) {
  const Index freedom = equation.rows() - equation.unknowns();
  return freedom > 0 ? std::sqrt(sum_of_squares / static_cast<double>(freedom)) : 0.0;
}

double output_norm(const ContinuousEquation& equation) {
  double sum = 0.0;
  for (const detail::ContinuousRun& run : equation.runs()) {
    sum += run.weights.size() > 0 ? run.y.cwiseProduct(run.weights).squaredNorm() : run.y.squaredNorm();
  }
  return std::sqrt(sum);
}

bool is_finite(const ContinuousUnknowns& theta) {
  return theta.a.allFinite() && theta.b.allFinite() &&
         std::all_of(theta.c.begin(), theta.c.end(), [](const VectorXd& c) { return c.allFinite(); });
}

/// Whether an iterate is to be kept instead of another: a stable one beats one that is not, then the smaller error of
/// the prefiltered equation.
struct Merit {
  bool stable = false;
  double sum_of_squares = std::numeric_limits<double>::infinity();
  bool operator>(const Merit& other) const {
    return stable != other.stable ? stable : sum_of_squares < other.sum_of_squares;
  }
};

/// The iterate that stands still, otherwise the best.
Found refined(const ContinuousEquation& equation, const Found& start, const ContinuousFitOptions& options) {
  const double rounding = kRounding * output_norm(equation);
  const double share = options.tolerance * std::sqrt(static_cast<double>(equation.unknowns()));
  Found best = start;
  best.converged = false;
  Merit merit;
  ContinuousUnknowns theta = start.theta;
  for (int k = 1; k <= options.max_iterations && !best.converged; ++k) {
    const VectorXd d = stabilised(equation.basis(), theta.a);
    theta.a = d;
    const InstrumentTriangle triangle = instruments(equation, theta, d);
    Estimate estimate = triangle.estimate();
    const VectorXd step = estimate.x - equation.coordinates_of(theta, d);
    theta = equation.unknowns_of(estimate.x, d);
    best.iterations = start.iterations + k;
    if (!is_finite(theta)) break;
    best.converged = triangle.moved(step) <= share * deviation(equation, estimate.sum_of_squares) + rounding;
    const Merit here{(poles_of(equation.basis(), theta.a).real().array() < 0.0).all(), estimate.sum_of_squares};
    if (!best.converged && !(here > merit)) continue;
    merit = here;
    best.theta = theta;
    best.estimate = std::move(estimate);
    best.estimate.covariance = triangle.instrument_covariance();
  }
  return best;
}

Found found_by(const ContinuousEquation& equation, const QrTriangle& regression, const VectorXd& prefilter,
               const ContinuousFitOptions& options) {
  Estimate first = least_squares(regression);
  ContinuousUnknowns theta = equation.unknowns_of(first.x, prefilter);
  Found found{std::move(theta), std::move(first), 1, true};
  if (!is_finite(found.theta)) fail("continuous fit: the least-squares problem has no finite solution");
  if (options.method == ContinuousMethod::least_squares) return found;
  Found instrumental = instrumental_variables(equation, found);
  if (options.method == ContinuousMethod::instrumental_variables) return instrumental;
  return refined(equation, is_finite(instrumental.theta) ? instrumental : found, options);
}

// ------------------------------------------------------------------------------------------------------ what goes out

/// Covariance of [a, b] from that of [c.., b, a].
MatrixXd model_covariance(const ContinuousEquation& equation, const MatrixXd& covariance) {
  const Index n = equation.order();
  const Index m = equation.numerators();
  std::vector<Index> order;
  for (Index k = 0; k < n; ++k) order.push_back(equation.initial_columns() + m + k);
  for (Index k = 0; k < m; ++k) order.push_back(equation.initial_columns() + k);
  return covariance(order, order);
}

/// See ContinuousFit::drift. Poles are taken into the band first: beyond it nothing of them is seen.
double drift_of(const ContinuousTransferFunction& model, const FrequencyRange& band) {
  if (model.basis.kind != BasisKind::localising) return 1.0;
  constexpr Index kFrequencies = 100;
  const VectorXd moduli = poles(model).cwiseAbs().cwiseMax(band.low).cwiseMin(band.high);
  Eigen::ArrayXd logarithm = Eigen::ArrayXd::Zero(kFrequencies);
  const Eigen::ArrayXd omega = break_points(band.low, band.high, kFrequencies).array();
  for (Index k = 0; k < moduli.size(); ++k) {
    logarithm += 0.5 * ((omega.square() + moduli[k] * moduli[k]).log() -
                        (omega.square() + std::pow(model.basis.points[k], 2)).log());
  }
  return std::exp(logarithm.maxCoeff() - logarithm.minCoeff());
}

bool outside_band(const ContinuousEquation& equation, const DataSet& data) {
  Index longest = 0;
  for (const Record& record : data.records) longest = std::max(longest, record.u.size());
  const double nyquist = std::numbers::pi / equation.sample_time_s();
  const double lowest = 2.0 * nyquist / static_cast<double>(longest);
  const RationalBasis& basis = equation.basis();
  const VectorXd points = basis.kind == BasisKind::kautz ? VectorXd(basis.points.head(1)) : basis.points;
  return points.minCoeff() < lowest || points.maxCoeff() > nyquist;
}

}  // namespace

std::string to_text(ContinuousMethod method) {
  for (const auto& [entry, name] : kMethods) {
    if (entry == method) return name;
  }
  return "unknown";
}

ContinuousMethod continuous_method(const std::string& name) {
  std::string names;
  for (const auto& [method, entry] : kMethods) {
    if (name == entry) return method;
    names += (names.empty() ? "" : ", ") + std::string(entry);
  }
  fail("continuous fit: unknown method '", name, "', expected one of ", names);
}

std::vector<std::string> texts(const ContinuousFitFlags& flags) {
  std::vector<std::string> result;
  if (flags.unstable) result.emplace_back("the model is unstable: a pole lies in the right half plane");
  if (flags.break_points_outside_band) {
    result.emplace_back("break points lie outside the band of the data: below one turn a record or above Nyquist");
  }
  if (flags.rank_deficient) result.emplace_back("the data do not determine all unknowns");
  if (flags.not_converged) result.emplace_back("the iterations did not converge");
  if (flags.drift) result.emplace_back("|A/E| drifts by more than 1000 over the band: digits are lost");
  if (flags.relocated) result.emplace_back("break points were relocated");
  return result;
}

RationalBasis state_variable_basis(Index order, Index numerator_degree, double pole_rad_s) {
  return monomial_basis(order, numerator_degree, pole_rad_s);
}

namespace {

/// In the basis as it is.
ContinuousFit fit_in(const DataSet& data, const RationalBasis& basis, const ContinuousFitOptions& options) {
  const ContinuousEquation equation(data, basis, options);
  const VectorXd prefilter = fixed_prefilter(basis);
  const QrTriangle regression = equation.regression(prefilter);
  const MatrixXd x = regression.triangle().leftCols(equation.unknowns());
  const Found found = found_by(equation, regression, prefilter, options);
  ContinuousFit fit;
  fit.model = {basis, found.theta.a, found.theta.b};
  fit.initial_conditions = found.theta.c;
  fit.rows = equation.rows();
  fit.unknowns = equation.unknowns();
  fit.rank = found.estimate.rank;
  fit.iterations = found.iterations;
  fit.condition = squared_condition(x);
  fit.condition_normalised = squared_condition(normalised_columns(x));
  fit.rms = std::sqrt(found.estimate.sum_of_squares / static_cast<double>(fit.rows));
  fit.noise_deviation = deviation(equation, found.estimate.sum_of_squares);
  fit.covariance = std::pow(fit.noise_deviation, 2) * model_covariance(equation, found.estimate.covariance);
  fit.pole_deviations = pole_deviations(fit.model, fit.covariance);
  fit.flags.unstable = !is_stable(fit.model);
  fit.flags.break_points_outside_band = outside_band(equation, data);
  fit.flags.rank_deficient = fit.rank < fit.unknowns;
  fit.flags.not_converged = !found.converged;
  fit.drift = drift_of(fit.model, sampled_band(data));
  fit.flags.drift = fit.drift > kDriftLimit;
  return fit;
}

/// A fit with what it is judged by.
struct Judged {
  ContinuousFit fit;
  double rms = std::numeric_limits<double>::infinity();

  bool better_than(const Judged& other) const {
    if (fit.flags.unstable != other.fit.flags.unstable) return other.fit.flags.unstable;
    if (rms > other.rms * kSameRms) return false;
    return rms * kSameRms < other.rms || fit.drift < other.fit.drift;
  }
};

ContinuousFit relocated(const DataSet& data, const RationalBasis& given, ContinuousFit start,
                        const ContinuousFitOptions& options) {
  const FrequencyRange all = sampled_band(data);
  Judged best{std::move(start), 0.0};
  best.rms = simulation_rms(best.fit.model, data, options);
  int relocations = 0;
  const auto attempt = [&](const VectorXd& points) {
    RationalBasis basis = given;
    basis.points = points;
    Judged next{fit_in(data, basis, options), 0.0};
    next.rms = simulation_rms(next.fit.model, data, options);
    ++relocations;
    if (next.better_than(best)) best = next;
    return next.fit;
  };
  const auto settle = [&](ContinuousFit current) {
    for (int k = 0; k < kMaxRelocations && current.flags.drift; ++k) {
      current = attempt(detail::relocated_points(poles(current.model), all));
    }
  };
  settle(best.fit);
  const FrequencyRange band = excited_band(data);
  settle(attempt(break_points(band.low, band.high, given.order)));
  best.fit.relocations = relocations;
  best.fit.flags.relocated = best.fit.model.basis.points != given.points;
  return best.fit;
}

}  // namespace

ContinuousFit fit_continuous(const DataSet& data, const RationalBasis& basis, const ContinuousFitOptions& options) {
  ContinuousFit fit = fit_in(data, basis, options);
  if (!options.relocate || !fit.flags.drift) return fit;
  const bool outside = fit.flags.break_points_outside_band;
  fit = relocated(data, basis, std::move(fit), options);
  fit.flags.break_points_outside_band = outside;
  return fit;
}

ContinuousFit fit_continuous(const DataSet& data, Index numerator_degree, Index order,
                             const ContinuousFitOptions& options) {
  check(data);
  if (order < 1) fail("continuous fit: expected an order of at least 1, got ", order);
  const FrequencyRange band = excited_band(data);
  return fit_continuous(data, localising_basis(break_points(band.low, band.high, order), numerator_degree), options);
}

double simulation_rms(const ContinuousTransferFunction& model, const DataSet& data,
                      const ContinuousFitOptions& options) {
  double sum = 0.0;
  double counted = 0.0;
  for (const Record& record : data.records) {
    const VectorXd y = simulate(model, record, {options.input_hold, options.initial_state, options.warmup});
    for (Index t = options.warmup; t < y.size(); ++t) {
      if (is_missing(record, t)) continue;
      sum += std::pow(weight(record, t) * (record.y[t] - y[t]), 2);
      counted += 1.0;
    }
  }
  const double rms = std::sqrt(sum / counted);
  return std::isfinite(rms) ? rms : std::numeric_limits<double>::infinity();
}

}  // namespace blockid
