#include <blockid/blocks/detail/direct_form.hpp>

#include <cstring>

namespace blockid::detail {
namespace {

/// The last `order` values of a signal that carries its past in front, moved to the front for the next tile.
void keep_past(double* signal, Index order, Index rows) {
  std::memmove(signal, signal + rows, static_cast<std::size_t>(order) * sizeof(double));
}

/// h = 1/A for this tile, driven by a unit impulse at the first sample of the record only.
void impulse_response(const double* a, Index order, bool first_tile, double* h, Index rows) {
  for (Index t = 0; t < rows; ++t) {
    double value = first_tile && t == 0 ? 1.0 : 0.0;
    for (Index k = 1; k <= order; ++k) value -= a[k] * h[order + t - k];
    h[order + t] = value;
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
  double* s = columns_state + order * state_stride;
  double* r = s + order + kMaxTileRows;
  double* h = r + order + kMaxTileRows;
  double* started = h + order + kMaxTileRows;

  filter.filter(x, u, y);
  kernel.filter_columns(filter.b(), filter.a(), order, columns_state, state_stride, tangents.data, rows,
                        tangents.stride, tangents.upstream);
  kernel.all_pole_pair(filter.a(), order, u.data(), y.data(), s, r, rows);
  const bool with_state = own == OwnColumns::parameters_and_state;
  if (with_state) impulse_response(filter.a(), order, *started == 0.0, h, rows);
  *started = 1.0;

  for (Index t = 0; t < rows; ++t) {
    double* column = tangents.own(t);
    const double* s_now = s + order + t;
    const double* r_now = r + order + t;
    for (Index k = shape.first_b; k <= shape.nb; ++k) *column++ = s_now[-(shape.nk + k)];
    for (Index k = 1; k <= shape.na; ++k) *column++ = -r_now[-k];
    if (with_state) {
      for (Index j = 0; j < order; ++j) *column++ = h[order + t - j];
    }
  }
  keep_past(s, order, rows);
  keep_past(r, order, rows);
  if (with_state) keep_past(h, order, rows);
}

}  // namespace blockid::detail
