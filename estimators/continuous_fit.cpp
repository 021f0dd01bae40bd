#include <blockid/estimators/continuous_fit.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/estimators/detail/coefficient_constraints.hpp>
#include <blockid/estimators/detail/continuous_equation.hpp>
#include <blockid/estimators/detail/continuous_fit_in_basis.hpp>
#include <blockid/estimators/detail/held_states.hpp>
#include <blockid/estimators/detail/mirrored_denominator.hpp>
#include <blockid/estimators/excited_band.hpp>
#include <blockid/estimators/frequency_fit.hpp>

#include <blockid/blocks/detail/hold.hpp>
#include <blockid/estimators/detail/row_major.hpp>

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
using detail::RowMajor;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr std::array<std::pair<ContinuousMethod, const char*>, 3> kContinuousMethods = {
    {{ContinuousMethod::least_squares, "ls"},
     {ContinuousMethod::instrumental_variables, "iv"},
     {ContinuousMethod::refined_instrumental_variables, "srivc"}}};

/// A step that moves the output by less, relative to it, is rounding: that of a recursion over N = 1e5..1e6 samples, a
/// random walk of epsilon sqrt(N) = 1e-13 in every column, a hundred times larger after columns have cancelled.
constexpr double kRounding = 1e-10;

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

// -------------------------------------------------------------------------------------------------------- estimates

/// An estimate under one prefilter, x = [c.., b, a - d].
struct PrefilteredEstimate {
  VectorXd x;
  Index rank = 0;
  /// e'e of the filtered equation.
  double sum_of_squares = 0.0;
  /// (P, P) covariance of x for s = 1.
  MatrixXd covariance;
};

/// The triangle of rows, [.., y].
QrTriangle triangle_of(const MatrixXd& rows) {
  const RowMajor tile = rows;
  QrTriangle result(tile.cols());
  result.add(tile.data(), tile.rows(), tile.cols());
  return result;
}

/// x = offset + directions q under one prefilter: what coefficients that are zero leave of [c.., b, a - d].
class Freedom {
 public:
  Freedom(const ContinuousEquation& equation, const ContinuousFitOptions& options)
      : constrained_(!options.zero_numerator.empty() || !options.zero_denominator.empty()), order_(equation.order()) {
    const RationalBasis& basis = equation.basis();
    all_ = detail::subspace_without(basis, options.zero_numerator, options.zero_denominator)
               .with_free_front(equation.initial_columns());
  }

  bool constrained() const { return constrained_; }
  Index unknowns() const { return all_.directions.cols(); }
  const MatrixXd& directions() const { return all_.directions; }
  VectorXd offset(const VectorXd& d) const {
    VectorXd result = all_.offset;
    result.tail(order_) -= d;
    return result;
  }

 private:
  detail::CoefficientSubspace all_;
  bool constrained_;
  Index order_;
};

/// The regression [X | y] in q: [X directions | y - X offset].
QrTriangle reduced(const QrTriangle& regression, const Freedom& freedom, const VectorXd& d) {
  const MatrixXd& r = regression.triangle();
  const auto x = r.leftCols(r.cols() - 1);
  MatrixXd rows(r.rows(), freedom.unknowns() + 1);
  rows << x * freedom.directions(), r.rightCols(1) - x * freedom.offset(d);
  return triangle_of(rows);
}

/// q and its covariance as x and that of x.
PrefilteredEstimate expanded(PrefilteredEstimate estimate, const Freedom& freedom, const VectorXd& d) {
  estimate.x = (freedom.offset(d) + freedom.directions() * estimate.x).eval();
  estimate.covariance = (freedom.directions() * estimate.covariance * freedom.directions().transpose()).eval();
  return estimate;
}

PrefilteredEstimate least_squares(const QrTriangle& regression) {
  const LinearSolution solution = solve_least_squares(regression);
  return {solution.x, solution.rank, solution.residual_sum_of_squares, scaled_pseudo_inverse(regression).matrix};
}

PrefilteredEstimate least_squares(const QrTriangle& regression, const Freedom& freedom, const VectorXd& d) {
  if (!freedom.constrained()) return least_squares(regression);
  return expanded(least_squares(reduced(regression, freedom, d)), freedom, d);
}

/// Instruments Z and equations X x = y on an orthonormal basis whose first directions are those of Z; Z and X have
/// their columns of f and u in common.
class InstrumentTriangle {
 public:
  /// From R of [Z, X_y | y], Z = [f, u-part, instruments of y], X = [f, u-part, X_y].
  InstrumentTriangle(const QrTriangle& triangle, Index order, const Freedom& freedom, const VectorXd& d)
      : freedom_(freedom), d_(d) {
    const MatrixXd& r = triangle.triangle();
    const Index unknowns = triangle.columns() - 1 - order;
    z_ = r.leftCols(unknowns);
    equations_.resize(r.rows(), unknowns + 1);
    equations_ << r.leftCols(unknowns - order), r.rightCols(order + 1);
    if (freedom.constrained()) reduce();
  }

  /// Z'X x = Z'y is R_zx x = r_z, Z = Q R_zz.
  PrefilteredEstimate estimate() const {
    const Index unknowns = z_.cols();
    const QrTriangle square = triangle_of(equations_.topRows(unknowns));
    const LinearSolution solution = solve_least_squares(square);
    PrefilteredEstimate estimate{solution.x, solution.rank,
                                 (equations_.leftCols(unknowns) * solution.x - equations_.col(unknowns)).squaredNorm(),
                                 scaled_pseudo_inverse(square).matrix};
    return freedom_.constrained() ? expanded(std::move(estimate), freedom_, d_) : estimate;
  }
  /// (Z'Z)^+.
  MatrixXd instrument_covariance() const {
    MatrixXd rows = MatrixXd::Zero(z_.cols(), z_.cols() + 1);
    rows.leftCols(z_.cols()) = z_.topRows(z_.cols());
    MatrixXd covariance = scaled_pseudo_inverse(triangle_of(rows)).matrix;
    if (!freedom_.constrained()) return covariance;
    return freedom_.directions() * covariance * freedom_.directions().transpose();
  }
  /// |Z step|: how far a step of x moves the output, to first order.
  double moved(const VectorXd& step) const {
    const auto triangle = z_.topRows(z_.cols()).triangularView<Eigen::Upper>();
    if (!freedom_.constrained()) return (triangle * step).norm();
    return (triangle * (freedom_.directions().transpose() * step)).norm();
  }

 private:
  void reduce() {
    const Index unknowns = freedom_.unknowns();
    const auto x = equations_.leftCols(equations_.cols() - 1);
    MatrixXd rows(z_.rows(), 2 * unknowns + 1);
    rows << z_ * freedom_.directions(), x * freedom_.directions(), equations_.rightCols(1) - x * freedom_.offset(d_);
    const MatrixXd r = triangle_of(rows).triangle();
    z_ = r.leftCols(unknowns);
    equations_ = r.rightCols(unknowns + 1);
  }

  const Freedom& freedom_;
  VectorXd d_;
  MatrixXd z_;
  /// [X | y].
  MatrixXd equations_;
};

/// An estimate with the prefilter under which it was found.
struct Found {
  ContinuousUnknowns theta;
  PrefilteredEstimate estimate;
  int iterations = 1;
  bool converged = true;
};

/// Instruments from the output of theta, its denominator made stable.
InstrumentTriangle instruments(const ContinuousEquation& equation, const Freedom& freedom,
                               const ContinuousUnknowns& theta, const VectorXd& d) {
  ContinuousUnknowns stable = theta;
  stable.a = detail::mirrored_denominator(equation.basis(), theta.a);
  return {equation.regression(d, stable), equation.order(), freedom, d};
}

Found with_instruments(const ContinuousEquation& equation, const Freedom& freedom, const Found& start) {
  const VectorXd d = fixed_prefilter(equation.basis());
  PrefilteredEstimate estimate = instruments(equation, freedom, start.theta, d).estimate();
  ContinuousUnknowns theta = equation.unknowns_of(estimate.x, d);
  return {std::move(theta), std::move(estimate), start.iterations + 1, true};
}

double deviation(const ContinuousEquation& equation, const Freedom& freedom, double sum_of_squares) {
  const Index degrees = equation.rows() - freedom.unknowns();
  return degrees > 0 ? std::sqrt(sum_of_squares / static_cast<double>(degrees)) : 0.0;
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

/// Whether a pole is, integrators that were asked for left out: they are poles at zero but for rounding.
bool in_right_half_plane(const VectorXcd& poles, const ContinuousFitOptions& options) {
  const std::vector<Index>& zero = options.zero_denominator;
  Index integrators = 0;
  while (std::find(zero.begin(), zero.end(), integrators) != zero.end()) ++integrators;
  return (poles.tail(poles.size() - integrators).real().array() >= 0.0).any();
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
Found refined(const ContinuousEquation& equation, const Freedom& freedom, const Found& start,
              const ContinuousFitOptions& options) {
  const double rounding = kRounding * output_norm(equation);
  const double share = options.tolerance * std::sqrt(static_cast<double>(freedom.unknowns()));
  Found best = start;
  best.converged = false;
  Merit merit;
  ContinuousUnknowns theta = start.theta;
  for (int k = 1; k <= options.max_iterations && !best.converged; ++k) {
    const VectorXd d = detail::mirrored_denominator(equation.basis(), theta.a);
    theta.a = d;
    const InstrumentTriangle triangle = instruments(equation, freedom, theta, d);
    PrefilteredEstimate estimate = triangle.estimate();
    const VectorXd step = estimate.x - equation.coordinates_of(theta, d);
    theta = equation.unknowns_of(estimate.x, d);
    best.iterations = start.iterations + k;
    if (!is_finite(theta)) break;
    best.converged = triangle.moved(step) <= share * deviation(equation, freedom, estimate.sum_of_squares) + rounding;
    const Merit here{!in_right_half_plane(poles_of(equation.basis(), theta.a), options), estimate.sum_of_squares};
    if (!best.converged && !(here > merit)) continue;
    merit = here;
    best.theta = theta;
    best.estimate = std::move(estimate);
    best.estimate.covariance = triangle.instrument_covariance();
  }
  return best;
}

Found found_by(const ContinuousEquation& equation, const Freedom& freedom, const QrTriangle& regression,
               const VectorXd& prefilter, const ContinuousFitOptions& options) {
  PrefilteredEstimate first = least_squares(regression, freedom, prefilter);
  ContinuousUnknowns theta = equation.unknowns_of(first.x, prefilter);
  Found found{std::move(theta), std::move(first), 1, true};
  if (!is_finite(found.theta)) fail("continuous fit: the least-squares problem has no finite solution");
  if (options.method == ContinuousMethod::least_squares) return found;
  Found instrumental = with_instruments(equation, freedom, found);
  if (options.method == ContinuousMethod::instrumental_variables) return instrumental;
  return refined(equation, freedom, is_finite(instrumental.theta) ? instrumental : found, options);
}

// ------------------------------------------------------------------------------------------------------ what goes out

MatrixXd regression_matrix(const QrTriangle& regression, const Freedom& freedom, const VectorXd& d) {
  const MatrixXd r = freedom.constrained() ? reduced(regression, freedom, d).triangle() : regression.triangle();
  return r.leftCols(r.cols() - 1);
}

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
  for (const auto& [entry, name] : kContinuousMethods) {
    if (entry == method) return name;
  }
  return "unknown";
}

ContinuousMethod continuous_method(const std::string& name) {
  std::string names;
  for (const auto& [method, entry] : kContinuousMethods) {
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

ContinuousFit detail::fit_in_basis(const DataSet& data, const RationalBasis& basis,
                                   const ContinuousFitOptions& options) {
  const ContinuousEquation equation(data, basis, options);
  const VectorXd prefilter = fixed_prefilter(basis);
  const QrTriangle regression = equation.regression(prefilter);
  const Freedom freedom(equation, options);
  const Found found = found_by(equation, freedom, regression, prefilter, options);
  const MatrixXd x = regression_matrix(regression, freedom, prefilter);
  ContinuousFit fit;
  fit.model = {basis, found.theta.a, found.theta.b};
  fit.initial_conditions = found.theta.c;
  fit.rows = equation.rows();
  fit.unknowns = freedom.unknowns();
  fit.rank = found.estimate.rank;
  fit.iterations = found.iterations;
  fit.condition = squared_condition(x);
  fit.condition_normalised = squared_condition(normalised_columns(x));
  fit.rms = std::sqrt(found.estimate.sum_of_squares / static_cast<double>(fit.rows));
  fit.noise_deviation = deviation(equation, freedom, found.estimate.sum_of_squares);
  fit.covariance = std::pow(fit.noise_deviation, 2) * model_covariance(equation, found.estimate.covariance);
  fit.pole_deviations = pole_deviations(fit.model, fit.covariance);
  fit.flags.unstable = in_right_half_plane(poles(fit.model), options);
  fit.flags.break_points_outside_band = outside_band(equation, data);
  fit.flags.rank_deficient = fit.rank < fit.unknowns;
  fit.flags.not_converged = !found.converged;
  fit.drift = drift_of(fit.model, sampled_band(data));
  fit.flags.drift = fit.drift > kDriftLimit;
  return fit;
}

}  // namespace blockid
