// A delay by whole samples.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>

#include <algorithm>
#include <complex>
#include <span>
#include <string>

namespace blockid {

/// y_t = u_{t-n}, G(q) = q^-n.
///
/// No parameters. x = the outputs to come, (n,): x_j leaves at output j, so x = [u_{-n} .. u_{-1}]. Zero is rest.
/// The delay belongs to the modelled system: latency() is 0 and nobody takes it back.
class Delay {
 public:
  /// Throws Error unless samples >= 0.
  explicit Delay(Index samples);

  Index samples() const { return samples_; }

  std::string kind() const { return "delay"; }
  Arguments arguments() const;
  Index parameter_count() const { return 0; }
  Index state_count() const { return samples_; }
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T>, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    const std::size_t n = x.size();
    const std::size_t stored = std::min(n, u.size());
    std::copy_n(x.begin(), stored, y.begin());
    std::copy_n(u.begin(), u.size() - stored, y.begin() + static_cast<Index>(stored));
    std::copy(x.begin() + static_cast<Index>(stored), x.end(), x.begin());
    std::copy_n(u.end() - static_cast<Index>(stored), stored, x.end() - static_cast<Index>(stored));
  }

  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  std::complex<double> frequency_response(std::span<const double>, double omega) const {
    return std::polar(1.0, -omega * static_cast<double>(samples_));
  }

 private:
  Index samples_;
};

}  // namespace blockid
