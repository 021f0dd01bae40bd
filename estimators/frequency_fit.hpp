// Continuous-time rational models from measured frequency responses or spectra.
#pragma once

#include <blockid/data/frequency_response.hpp>
#include <blockid/estimators/continuous_model.hpp>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace blockid {

/// Y_k = G(j omega_k) U_k + noise, k = 0 .. F-1.
struct InputOutputSpectra {
  Eigen::VectorXd omega_rad_s;         ///< (F,) strictly increasing, >= 0
  Eigen::VectorXcd input;              ///< (F,)
  Eigen::VectorXcd output;             ///< (F,)
  Eigen::VectorXd standard_deviation;  ///< (F,) of the noise in the output, or empty when unknown
};

/// U = 1, Y = G. Throws Error for a discrete response and for whatever check() refuses.
InputOutputSpectra spectra_of(const FrequencyResponse& g);

/// How the parameters a, b of A/E = lead + phi a, B/E = psi b are found; w_k are the weights.
enum class FrequencyMethod {
  /// sum |w (A/E Y - B/E U)|^2: linear least squares (Levy 1959).
  least_squares,
  /// The same over the |A/E| of the iteration before (Sanathanan and Koerner 1963).
  sanathanan_koerner,
  /// Z'(A Y - B U) / A = 0, instruments Z with the simulated output in place of Y: at its fixed point the gradient of
  /// the maximum-likelihood sum vanishes.
  instrumental_variables,
  /// sum |w (Y - B/A U)|^2 by Levenberg-Marquardt from the estimate by instrumental variables: maximum likelihood
  /// when the w_k are the inverse deviations of independent normal noise.
  maximum_likelihood
};

/// "ls", "sk", "iv", "ml".
std::string to_text(FrequencyMethod method);
/// The method with that name; throws Error that lists the names.
FrequencyMethod frequency_method(const std::string& name);

enum class FrequencyWeighting {
  relative,   ///< w = 1 / |Y|: the same relative accuracy at all tones
  none,       ///< w = 1
  deviation,  ///< w = 1 / standard deviation
  given       ///< FrequencyFitOptions::weights
};

/// "relative", "none", "deviation", "given".
std::string to_text(FrequencyWeighting weighting);
/// The weighting with that name, `given` excepted; throws Error that lists the names.
FrequencyWeighting frequency_weighting(const std::string& name);

/// Relative singular value of the normalised regression below which a direction counts as undetermined.
inline constexpr double kFrequencyRankTolerance = 1e-13;
/// Spread max|A/E| / min|A/E| above which break points are relocated.
inline constexpr double kDriftLimit = 1e3;

struct FrequencyFitOptions {
  FrequencyMethod method = FrequencyMethod::maximum_likelihood;
  FrequencyWeighting weighting = FrequencyWeighting::relative;
  /// (F,) >= 0, for FrequencyWeighting::given; a tone of weight zero does not count.
  Eigen::VectorXd weights;
  /// (P,) [a, b] where the method begins, without the others before it; empty: at the least-squares estimate.
  Eigen::VectorXd start;
  /// Of all iterative methods; each keeps its best iterate.
  int max_iterations = 50;
  /// Iterations end when no |G_k| changes by more than this, relatively.
  double tolerance = 1e-10;
  /// Directions below it are left out of the least squares (by singular values); zero keeps all.
  double rank_tolerance = kFrequencyRankTolerance;
  /// Break points of a localising basis move to the moduli of the poles found, spread within pairs by 1.6, as long as
  /// |A/E| drifts by more than kDriftLimit; evenly spread ones over the band of the data are tried besides.
  bool relocate = true;
};

/// What the numbers say about a fit that was found.
struct FrequencyFitFlags {
  bool unstable = false;                   ///< a pole in the right half plane
  bool break_points_outside_band = false;  ///< a given break point outside the band of the counted tones
  bool drift = false;                      ///< |A/E| drifts by more than kDriftLimit in the basis of the result
  bool rank_deficient = false;             ///< the data do not determine all parameters
  bool not_converged = false;              ///< max_iterations came first
  bool relocated = false;                  ///< the basis of the result is not the given one
};

/// Each raised flag as a sentence.
std::vector<std::string> texts(const FrequencyFitFlags& flags);

struct FrequencyFit {
  ContinuousTransferFunction model;
  /// (F,) weights as used.
  Eigen::VectorXd weights;
  /// sum |w (Y - B/A U)|^2 over F tones and the root of its mean over the counted ones.
  double cost = 0.0;
  double rms = 0.0;
  /// cond(X)^2 of the first least-squares problem in the basis of the result, X real over imaginary parts with its
  /// weights: as it is, and with columns of unit norm (infinite where rank is lost).
  double condition = 0.0;
  double condition_normalised = 0.0;
  Index rank = 0;
  /// max |A/E| / min |A/E| at the counted tones.
  double drift = 0.0;
  int iterations = 0;
  int relocations = 0;
  /// Covariance of [a, b], (P, P): s^2 (J'J)^+ with J the sensitivity of the weighted response and s^2 = cost / (2 F -
  /// P); zero when there are no degrees of freedom left.
  Eigen::MatrixXd covariance;
  /// Of the poles, in the order of poles(model), by linearisation: (n,) deviations of real and imaginary part.
  Eigen::VectorXd pole_real_deviation;
  Eigen::VectorXd pole_imaginary_deviation;
  FrequencyFitFlags flags;
};

/// Fits in the given basis. At least P / 2 tones must count, P = n + m + 1.
///
/// Throws Error for wrong sizes, values that are not finite, frequencies that do not rise, weights that are negative or
/// all zero, a relative weight where Y = 0, a deviation that is missing or zero, too few tones, and a basis that
/// overflows. What the numbers do is told by flags.
FrequencyFit fit_frequency_response(const InputOutputSpectra& data, const RationalBasis& basis,
                                    const FrequencyFitOptions& options = {});
FrequencyFit fit_frequency_response(const FrequencyResponse& data, const RationalBasis& basis,
                                    const FrequencyFitOptions& options = {});
/// In localising functions with n break points evenly spread over the band of the positive frequencies.
FrequencyFit fit_frequency_response(const FrequencyResponse& data, Index numerator_degree, Index order,
                                    const FrequencyFitOptions& options = {});

/// X, (F, P) = [-phi Y, psi U] without weights: of the equation lead Y = X [a; b].
Eigen::MatrixXcd equation_error_matrix(const InputOutputSpectra& data, const RationalBasis& basis);
/// Real over imaginary part, (2 F, P).
Eigen::MatrixXd stacked(const Eigen::MatrixXcd& x);
/// cond(X)^2, of the matrix as it is or with columns of unit norm; infinite for a column of zeros.
double squared_condition(const Eigen::MatrixXd& x);
double squared_condition(const Eigen::MatrixXcd& x);
Eigen::MatrixXd normalised_columns(const Eigen::MatrixXd& x);

/// Standard deviation of Re and Im G at other frequencies, (F,) of the modulus of the error, by linearisation.
Eigen::VectorXd response_deviation(const FrequencyFit& fit, const Eigen::VectorXd& omega_rad_s);

}  // namespace blockid
