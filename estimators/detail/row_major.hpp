// Rows that lie one after the other, as tiles of a Jacobian and rows of a regression do.
#pragma once

#include <Eigen/Core>

namespace blockid::detail {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace blockid::detail
