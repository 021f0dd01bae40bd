// Break points of localising functions moved to where the poles are.
#pragma once

#include <blockid/estimators/excited_band.hpp>

#include <Eigen/Core>

namespace blockid::detail {

/// Ascending moduli of the poles, (n,), taken into the band, those of each pair apart by 1.6 up and down.
Eigen::VectorXd relocated_points(const Eigen::VectorXcd& poles, const FrequencyRange& band);

}  // namespace blockid::detail
