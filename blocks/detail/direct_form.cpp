#include <blockid/blocks/detail/direct_form.hpp>

#include <cstring>

namespace blockid::detail {
namespace {

/// Signals lie newest first: sample t of the tile at rows-1-t, the past behind it at a place that does not depend on
/// rows.
double* newest_first(double* buffer, Index rows) { return buffer + kMaxTileRows - rows; }

/// The last `order` values become the past of the next tile.
void keep_past(double* signal, Index order, Index rows) {
  std::memmove(signal + rows, signal, static_cast<std::size_t>(order) * sizeof(double));
}

/// h = 1/A for this tile, newest first, driven by a unit impulse at the first sample of the record only.
void impulse_response(const double* a, Index order, bool first_tile, double* h, Index rows) {
  for (Index t = 0; t < rows; ++t) {
    double value = first_tile && t == 0 ? 1.0 : 0.0;
    for (Index k = 1; k <= order; ++k) value -= a[k] * h[rows - 1 - t + k];
    h[rows - 1 - t] = value;
  }
}

}  // namespace

void DirectFormTangents::push(const DirectForm<double>& filter, const Shape& shape, std::span<double> x,
                              std::span<double> memory, std::span<const double> u, std::span<double> y,
                              const Tangents& tangents, OwnColumns own) {
  const Index rows = tangents.rows;
  const Index order = shape.order();
  const Index state_stride = padded_columns(tangents.upstream);
  const Kernels& kernel = kernels();
  double* columns_state = memory.data();
  double* s = newest_first(columns_state + order * state_stride, rows);
  double* r = newest_first(columns_state + order * state_stride + (order + kMaxTileRows), rows);
  double* h = newest_first(columns_state + order * state_stride + 2 * (order + kMaxTileRows), rows);
  double* started = columns_state + order * state_stride + 3 * (order + kMaxTileRows);

  kernel.filter_tangents(filter.b(), filter.a(), order, x.data(), u.data(), y.data(), s, r, rows);
  kernel.filter_columns(filter.b(), filter.a(), order, columns_state, state_stride, tangents.data, rows,
                        tangents.stride, tangents.upstream);
  double* columns = tangents.data + tangents.upstream;
  const Index numerator = shape.nb + 1 - shape.first_b;
  kernel.shifted_columns(s + shape.nk + shape.first_b, columns, rows, tangents.stride, numerator);
  kernel.shifted_columns(r + 1, columns + numerator, rows, tangents.stride, shape.na);
  if (own == OwnColumns::parameters_and_state) {
    impulse_response(filter.a(), order, *started == 0.0, h, rows);
    kernel.shifted_columns(h, columns + numerator + shape.na, rows, tangents.stride, order);
    keep_past(h, order, rows);
  }
  *started = 1.0;
  keep_past(s, order, rows);
  keep_past(r, order, rows);
}

}  // namespace blockid::detail
