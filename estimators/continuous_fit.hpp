// Continuous-time rational models from sampled input and output.
#pragma once

#include <blockid/blocks/hold.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/continuous_model.hpp>
#include <blockid/estimators/predictor.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid {

/// How A, B (and the initial states C) of A y = B u + C are found from filtered signals; E is fixed: (s + p)^n in
/// powers of s (state-variable filter), prod (s + p_k) in localising functions.
enum class ContinuousMethod {
  /// sum |A/E y - B/E u - C/E|^2: linear least squares. Noise on y biases it.
  least_squares,
  /// Z'(A/E y - B/E u - C/E) = 0, Z with the output of the least-squares model in place of y: no bias, but a variance
  /// far above the least possible one.
  instrumental_variables,
  /// The same over A in place of E, iterated: at its fixed point the gradient of sum |y - B/A u - C/A|^2 vanishes, so
  /// that it is efficient for white noise on y. Source: Young and Jakeman 1980 (SRIVC).
  refined_instrumental_variables
};

/// "ls", "iv", "srivc".
std::string to_text(ContinuousMethod method);
/// The method with that name; throws Error that lists the names.
ContinuousMethod continuous_method(const std::string& name);

struct ContinuousFitOptions {
  ContinuousMethod method = ContinuousMethod::refined_instrumental_variables;
  /// How input and output run between their samples: filters are exact for it.
  Hold input_hold = Hold::cubic;
  Hold output_hold = Hold::cubic;
  /// Only with first-order hold of both: y_t becomes (y_{t-1} + 10 y_t + y_{t+1}) / 12, and the input of a biproper
  /// model alike. The hold attenuates filtered signals by 1 - (omega h)^2 / 12, which this does to the others.
  bool smoothed_regressand = false;
  /// estimated: n unknowns for each run of samples. zero: rest at the first sample, or a warm-up that leaves the
  /// transient of the filters out. periodic: input and output repeat, Record::period samples long.
  InitialState initial_state = InitialState::estimated;
  /// Samples at the start of each run that do not count.
  Index warmup = 0;
  /// Of refined instrumental variables.
  int max_iterations = 50;
  /// They end when a step is below this share of the standard deviation of the estimate.
  double tolerance = 1e-3;
  /// Break points of a localising basis move to the moduli of the poles found, spread within pairs by 1.6, as long as
  /// `drift` is above kDriftLimit; evenly spread ones over the band that the input excites are tried besides, and over
  /// parts of it as long as the iterations do not converge. The result is the fit whose simulation is nearest to the
  /// data; a stable one may be twice as far as one that is not.
  bool relocate = true;
  /// Powers of s whose coefficients are zero, A monic: a0 = 0 is an integrator. They are linear constraints on the
  /// coordinates in any basis, exact up to rounding.
  std::vector<Index> zero_numerator = {};
  std::vector<Index> zero_denominator = {};
};

/// What the numbers say about a fit that was found.
struct ContinuousFitFlags {
  bool unstable = false;                   ///< a pole in the right half plane
  bool break_points_outside_band = false;  ///< a break point below one turn a record or above the Nyquist frequency
  bool rank_deficient = false;             ///< the data do not determine all unknowns
  bool not_converged = false;              ///< max_iterations came first
  bool drift = false;                      ///< `drift` is above kDriftLimit in the basis of the result
  bool relocated = false;                  ///< the basis of the result is not the given one
};

/// Each raised flag as a sentence.
std::vector<std::string> texts(const ContinuousFitFlags& flags);

struct ContinuousFit {
  ContinuousTransferFunction model;
  /// Covariance of [a, b], (P, P), P = n + m + 1: s^2 (X'X)^-1 for least squares, s^2 (Z'X)^-1 Z'Z (X'Z)^-1 for
  /// instrumental variables, s^2 (Z'Z)^-1 for the refined ones, which is the bound of Cramer and Rao for white noise on
  /// y. The first two hold for a white equation error only.
  Eigen::MatrixXd covariance;
  /// Of the poles, in the order of poles(model), by linearisation.
  PoleDeviations pole_deviations;
  /// (n,) c for each run of samples, C/E = sum_k c_k phi_k; none unless initial states are estimated.
  std::vector<Eigen::VectorXd> initial_conditions;
  /// sqrt(sum of squares / rows) of the filtered equation error; of y - B/A u - C/A for the refined method.
  double rms = 0.0;
  /// s, the same over rows less unknowns.
  double noise_deviation = 0.0;
  /// cond(X'X) of the least-squares regression, initial-state columns included: as it is, and with columns of unit
  /// norm (infinite where rank is lost).
  double condition = 0.0;
  double condition_normalised = 0.0;
  Index rank = 0;
  Index unknowns = 0;
  Index rows = 0;
  int iterations = 0;
  /// max / min over the band of the data of prod_k |j omega + |lambda_k|| / |j omega + p_k|, lambda_k the poles of the
  /// model, p_k the break points: how far |A/E| drifts, its resonances left out. 1 for other bases.
  double drift = 1.0;
  int relocations = 0;
  ContinuousFitFlags flags;
};

/// Fits in the given basis: localising, laguerre, kautz, or monomial, whose scale is then the pole p of the
/// state-variable filter 1 / (s + p)^n.
///
/// A gap in the output ends a run of samples; the next begins with an initial state of its own. Runs too short for the
/// hold or for an initial state are left out. Weights multiply rows.
/// Throws Error for data that do not pass check(), a constant input, chebyshev functions, coefficients that cannot be
/// left out, a gap where the initial state
/// is periodic (or zero without a warm-up), more than 64 runs, fewer rows than unknowns, and options that contradict
/// each other. What the numbers do is told by flags.
ContinuousFit fit_continuous(const DataSet& data, const RationalBasis& basis, const ContinuousFitOptions& options = {});
/// In localising functions with n break points evenly spread over excited_band(data).
ContinuousFit fit_continuous(const DataSet& data, Index numerator_degree, Index order,
                             const ContinuousFitOptions& options = {});

/// IQ = sum (y - yhat)^2 and IV = sum |y - yhat|, weighted, over the samples after the warm-up, by simulate() with the
/// start and the hold of the options. Infinite where the simulation is not finite.
struct SimulationErrors {
  double squared = 0.0;
  double absolute = 0.0;
  Index samples = 0;
};
SimulationErrors simulation_errors(const ContinuousTransferFunction& model, const DataSet& data,
                                   const ContinuousFitOptions& options);

/// The root of the weighted mean of (y - yhat)^2: sqrt(IQ / samples).
double simulation_rms(const ContinuousTransferFunction& model, const DataSet& data,
                      const ContinuousFitOptions& options);

/// B/A u of one record, (N,), from rest, in periodic steady state, or with the initial state that fits the present
/// output samples after the warm-up best. Not finite where an unstable model overflows.
struct ContinuousSimulation {
  Hold hold = Hold::cubic;
  InitialState initial_state = InitialState::estimated;
  Index warmup = 0;
};
Eigen::VectorXd simulate(const ContinuousTransferFunction& model, const Record& record,
                         const ContinuousSimulation& options = {});

/// The basis of the state-variable filter 1 / (s + p)^n.
RationalBasis state_variable_basis(Index order, Index numerator_degree, double pole_rad_s);

}  // namespace blockid
