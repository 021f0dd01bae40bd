// Uncertainty of curves that follow from uncertain parameters.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <Eigen/Core>
#include <functional>
#include <numbers>

namespace blockid::cli {

/// Frequency response of a linear block with standard deviations, by the delta method:
/// var(ln G) = d C d', d = dG/dtheta / G; real part for the magnitude, imaginary part for the phase.
struct BodeBand {
  Eigen::VectorXd frequency_hz;            ///< (F,)
  Eigen::VectorXd magnitude_db;            ///< (F,)
  Eigen::VectorXd phase_deg;               ///< (F,) unwrapped
  Eigen::VectorXd magnitude_deviation_db;  ///< (F,) zero when the covariance is unknown
  Eigen::VectorXd phase_deviation_deg;     ///< (F,) likewise
};

/// G (F,) of parameters theta (n_theta,) at fixed frequencies.
using ResponseFunction = std::function<Eigen::VectorXcd(const Eigen::VectorXd& theta)>;

/// Of any response: `response` belongs to the frequencies in frequency_hz (F,).
BodeBand bode_band(const ResponseFunction& response, const Eigen::VectorXd& parameters,
                   const Eigen::MatrixXd& covariance, const Eigen::VectorXd& frequency_hz);

/// covariance: (n_theta, n_theta) of the block's parameters, or empty when unknown. frequency_hz: (F,) in
/// (0, 1 / (2 sample_time_s)]. Throws Error when the block has no frequency response.
BodeBand bode_band(const AnyBlock& block, const Eigen::VectorXd& parameters, const Eigen::MatrixXd& covariance,
                   const Eigen::VectorXd& frequency_hz, double sample_time_s);

/// count frequencies from `decades` below the Nyquist frequency up to it, evenly spaced on a logarithmic axis.
Eigen::VectorXd logarithmic_frequencies(double sample_time_s, double decades, Eigen::Index count);

/// Of one radian.
inline constexpr double kDegrees = 180.0 / std::numbers::pi;

/// Of the curves in reports, below the Nyquist frequency.
inline constexpr double kBodeDecades = 3.0;
inline constexpr Eigen::Index kBodePoints = 240;

/// f of a static block at u with standard deviations sqrt(d C d'), d = df/dtheta.
struct CurveBand {
  Eigen::VectorXd u;          ///< (n,)
  Eigen::VectorXd f;          ///< (n,)
  Eigen::VectorXd deviation;  ///< (n,) zero when the covariance is unknown
};

CurveBand curve_band(const AnyBlock& block, const Eigen::VectorXd& parameters, const Eigen::MatrixXd& covariance,
                     const Eigen::VectorXd& u);

}  // namespace blockid::cli
