// A fit whose basis stays as it is.
#pragma once

#include <blockid/estimators/continuous_fit.hpp>

namespace blockid::detail {

/// fit_continuous() without relocation.
ContinuousFit fit_in_basis(const DataSet& data, const RationalBasis& basis, const ContinuousFitOptions& options);

}  // namespace blockid::detail
