// Continuous-time models as chains that simulate sampled records.
#pragma once

#include <blockid/blocks/continuous_rational.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/estimators/continuous_model.hpp>

#include <Eigen/Core>

namespace blockid {

/// The chain `G=continuous_rational(nb=m,na=n,...)` with the response of `g`, sampled as given.
///
/// Localising functions keep their break points and coefficients; for other bases the break points are the moduli of
/// the poles, and poles, zeros and gain go over. covariance: (P, P) of [a, b] or empty; deviations of the chain's
/// parameters follow from it for localising functions only.
/// Throws Error for a sample time that is not positive, and where zero_pole_gain() does.
Model as_model(const ContinuousTransferFunction& g, const Sampling& sampling, const Eigen::MatrixXd& covariance = {});

}  // namespace blockid
