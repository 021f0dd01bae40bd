#include <blockid/blocks/delay.hpp>

#include <blockid/data/error.hpp>

namespace blockid {

Delay::Delay(Index samples) : samples_(samples) {
  if (samples < 0) fail("delay: samples must be >= 0, got ", samples);
}

Arguments Delay::arguments() const { return {{"samples", std::to_string(samples_)}}; }

Index Delay::tangent_memory(Index upstream, OwnColumns) const { return samples_ * padded_columns(upstream) + 1; }

// Memory: a ring of the last n rows, and the number of samples seen.
void Delay::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                         std::span<const double> u, std::span<double> y, const Tangents& tangents,
                         OwnColumns own) const {
  apply(theta, x, u, y);
  if (samples_ == 0) return;
  double& seen = memory.back();
  const Index stored_stride = padded_columns(tangents.upstream);
  const Index first = static_cast<Index>(seen);
  Index place = first % samples_;
  for (Index t = 0; t < tangents.rows; ++t) {
    double* row = tangents.row(t);
    std::swap_ranges(row, row + tangents.upstream, memory.data() + place * stored_stride);
    if (own == OwnColumns::parameters_and_state) {
      std::fill_n(tangents.own(t), samples_, 0.0);
      if (first + t < samples_) tangents.own(t)[first + t] = 1.0;
    }
    if (++place == samples_) place = 0;
  }
  seen += static_cast<double>(tangents.rows);
}

}  // namespace blockid
