// The number within a scalar that may carry derivatives.
#pragma once

#include <type_traits>

namespace blockid::detail {

/// The value of a double or of a ceres::Jet; branches and table look-ups depend on nothing else.
template <class T>
double scalar_part(const T& value) {
  if constexpr (std::is_arithmetic_v<T>) {
    return value;
  } else {
    return value.a;
  }
}

}  // namespace blockid::detail
