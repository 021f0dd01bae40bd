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

/// What a filter remembers between tiles, in the caller's memory.
struct Memory {
  Index state_stride;
  double* columns;
  double* s;
  double* r;
  double* h;
  double* started;

  Memory(double* memory, Index order, Index upstream, Index rows)
      : state_stride(padded_columns(upstream)), columns(memory) {
    double* signals = memory + order * state_stride;
    const Index length = order + kMaxTileRows;
    s = newest_first(signals, rows);
    r = newest_first(signals + length, rows);
    h = newest_first(signals + 2 * length, rows);
    started = signals + 3 * length;
  }
};

}  // namespace

void DirectFormTangents::push(const DirectForm<double>& filter, const Shape& shape, std::span<double> x,
                              std::span<double> memory, std::span<const double> u, std::span<double> y,
                              const Tangents& tangents, OwnColumns own) {
  const Index rows = tangents.rows;
  const Index order = shape.order();
  const Kernels& kernel = kernels();
  const Memory m(memory.data(), order, tangents.upstream, rows);
  kernel.filter_tangents(filter.b(), filter.a(), order, x.data(), u.data(), y.data(), m.s, m.r, rows);
  kernel.filter_columns(filter.b(), filter.a(), order, m.columns, m.state_stride, tangents.data, rows, tangents.stride,
                        tangents.upstream);
  double* columns = tangents.data + tangents.upstream;
  const Index numerator = shape.nb + 1 - shape.first_b;
  const Index room = tangents.stride - tangents.upstream;
  kernel.shifted_columns(m.s + shape.nk + shape.first_b, columns, rows, tangents.stride, numerator, room);
  kernel.shifted_columns(m.r + 1, columns + numerator, rows, tangents.stride, shape.na, room - numerator);
  if (own == OwnColumns::parameters_and_state) {
    impulse_response(filter.a(), order, *m.started == 0.0, m.h, rows);
    kernel.shifted_columns(m.h, columns + numerator + shape.na, rows, tangents.stride, order, order);
    keep_past(m.h, order, rows);
  }
  *m.started = 1.0;
  keep_past(m.s, order, rows);
  keep_past(m.r, order, rows);
}

bool DirectFormTangents::push_negated(const DirectForm<double>& filter, const Shape& shape, std::span<double> x,
                                      std::span<double> memory, std::span<const double> u, std::span<double> y,
                                      const Tangents& tangents, double* target) {
  const Index rows = tangents.rows;
  const Index order = shape.order();
  const Kernels& kernel = kernels();
  if (order < 1 || order > kMaxUnrolledOrder) {
    push(filter, shape, x, memory, u, y, tangents, OwnColumns::parameters);
    const Index width = tangents.upstream + shape.own(OwnColumns::parameters);
    return kernel.negated_rows(tangents.data, rows, tangents.stride, width, nullptr, target);
  }
  const Memory m(memory.data(), order, tangents.upstream, rows);
  kernel.filter_tangents(filter.b(), filter.a(), order, x.data(), u.data(), y.data(), m.s, m.r, rows);
  const ShiftedSignal s{m.s + shape.nk + shape.first_b, shape.nb + 1 - shape.first_b};
  const ShiftedSignal r{m.r + 1, shape.na};
  const FilterRows job{tangents.data, rows, tangents.stride, tangents.upstream, s, r, target};
  const bool finite = kernel.negated_filter_rows(filter.b(), filter.a(), order, m.columns, m.state_stride, job);
  *m.started = 1.0;
  keep_past(m.s, order, rows);
  keep_past(m.r, order, rows);
  return finite;
}

}  // namespace blockid::detail
