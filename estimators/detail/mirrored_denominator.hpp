// Denominators with all poles in the left half plane.
#pragma once

#include <blockid/estimators/rational_basis.hpp>

#include <Eigen/Core>

namespace blockid::detail {

/// A/E times prod (s - mirrored pole) / (s - pole) over the poles that are not stable: of the same modulus at all
/// frequencies. a, (n,), itself when all are stable. Back into the basis by least squares over frequencies around the
/// poles, where the equation is exact.
Eigen::VectorXd mirrored_denominator(const RationalBasis& basis, const Eigen::VectorXd& a);

}  // namespace blockid::detail
