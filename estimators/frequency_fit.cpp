#include <blockid/estimators/frequency_fit.hpp>

#include <blockid/blocks/detail/infinity.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/orthogonal_factor.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/estimators/detail/break_point_relocation.hpp>
#include <blockid/estimators/detail/row_major.hpp>
#include <blockid/estimators/excited_band.hpp>

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace blockid {
namespace {

using detail::kInfinity;
using detail::RowMajor;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr int kMaxFrequencyRelocations = 10;

constexpr std::array<std::pair<FrequencyMethod, const char*>, 4> kFrequencyMethods = {
    {{FrequencyMethod::least_squares, "ls"},
     {FrequencyMethod::sanathanan_koerner, "sk"},
     {FrequencyMethod::instrumental_variables, "iv"},
     {FrequencyMethod::maximum_likelihood, "ml"}}};
constexpr std::array<std::pair<FrequencyWeighting, const char*>, 3> kWeightings = {
    {{FrequencyWeighting::relative, "relative"},
     {FrequencyWeighting::none, "none"},
     {FrequencyWeighting::deviation, "deviation"}}};

template <class Table, class Name = const char*>
auto named(const Table& table, const std::string& name, const char* what) {
  std::string names;
  for (const auto& [entry, text] : table) {
    if (name == text) return entry;
    names += (names.empty() ? "" : ", ") + std::string(text);
  }
  fail("frequency fit: unknown ", what, " '", name, "', expected one of ", names);
}

// -------------------------------------------------------------------------------------------------- what comes in

void check_spectra(const InputOutputSpectra& data) {
  // The output takes the place of a response, with all its promises.
  check(FrequencyResponse{data.omega_rad_s, data.output, data.standard_deviation, 0.0});
  if (data.input.size() != data.output.size()) {
    fail("frequency fit: unequal lengths: ", data.output.size(), " outputs, ", data.input.size(), " inputs");
  }
  for (Index k = 0; k < data.input.size(); ++k) {
    if (!std::isfinite(data.input[k].real()) || !std::isfinite(data.input[k].imag())) {
      fail("frequency fit: non-finite input at index ", k, ": ", data.input[k]);
    }
  }
}

VectorXd relative_weights(const InputOutputSpectra& data) {
  for (Index k = 0; k < data.output.size(); ++k) {
    if (data.output[k] == 0.0) fail("frequency fit: relative weights need outputs that are not zero, see index ", k);
  }
  return data.output.cwiseAbs().cwiseInverse();
}

VectorXd deviation_weights(const InputOutputSpectra& data) {
  if (data.standard_deviation.size() == 0) fail("frequency fit: weights by deviation, but the data have none");
  for (Index k = 0; k < data.standard_deviation.size(); ++k) {
    if (data.standard_deviation[k] == 0.0) {
      fail("frequency fit: weights by deviation need deviations above zero, see index ", k);
    }
  }
  return data.standard_deviation.cwiseInverse();
}

VectorXd given_weights(const InputOutputSpectra& data, const VectorXd& weights) {
  if (weights.size() != data.output.size()) {
    fail("frequency fit: expected ", data.output.size(), " weights, got ", weights.size());
  }
  for (Index k = 0; k < weights.size(); ++k) {
    if (!std::isfinite(weights[k]) || weights[k] < 0.0) {
      fail("frequency fit: weight at index ", k, " is ", weights[k], ", expected finite and >= 0");
    }
  }
  if (weights.isZero(0.0)) fail("frequency fit: all weights are zero");
  return weights;
}

VectorXd used_weights(const InputOutputSpectra& data, const FrequencyFitOptions& options) {
  if (options.weighting != FrequencyWeighting::given && options.weights.size() > 0) {
    fail("frequency fit: weights are given, but the weighting is '", to_text(options.weighting), "'");
  }
  switch (options.weighting) {
    case FrequencyWeighting::relative:
      return relative_weights(data);
    case FrequencyWeighting::none:
      return VectorXd::Ones(data.output.size());
    case FrequencyWeighting::deviation:
      return deviation_weights(data);
    case FrequencyWeighting::given:
      return given_weights(data, options.weights);
  }
  fail("frequency fit: unknown weighting ", static_cast<int>(options.weighting));
}

void check_options(const FrequencyFitOptions& options) {
  if (options.max_iterations < 1) {
    fail("frequency fit: expected at least one iteration, got ", options.max_iterations);
  }
  if (!(options.tolerance >= 0.0)) fail("frequency fit: expected a tolerance >= 0, got ", options.tolerance);
  if (!(options.rank_tolerance >= 0.0 && options.rank_tolerance < 1.0)) {
    fail("frequency fit: expected a rank tolerance in 0 .. 1, got ", options.rank_tolerance);
  }
}

// ------------------------------------------------------------------------------------------ least squares with rank

struct Solution {
  VectorXd theta;
  double condition_normalised = kInfinity;
  Index rank = 0;
};

VectorXd column_norms(const MatrixXd& x) {
  VectorXd norms(x.cols());
  for (Index k = 0; k < x.cols(); ++k) norms[k] = x.col(k).stableNorm();
  return norms;
}

double squared_ratio(const VectorXd& singular_values) {
  const double smallest = singular_values[singular_values.size() - 1];
  return smallest > 0.0 ? std::pow(singular_values[0] / smallest, 2) : kInfinity;
}

/// Columns get unit norm before the triangle is formed: those of some bases are too large to be squared.
Solution solve(const MatrixXd& x, const VectorXd& y, double rank_tolerance) {
  VectorXd norms = column_norms(x);
  for (double& norm : norms) {
    if (!(norm > 0.0)) norm = 1.0;
  }
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(x.rows(), x.cols() + 1);
  rows << x * norms.cwiseInverse().asDiagonal(), y;
  QrTriangle triangle(rows.cols());
  triangle.add(rows.data(), rows.rows(), rows.cols());
  const LinearSolution solution = solve_least_squares(triangle, rank_tolerance);
  return {solution.x.cwiseQuotient(norms), std::pow(solution.condition, 2), solution.rank};
}

// ------------------------------------------------------------------------------------------------- one basis, tones

/// The counted tones in one basis: residuals, regression and sensitivities.
class Tones {
 public:
  Tones(const InputOutputSpectra& data, const VectorXd& weights, const RationalBasis& basis) : basis_(basis) {
    std::vector<Index> counted;
    for (Index k = 0; k < weights.size(); ++k) {
      if (weights[k] > 0.0) counted.push_back(k);
    }
    omega_ = data.omega_rad_s(counted);
    input_ = data.input(counted);
    output_ = data.output(counted);
    weights_ = weights(counted);
    values_ = evaluate(basis, omega_);
    if (!values_.lead.allFinite() || !values_.phi.allFinite() || !values_.psi.allFinite()) {
      fail("frequency fit: the ", to_text(basis.kind), " basis of order ", basis.order,
           " overflows over the band, expected a frequency scale within it");
    }
    if (2 * omega_.size() < parameters()) {
      fail("frequency fit: expected at least ", (parameters() + 1) / 2, " tones of weight above zero for ",
           parameters(), " parameters, got ", omega_.size());
    }
  }

  const RationalBasis& basis() const { return basis_; }
  const VectorXd& omega() const { return omega_; }
  const VectorXd& weights() const { return weights_; }
  Index parameters() const { return basis_.order + basis_.numerator_degree + 1; }

  VectorXcd denominator(const VectorXd& theta) const { return values_.lead + values_.phi * theta.head(basis_.order); }
  VectorXcd response(const VectorXd& theta) const {
    return (values_.psi * theta.tail(basis_.numerator_degree + 1)).array() / denominator(theta).array();
  }

  /// w (Y - G U) of the counted tones.
  VectorXcd residuals(const VectorXd& theta) const {
    return (output_ - response(theta).cwiseProduct(input_)).cwiseProduct(weights_);
  }
  double cost(const VectorXd& theta) const {
    const double sum = residuals(theta).squaredNorm();
    return std::isfinite(sum) ? sum : kInfinity;
  }

  /// row weights times [-phi output, psi U].
  MatrixXcd regressors(const VectorXcd& row_weights, const VectorXcd& output) const {
    MatrixXcd x(omega_.size(), parameters());
    x.leftCols(basis_.order) = row_weights.cwiseProduct(-output).asDiagonal() * values_.phi;
    x.rightCols(basis_.numerator_degree + 1) = row_weights.cwiseProduct(input_).asDiagonal() * values_.psi;
    return x;
  }
  MatrixXcd regressors(const VectorXcd& row_weights) const { return regressors(row_weights, output_); }
  VectorXcd regressand(const VectorXcd& row_weights) const {
    return row_weights.cwiseProduct(values_.lead).cwiseProduct(output_);
  }

  /// w / (A/E).
  VectorXcd prefilter(const VectorXd& theta) const { return weights_.array() / denominator(theta).array(); }
  /// Derivative of w G U with respect to theta: the instruments.
  MatrixXcd sensitivities(const VectorXd& theta) const {
    return regressors(prefilter(theta), response(theta).cwiseProduct(input_));
  }

  double drift(const VectorXd& theta) const {
    const Eigen::ArrayXd size = denominator(theta).array().abs();
    return size.maxCoeff() / size.minCoeff();
  }
  ContinuousTransferFunction model(const VectorXd& theta) const {
    return {basis_, theta.head(basis_.order), theta.tail(basis_.numerator_degree + 1)};
  }

 private:
  RationalBasis basis_;
  VectorXd omega_;
  VectorXcd input_;
  VectorXcd output_;
  VectorXd weights_;
  BasisValues values_;
};

// ---------------------------------------------------------------------------------------------------------- methods

struct ResponseEstimate {
  VectorXd theta;
  double cost = kInfinity;
  int iterations = 0;
  bool converged = true;
};

double largest_change(const VectorXcd& now, const VectorXcd& last) {
  return ((now - last).array().abs() / last.array().abs().max(std::numeric_limits<double>::min())).maxCoeff();
}

Solution least_squares(const Tones& tones, const VectorXcd& row_weights, double rank_tolerance) {
  return solve(stacked(tones.regressors(row_weights)), stacked(tones.regressand(row_weights)), rank_tolerance);
}

/// theta <- step(theta) until the response stands still; the best iterate.
template <class Step>
ResponseEstimate iterate(const Tones& tones, const VectorXd& start, const FrequencyFitOptions& options, Step step) {
  ResponseEstimate best{start, tones.cost(start), 0, false};
  VectorXd theta = start;
  VectorXcd response = tones.response(theta);
  for (int k = 1; k <= options.max_iterations; ++k) {
    theta = step(theta);
    if (!theta.allFinite()) break;
    const VectorXcd now = tones.response(theta);
    best.iterations = k;
    const double cost = tones.cost(theta);
    if (cost < best.cost) {
      best.theta = theta;
      best.cost = cost;
    }
    if (largest_change(now, response) <= options.tolerance) {
      best.converged = true;
      break;
    }
    response = now;
  }
  return best;
}

ResponseEstimate sanathanan_koerner(const Tones& tones, const VectorXd& start, const FrequencyFitOptions& options) {
  return iterate(tones, start, options, [&](const VectorXd& theta) {
    return least_squares(tones, tones.prefilter(theta), options.rank_tolerance).theta;
  });
}

/// Z'X theta = Z'y on the orthonormal factor of Z.
VectorXd instrumental_step(const Tones& tones, const VectorXd& theta) {
  const VectorXcd filter = tones.prefilter(theta);
  const MatrixXd z = stacked(tones.sensitivities(theta));
  const MatrixXd x = stacked(tones.regressors(filter));
  const VectorXd y = stacked(tones.regressand(filter));
  if (!z.allFinite() || !x.allFinite()) return VectorXd::Constant(theta.size(), std::nan(""));
  VectorXd norms = column_norms(x);
  for (double& norm : norms) {
    if (!(norm > 0.0)) norm = 1.0;
  }
  const Eigen::HouseholderQR<MatrixXd> qr(z * norms.cwiseInverse().asDiagonal());
  const Index n = z.cols();
  const MatrixXd projected = q_transpose_times(qr.householderQ(), x * norms.cwiseInverse().asDiagonal()).topRows(n);
  const VectorXd right = q_transpose_times(qr.householderQ(), y).topRows(n);
  return projected.colPivHouseholderQr().solve(right).array() / norms.array();
}

ResponseEstimate instrumental_variables(const Tones& tones, const VectorXd& start, const FrequencyFitOptions& options) {
  return iterate(tones, start, options, [&](const VectorXd& theta) { return instrumental_step(tones, theta); });
}

/// w (Y - G U), real over imaginary parts, in the basis coordinates.
class ResponseCost final : public ceres::CostFunction {
 public:
  explicit ResponseCost(const Tones& tones) : tones_(tones) {
    set_num_residuals(static_cast<int>(2 * tones.omega().size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(tones.parameters()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const VectorXd theta = Eigen::Map<const VectorXd>(parameters[0], tones_.parameters());
    Eigen::Map<VectorXd> r(residuals, num_residuals());
    r = stacked(tones_.residuals(theta));
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<RowMajor> j(jacobians[0], num_residuals(), tones_.parameters());
      j = -stacked(tones_.sensitivities(theta));
      if (!j.allFinite()) return false;
    }
    return r.allFinite();
  }

 private:
  const Tones& tones_;
};

ResponseEstimate maximum_likelihood(const Tones& tones, const VectorXd& start, const FrequencyFitOptions& options) {
  ResponseEstimate result{start, tones.cost(start), 0, false};
  VectorXd theta = start;
  ResponseCost cost(tones);
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  problem.AddResidualBlock(&cost, nullptr, theta.data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.parameter_tolerance = options.tolerance * options.tolerance;
  solver.gradient_tolerance = 0.0;
  solver.logging_type = ceres::SILENT;
  solver.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  result.iterations = static_cast<int>(summary.iterations.size());
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  const double final_cost = tones.cost(theta);
  if (final_cost < result.cost) {
    result.theta = theta;
    result.cost = final_cost;
  }
  return result;
}

/// Sum that rounding alone leaves: below it no method can tell iterates apart.
double rounding_floor(const Tones& tones, const VectorXd& theta) {
  const double size = tones.response(theta).cwiseProduct(tones.weights()).norm();
  return std::pow(1e3 * std::numeric_limits<double>::epsilon() * size, 2);
}

/// From a given start the method alone, otherwise all methods before it one after another.
ResponseEstimate run_method(const Tones& tones, const VectorXd& first, const FrequencyFitOptions& options) {
  const bool alone = options.start.size() > 0;
  ResponseEstimate result{alone ? options.start : first, kInfinity, 1, true};
  result.cost = tones.cost(result.theta);
  const auto follow = [&](FrequencyMethod method, auto&& function) {
    if (options.method < method || (alone && options.method != method)) return;
    ResponseEstimate next = function(tones, result.theta, options);
    next.iterations += method == FrequencyMethod::sanathanan_koerner ? 0 : result.iterations;
    // What stood still before, or is rounding only, has left nothing to gain.
    const bool settled = method == FrequencyMethod::maximum_likelihood && result.converged;
    next.converged = next.converged || settled || next.cost <= rounding_floor(tones, next.theta);
    result = std::move(next);
  };
  if (options.method == FrequencyMethod::least_squares) return result;
  follow(FrequencyMethod::sanathanan_koerner, sanathanan_koerner);
  follow(FrequencyMethod::instrumental_variables, instrumental_variables);
  follow(FrequencyMethod::maximum_likelihood, maximum_likelihood);
  return result;
}

// ------------------------------------------------------------------------------------------------------ break points

FrequencyRange positive_band(const VectorXd& omega) {
  FrequencyRange band;
  for (const double value : omega) {
    if (value <= 0.0) continue;
    if (band.low == 0.0) band.low = value;
    band.high = value;
  }
  if (band.low == 0.0) fail("frequency fit: expected a frequency above zero");
  return band;
}

bool outside(const RationalBasis& basis, const FrequencyRange& band) {
  if (basis.kind != BasisKind::localising) return false;
  constexpr double kBandRounding = 1e-9;
  return basis.points.minCoeff() < band.low * (1.0 - kBandRounding) ||
         basis.points.maxCoeff() > band.high * (1.0 + kBandRounding);
}

/// An estimate with the basis in which it was made.
struct PlacedBasis {
  RationalBasis basis;
  ResponseEstimate estimate;
  Solution first;
  double drift = kInfinity;
};

PlacedBasis place(const InputOutputSpectra& data, const VectorXd& weights, const RationalBasis& basis,
                  const FrequencyFitOptions& options) {
  const Tones tones(data, weights, basis);
  PlacedBasis result{
      basis, {}, least_squares(tones, tones.weights().cast<Complex>(), options.rank_tolerance), kInfinity};
  if (!result.first.theta.allFinite()) fail("frequency fit: the least-squares problem has no finite solution");
  if (options.start.size() > 0 && options.start.size() != tones.parameters()) {
    fail("frequency fit: expected a start of ", tones.parameters(), " numbers, got ", options.start.size());
  }
  result.estimate = run_method(tones, result.first.theta, options);
  result.drift = tones.drift(result.estimate.theta);
  return result;
}

/// Costs within this factor are one: then the smaller drift is better.
constexpr double kSameCost = 1.0 + 1e-6;

bool better(const PlacedBasis& left, const PlacedBasis& right, double floor) {
  const double a = std::max(left.estimate.cost, floor);
  const double b = std::max(right.estimate.cost, floor);
  if (a > b * kSameCost) return false;
  return a * kSameCost < b || left.drift < right.drift;
}

struct Relocated {
  PlacedBasis best;
  int relocations = 0;
};

Relocated relocate(const InputOutputSpectra& data, const VectorXd& weights, const FrequencyRange& band,
                   PlacedBasis start, const FrequencyFitOptions& options) {
  Relocated result{std::move(start), 0};
  const RationalBasis given = result.best.basis;
  const double floor = rounding_floor(Tones(data, weights, given), result.best.estimate.theta);
  FrequencyFitOptions from_scratch = options;
  from_scratch.start.resize(0);  // it belongs to the given basis
  const auto attempt = [&](const VectorXd& points) {
    RationalBasis basis = given;
    basis.points = points;
    PlacedBasis next = place(data, weights, basis, from_scratch);
    ++result.relocations;
    if (better(next, result.best, floor)) result.best = next;
    return next;
  };
  const auto settle = [&](PlacedBasis current) {
    for (int k = 0; k < kMaxFrequencyRelocations && current.drift > kDriftLimit; ++k) {
      const ContinuousTransferFunction model{current.basis, current.estimate.theta.head(given.order),
                                             current.estimate.theta.tail(given.numerator_degree + 1)};
      current = attempt(detail::relocated_points(poles(model), band));
    }
  };
  settle(result.best);
  settle(attempt(break_points(band.low, band.high, given.order)));
  return result;
}

// ------------------------------------------------------------------------------------------------------ what goes out

void add_covariance(FrequencyFit& fit, const Tones& tones, const VectorXd& theta) {
  const Index parameters = tones.parameters();
  const Index freedom = 2 * tones.omega().size() - parameters;
  const Index n = tones.basis().order;
  fit.covariance = MatrixXd::Zero(parameters, parameters);
  fit.pole_real_deviation = VectorXd::Zero(n);
  fit.pole_imaginary_deviation = VectorXd::Zero(n);
  const MatrixXd jacobian = stacked(tones.sensitivities(theta));
  if (freedom <= 0 || !jacobian.allFinite()) return;
  VectorXd norms = column_norms(jacobian);
  for (double& norm : norms) {
    if (!(norm > 0.0)) norm = 1.0;
  }
  const MatrixXd scaled = jacobian * norms.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeThinV);
  const VectorXd& values = svd.singularValues();
  const Index rank = (values.array() > kFrequencyRankTolerance * values[0]).count();
  const MatrixXd root =
      norms.cwiseInverse().asDiagonal() * svd.matrixV().leftCols(rank) * values.head(rank).cwiseInverse().asDiagonal();
  fit.covariance = fit.cost / static_cast<double>(freedom) * root * root.transpose();
  PoleDeviations deviations = pole_deviations(fit.model, fit.covariance);
  fit.pole_real_deviation = std::move(deviations.real);
  fit.pole_imaginary_deviation = std::move(deviations.imaginary);
}

}  // namespace

InputOutputSpectra spectra_of(const FrequencyResponse& g) {
  check(g);
  if (g.sample_time_s > 0.0) {
    fail("frequency fit: expected the response of a continuous-time system, got a discrete one, sampled every ",
         g.sample_time_s, " s");
  }
  return {g.omega_rad_s, VectorXcd::Ones(g.response.size()), g.response, g.standard_deviation};
}

std::string to_text(FrequencyMethod method) {
  for (const auto& [entry, name] : kFrequencyMethods) {
    if (entry == method) return name;
  }
  return "unknown";
}

FrequencyMethod frequency_method(const std::string& name) { return named(kFrequencyMethods, name, "method"); }

std::string to_text(FrequencyWeighting weighting) {
  for (const auto& [entry, name] : kWeightings) {
    if (entry == weighting) return name;
  }
  return "given";
}

FrequencyWeighting frequency_weighting(const std::string& name) { return named(kWeightings, name, "weighting"); }

std::vector<std::string> texts(const FrequencyFitFlags& flags) {
  std::vector<std::string> result;
  if (flags.unstable) result.emplace_back("the model is unstable: a pole lies in the right half plane");
  if (flags.break_points_outside_band) result.emplace_back("break points lie outside the band of the data");
  if (flags.drift) result.emplace_back("|A/E| drifts by more than 1000 over the band: digits are lost");
  if (flags.rank_deficient) result.emplace_back("the data do not determine all parameters");
  if (flags.not_converged) result.emplace_back("the iterations did not converge");
  if (flags.relocated) result.emplace_back("break points were relocated");
  return result;
}

FrequencyFit fit_frequency_response(const InputOutputSpectra& data, const RationalBasis& basis,
                                    const FrequencyFitOptions& options) {
  check_spectra(data);
  check_options(options);
  FrequencyFit fit;
  fit.weights = used_weights(data, options);
  PlacedBasis placed = place(data, fit.weights, basis, options);
  const Tones given(data, fit.weights, basis);
  const FrequencyRange band = positive_band(given.omega());
  if (options.relocate && basis.kind == BasisKind::localising && placed.drift > kDriftLimit) {
    Relocated relocated = relocate(data, fit.weights, band, std::move(placed), options);
    placed = std::move(relocated.best);
    fit.relocations = relocated.relocations;
  }
  const Tones tones(data, fit.weights, placed.basis);
  const VectorXd& theta = placed.estimate.theta;
  fit.model = tones.model(theta);
  fit.cost = tones.cost(theta);
  fit.rms = std::sqrt(fit.cost / static_cast<double>(tones.omega().size()));
  fit.condition = squared_condition(stacked(tones.regressors(tones.weights().cast<Complex>())));
  fit.condition_normalised = placed.first.condition_normalised;
  fit.rank = placed.first.rank;
  fit.drift = placed.drift;
  fit.iterations = placed.estimate.iterations;
  add_covariance(fit, tones, theta);
  fit.flags.unstable = !is_stable(fit.model);
  fit.flags.break_points_outside_band = outside(basis, band);
  fit.flags.drift = basis.kind == BasisKind::localising && fit.drift > kDriftLimit;
  fit.flags.rank_deficient = placed.first.rank < tones.parameters();
  fit.flags.not_converged = !placed.estimate.converged;
  fit.flags.relocated = placed.basis.points != basis.points;
  return fit;
}

FrequencyFit fit_frequency_response(const FrequencyResponse& data, const RationalBasis& basis,
                                    const FrequencyFitOptions& options) {
  return fit_frequency_response(spectra_of(data), basis, options);
}

FrequencyFit fit_frequency_response(const FrequencyResponse& data, Index numerator_degree, Index order,
                                    const FrequencyFitOptions& options) {
  const InputOutputSpectra spectra = spectra_of(data);
  if (order < 1) fail("frequency fit: expected an order of at least 1, got ", order);
  const FrequencyRange band = positive_band(data.omega_rad_s);
  return fit_frequency_response(spectra, localising_basis(break_points(band.low, band.high, order), numerator_degree),
                                options);
}

MatrixXcd equation_error_matrix(const InputOutputSpectra& data, const RationalBasis& basis) {
  check_spectra(data);
  const Tones tones(data, VectorXd::Ones(data.output.size()), basis);
  return tones.regressors(VectorXcd::Ones(data.output.size()));
}

MatrixXd stacked(const MatrixXcd& x) {
  MatrixXd result(2 * x.rows(), x.cols());
  result << x.real(), x.imag();
  return result;
}

double squared_condition(const MatrixXd& x) {
  if (!x.allFinite()) return kInfinity;
  return squared_ratio(Eigen::JacobiSVD<MatrixXd>(x).singularValues());
}

double squared_condition(const MatrixXcd& x) {
  if (!x.allFinite()) return kInfinity;
  // [Re -Im; Im Re] has each singular value twice.
  MatrixXd real(2 * x.rows(), 2 * x.cols());
  real << x.real(), -x.imag(), x.imag(), x.real();
  return squared_condition(real);
}

MatrixXd normalised_columns(const MatrixXd& x) {
  MatrixXd result = x;
  for (Index k = 0; k < x.cols(); ++k) {
    const double norm = x.col(k).stableNorm();
    if (norm > 0.0) result.col(k) /= norm;
  }
  return result;
}

VectorXd response_deviation(const FrequencyFit& fit, const VectorXd& omega_rad_s) {
  return response_deviation(fit.model, fit.covariance, omega_rad_s);
}

}  // namespace blockid
