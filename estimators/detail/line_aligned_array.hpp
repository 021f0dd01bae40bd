// Numbers that start on a cache line: rows of whole lines are then loaded and stored without reaching into a second one
// (measured by bench/derivatives_bench: 5 % of a Jacobian).
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>

namespace blockid::detail {

/// `size` zeros, aligned to 64 bytes.
class LineAlignedArray {
 public:
  explicit LineAlignedArray(Eigen::Index size)
      : numbers_(static_cast<double*>(
            ::operator new(static_cast<std::size_t>(size) * sizeof(double), std::align_val_t(kLineBytes)))) {
    std::fill_n(numbers_.get(), size, 0.0);
  }

  double* data() const { return numbers_.get(); }

 private:
  static constexpr std::size_t kLineBytes = 64;

  struct Release {
    void operator()(double* numbers) const { ::operator delete(numbers, std::align_val_t(kLineBytes)); }
  };

  std::unique_ptr<double, Release> numbers_;
};

}  // namespace blockid::detail
