// Body of the kernels; included once by each translation unit that defines BLOCKID_KERNEL_SET (a namespace name) and
// BLOCKID_KERNEL_WIDTH (doubles in a vector register).
#include <blockid/blocks/detail/kernels.hpp>

namespace blockid::detail::BLOCKID_KERNEL_SET {

constexpr int kWidth = BLOCKID_KERNEL_WIDTH;
typedef double Vec __attribute__((vector_size(8 * BLOCKID_KERNEL_WIDTH)));

inline Vec load(const double* p) {
  Vec v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}

inline void store(double* p, Vec v) { __builtin_memcpy(p, &v, sizeof v); }

#if BLOCKID_KERNEL_WIDTH == 8
typedef double Half __attribute__((vector_size(32)));

inline Half load_half(const double* p) {
  Half v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}

inline void store_half(double* p, Half v) { __builtin_memcpy(p, &v, sizeof v); }
#endif

inline Vec splat(double value) {
  Vec v = {};
  return v + value;
}

inline double lane_sum(Vec v) {
  double sum = 0.0;
  for (int lane = 0; lane < kWidth; ++lane) sum += v[lane];
  return sum;
}

// ---------------------------------------------------------------------------------------------------------------
// One signal

/// The first outputs, which the state adds to; n <= order.
inline void filter_head(const double* b, const double* a, const double* z, const double* u, double* y, KernelIndex n) {
  for (KernelIndex t = 0; t < n; ++t) {
    double value = z[t] + b[0] * u[t];
    for (KernelIndex k = 1; k <= t; ++k) value += b[k] * u[t - k] - a[k] * y[t - k];
    y[t] = value;
  }
}

/// y_t = sum_k b_k u_{t-k} for t >= Order: no recursion, so whole vectors of samples at once.
template <int Order>
void moving_sum(const double* b, const double* u, double* y, KernelIndex n) {
  KernelIndex t = Order;
  for (; t + kWidth <= n; t += kWidth) {
    Vec sum = b[0] * load(u + t);
    for (int k = 1; k <= Order; ++k) sum += b[k] * load(u + t - k);
    store(y + t, sum);
  }
  for (; t < n; ++t) {
    double sum = b[0] * u[t];
    for (int k = 1; k <= Order; ++k) sum += b[k] * u[t - k];
    y[t] = sum;
  }
}

template <int Order>
void filter_body(const double* b, const double* a, const double* u, double* y, KernelIndex n) {
  if (n <= Order) return;
  moving_sum<Order>(b, u, y, n);
  // Past outputs stay in registers, and the one step back comes last: it is the only term on the critical path.
  double past[Order];
  for (int k = 0; k < Order; ++k) past[k] = y[Order - 1 - k];
  for (KernelIndex t = Order; t < n; ++t) {
    double value = y[t];
    for (int k = Order; k >= 1; --k) value -= a[k] * past[k - 1];
    for (int k = Order - 1; k >= 1; --k) past[k] = past[k - 1];
    past[0] = value;
    y[t] = value;
  }
}

inline void filter_body_any(const double* b, const double* a, KernelIndex order, const double* u, double* y,
                            KernelIndex n) {
  for (KernelIndex t = order; t < n; ++t) {
    double value = b[0] * u[t];
    for (KernelIndex k = order; k >= 1; --k) value += b[k] * u[t - k] - a[k] * y[t - k];
    y[t] = value;
  }
}

inline void filter_state(const double* b, const double* a, KernelIndex order, double* z, const double* u,
                         const double* y, KernelIndex n) {
  for (KernelIndex j = 0; j < order; ++j) {
    double value = j + n < order ? z[j + n] : 0.0;
    const KernelIndex last = n + j < order ? n + j : order;
    for (KernelIndex k = j + 1; k <= last; ++k) value += b[k] * u[n + j - k] - a[k] * y[n + j - k];
    z[j] = value;
  }
}

void filter_signal(const double* b, const double* a, KernelIndex order, double* z, const double* u, double* y,
                   KernelIndex n) {
  filter_head(b, a, z, u, y, n < order ? n : order);
  switch (order) {
    case 0:
      for (KernelIndex t = 0; t < n; ++t) y[t] = b[0] * u[t];
      return;
    case 1:
      filter_body<1>(b, a, u, y, n);
      break;
    case 2:
      filter_body<2>(b, a, u, y, n);
      break;
    case 3:
      filter_body<3>(b, a, u, y, n);
      break;
    case 4:
      filter_body<4>(b, a, u, y, n);
      break;
    case 5:
      filter_body<5>(b, a, u, y, n);
      break;
    case 6:
      filter_body<6>(b, a, u, y, n);
      break;
    case 7:
      filter_body<7>(b, a, u, y, n);
      break;
    case 8:
      filter_body<8>(b, a, u, y, n);
      break;
    default:
      filter_body_any(b, a, order, u, y, n);
  }
  filter_state(b, a, order, z, u, y, n);
}

/// s = u/A and r = -y/A for samples first .. last-1, newest first in buffers of n + order.
inline void all_pole_pair_any(const double* a, KernelIndex order, const double* u, const double* y, double* s,
                              double* r, KernelIndex n, KernelIndex first, KernelIndex last) {
  for (KernelIndex t = first; t < last; ++t) {
    double s_value = u[t];
    double r_value = -y[t];
    for (KernelIndex k = order; k >= 1; --k) {
      s_value -= a[k] * s[n - 1 - t + k];
      r_value -= a[k] * r[n - 1 - t + k];
    }
    s[n - 1 - t] = s_value;
    r[n - 1 - t] = r_value;
  }
}

typedef double Duo __attribute__((vector_size(16)));

/// The three recursions of a filter and its tangents in one loop: they hide each other's latency, and those of s and r
/// share their instructions.
template <int Order>
void filter_tangents_body(const double* b, const double* a, const double* u, double* y, double* s, double* r,
                          KernelIndex n) {
  if (n <= Order) return;
  moving_sum<Order>(b, u, y, n);
  // Copies of the coefficients, for the stores below could reach `a`; y in a vector of its own, for compilers take
  // lone numbers from iteration to iteration through slow general registers.
  Duo pole[Order];
  Duo y_past[Order];
  Duo past[Order];
  for (int k = 0; k < Order; ++k) {
    pole[k] = Duo{a[k + 1], a[k + 1]};
    y_past[k] = Duo{y[Order - 1 - k], 0.0};
    past[k] = Duo{s[n - Order + k], r[n - Order + k]};
  }
  for (KernelIndex t = Order; t < n; ++t) {
    Duo y_value = {y[t], 0.0};
    for (int k = Order - 1; k >= 0; --k) y_value -= pole[k] * y_past[k];
    Duo value = {u[t], -y_value[0]};
    for (int k = Order - 1; k >= 0; --k) value -= pole[k] * past[k];
    for (int k = Order - 1; k >= 1; --k) {
      y_past[k] = y_past[k - 1];
      past[k] = past[k - 1];
    }
    y_past[0] = y_value;
    past[0] = value;
    y[t] = y_value[0];
    s[n - 1 - t] = value[0];
    r[n - 1 - t] = value[1];
  }
}

void filter_tangents(const double* b, const double* a, KernelIndex order, double* z, const double* u, double* y,
                     double* s, double* r, KernelIndex n) {
  const KernelIndex head = n < order ? n : order;
  filter_head(b, a, z, u, y, head);
  all_pole_pair_any(a, order, u, y, s, r, n, 0, head);
  switch (order) {
    case 0:
      for (KernelIndex t = 0; t < n; ++t) y[t] = b[0] * u[t];
      all_pole_pair_any(a, 0, u, y, s, r, n, 0, n);
      return;
    case 1:
      filter_tangents_body<1>(b, a, u, y, s, r, n);
      break;
    case 2:
      filter_tangents_body<2>(b, a, u, y, s, r, n);
      break;
    case 3:
      filter_tangents_body<3>(b, a, u, y, s, r, n);
      break;
    case 4:
      filter_tangents_body<4>(b, a, u, y, s, r, n);
      break;
    case 5:
      filter_tangents_body<5>(b, a, u, y, s, r, n);
      break;
    case 6:
      filter_tangents_body<6>(b, a, u, y, s, r, n);
      break;
    case 7:
      filter_tangents_body<7>(b, a, u, y, s, r, n);
      break;
    case 8:
      filter_tangents_body<8>(b, a, u, y, s, r, n);
      break;
    default:
      filter_body_any(b, a, order, u, y, n);
      all_pole_pair_any(a, order, u, y, s, r, n, head, n);
  }
  filter_state(b, a, order, z, u, y, n);
}

template <int Count>
void shifted_columns_fixed(const double* signal, double* data, KernelIndex rows, KernelIndex stride) {
  for (KernelIndex t = 0; t < rows; ++t) __builtin_memcpy(data + t * stride, signal + rows - 1 - t, Count * 8);
}

void shifted_columns(const double* signal, double* data, KernelIndex rows, KernelIndex stride, KernelIndex count,
                     KernelIndex room) {
  // One store of a whole register instead of several that add up to the count.
  if (count > 4 && count < 8 && room >= 8) count = 8;
  if (count == 3 && room >= 4) count = 4;
  switch (count) {
    case 0:
      return;
    case 1:
      shifted_columns_fixed<1>(signal, data, rows, stride);
      return;
    case 2:
      shifted_columns_fixed<2>(signal, data, rows, stride);
      return;
    case 3:
      shifted_columns_fixed<3>(signal, data, rows, stride);
      return;
    case 4:
      shifted_columns_fixed<4>(signal, data, rows, stride);
      return;
    case 5:
      shifted_columns_fixed<5>(signal, data, rows, stride);
      return;
    case 6:
      shifted_columns_fixed<6>(signal, data, rows, stride);
      return;
    case 7:
      shifted_columns_fixed<7>(signal, data, rows, stride);
      return;
    case 8:
      shifted_columns_fixed<8>(signal, data, rows, stride);
      return;
    default:
      shifted_columns_fixed<8>(signal, data, rows, stride);
      shifted_columns(signal + 8, data + 8, rows, stride, count - 8, room - 8);
  }
}

// ---------------------------------------------------------------------------------------------------------------
// Many columns at once: the vector runs across columns, the state stays in registers over the whole tile.

inline Vec keep_columns(Vec v, KernelIndex columns) {
  for (int lane = 0; lane < kWidth; ++lane) {
    if (lane >= columns) v[lane] = 0.0;
  }
  return v;
}

/// A multiplier of ones for live columns and a blend for dead ones: NaN times zero must not leak, so dead lanes are
/// selected away instead of multiplied.
inline Vec select_columns(Vec v, Vec live) {
  const Vec zero = {};
  return live > zero ? v : zero;
}

/// A filter over `Groups` vectors of columns; its numbers stay in registers.
template <int Order, int Groups>
struct ColumnFilter {
  double b[Order + 1];
  double a[Order + 1];
  Vec state[Order > 0 ? Order : 1][Groups];

  ColumnFilter(const double* numerator, const double* denominator, const double* z, KernelIndex state_stride) {
    for (int k = 0; k <= Order; ++k) b[k] = numerator[k];
    for (int k = 1; k <= Order; ++k) a[k] = denominator[k];
    for (int k = 0; k < Order; ++k) {
      for (int g = 0; g < Groups; ++g) state[k][g] = load(z + k * state_stride + g * kWidth);
    }
  }

  Vec step(Vec u, int g) {
    Vec y = b[0] * u;
    if constexpr (Order > 0) {
      y += state[0][g];
      for (int k = 0; k + 1 < Order; ++k) state[k][g] = (state[k + 1][g] + b[k + 1] * u) - a[k + 1] * y;
      state[Order - 1][g] = b[Order] * u - a[Order] * y;
    }
    return y;
  }

  /// The filter of the opposite sign, whose output is -y.
  void negate() {
    for (int k = 0; k <= Order; ++k) b[k] = -b[k];
    for (int k = 0; k < Order; ++k) {
      for (int g = 0; g < Groups; ++g) state[k][g] = -state[k][g];
    }
  }

  void save(double* z, KernelIndex state_stride) const {
    for (int k = 0; k < Order; ++k) {
      for (int g = 0; g < Groups; ++g) store(z + k * state_stride + g * kWidth, state[k][g]);
    }
  }
};

template <int Order, int Groups, bool Masked>
void filter_groups(const double* b, const double* a, double* z, KernelIndex state_stride, double* data,
                   KernelIndex rows, KernelIndex stride, KernelIndex columns) {
  ColumnFilter<Order, Groups> filter(b, a, z, state_stride);
  Vec live[Groups];
  for (int g = 0; g < Groups; ++g) live[g] = keep_columns(splat(1.0), columns - g * kWidth);
  for (KernelIndex t = 0; t < rows; ++t) {
    double* row = data + t * stride;
    for (int g = 0; g < Groups; ++g) {
      Vec u = load(row + g * kWidth);
      if constexpr (Masked) u = select_columns(u, live[g]);
      store(row + g * kWidth, filter.step(u, g));
    }
  }
  filter.save(z, state_stride);
}

inline void filter_group_any(const double* b, const double* a, KernelIndex order, double* z, KernelIndex state_stride,
                             double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns) {
  const Vec live = keep_columns(splat(1.0), columns);
  for (KernelIndex t = 0; t < rows; ++t) {
    double* row = data + t * stride;
    const Vec u = select_columns(load(row), live);
    const Vec y = b[0] * u + load(z);
    for (KernelIndex k = 0; k + 1 < order; ++k) {
      store(z + k * state_stride, (load(z + (k + 1) * state_stride) + b[k + 1] * u) - a[k + 1] * y);
    }
    store(z + (order - 1) * state_stride, b[order] * u - a[order] * y);
    store(row, y);
  }
}

template <int Order>
void filter_columns_fixed(const double* b, const double* a, double* z, KernelIndex state_stride, double* data,
                          KernelIndex rows, KernelIndex stride, KernelIndex columns) {
  // Two groups hide the latency of the recursion; more would spill the state of the higher orders.
  constexpr int kGroups = 2;
  constexpr KernelIndex kStep = kGroups * kWidth;
  KernelIndex c = 0;
  for (; c + kStep <= columns; c += kStep) {
    filter_groups<Order, kGroups, false>(b, a, z + c, state_stride, data + c, rows, stride, kStep);
  }
  const KernelIndex rest = columns - c;
  if (rest > kWidth) {
    filter_groups<Order, kGroups, true>(b, a, z + c, state_stride, data + c, rows, stride, rest);
  } else if (rest > 0) {
    filter_groups<Order, 1, true>(b, a, z + c, state_stride, data + c, rows, stride, rest);
  }
}

void filter_columns(const double* b, const double* a, KernelIndex order, double* z, KernelIndex state_stride,
                    double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns) {
  switch (order) {
    case 0:
      filter_columns_fixed<0>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 1:
      filter_columns_fixed<1>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 2:
      filter_columns_fixed<2>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 3:
      filter_columns_fixed<3>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 4:
      filter_columns_fixed<4>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 5:
      filter_columns_fixed<5>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 6:
      filter_columns_fixed<6>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 7:
      filter_columns_fixed<7>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    case 8:
      filter_columns_fixed<8>(b, a, z, state_stride, data, rows, stride, columns);
      break;
    default:
      for (KernelIndex c = 0; c < columns; c += kWidth) {
        filter_group_any(b, a, order, z + c, state_stride, data + c, rows, stride, columns - c);
      }
  }
}

void scale_rows(const double* slope, double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns) {
  for (KernelIndex t = 0; t < rows; ++t) {
    double* row = data + t * stride;
    const double factor = slope[t];
    for (KernelIndex c = 0; c < columns; c += kWidth) store(row + c, factor * load(row + c));
  }
}

/// Where the next tile will write: its lines come while this one is computed.
inline void prefetch_row(double* row, KernelIndex columns) {
  for (KernelIndex c = 0; c < columns; c += 8) __builtin_prefetch(row + c, 1, 2);
}

/// Rows of whole vectors and a rest of Tail columns, whose number the compiler knows.
template <int Tail>
bool negated_rows_fixed(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns,
                        const double* weight, double* target) {
  const KernelIndex whole = columns - Tail;
  const Vec live = keep_columns(splat(1.0), Tail);
  Vec check = {};
  for (KernelIndex t = 0; t < rows; ++t) {
    const double* row = data + t * stride;
    double* out = target + t * columns;
    const double factor = weight == nullptr ? -1.0 : -weight[t];
    prefetch_row(out + rows * columns, columns);
    for (KernelIndex c = 0; c < whole; c += kWidth) {
      const Vec value = factor * load(row + c);
      check += 0.0 * value;
      store(out + c, value);
    }
    if constexpr (Tail > 0) {
      const Vec value = factor * load(row + whole);
      check += 0.0 * select_columns(value, live);
      __builtin_memcpy(out + whole, &value, Tail * 8);
    }
  }
  return lane_sum(check) == 0.0;
}

bool negated_rows(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns, const double* weight,
                  double* target) {
  switch (columns % kWidth) {
    case 0:
      return negated_rows_fixed<0>(data, rows, stride, columns, weight, target);
    case 1:
      return negated_rows_fixed<1>(data, rows, stride, columns, weight, target);
#if BLOCKID_KERNEL_WIDTH > 2
    case 2:
      return negated_rows_fixed<2>(data, rows, stride, columns, weight, target);
    case 3:
      return negated_rows_fixed<3>(data, rows, stride, columns, weight, target);
#endif
#if BLOCKID_KERNEL_WIDTH > 4
    case 4:
      return negated_rows_fixed<4>(data, rows, stride, columns, weight, target);
    case 5:
      return negated_rows_fixed<5>(data, rows, stride, columns, weight, target);
    case 6:
      return negated_rows_fixed<6>(data, rows, stride, columns, weight, target);
    case 7:
      return negated_rows_fixed<7>(data, rows, stride, columns, weight, target);
#endif
    default:
      return false;
  }
}

// ---------------------------------------------------------------------------------------------------------------
// The filter that ends a chain: its columns go where the Jacobian lies, packed and negated, without a stop in the tile.
// Rows come in ascending order. Whole vectors run over into what is written next; rows near the end, behind which
// nothing may be written, are stored exactly.

template <bool Exact>
inline void put(double* out, Vec value, KernelIndex count) {
  if constexpr (Exact) {
    const KernelIndex kept = count < kWidth ? count : kWidth;
    for (KernelIndex lane = 0; lane < kept; ++lane) out[lane] = value[lane];
  } else {
    store(out, value);
  }
}

/// -signal_t, -signal_{t-1}, ...: `values` points at sample t of a signal stored newest first.
template <bool Exact>
inline void put_negated(double* out, const double* values, KernelIndex count) {
#if BLOCKID_KERNEL_WIDTH == 8
  // A store of 32 bytes costs half of one of 64.
  if (!Exact && count <= 4) return store_half(out, -load_half(values));
#endif
  for (KernelIndex c = 0; c < count; c += kWidth) put<Exact>(out + c, -load(values + c), count - c);
}

/// The columns of row t that the filter itself adds.
template <bool Exact>
inline void put_own(const FilterRows& job, KernelIndex t) {
  double* out = job.target + t * job.width() + job.columns;
  put_negated<Exact>(out, job.s.values + job.rows - 1 - t, job.s.count);
  put_negated<Exact>(out + job.s.count, job.r.values + job.rows - 1 - t, job.r.count);
}

/// The first of the rows whose whole vectors could reach behind the last row.
inline KernelIndex first_exact_row(const FilterRows& job) {
  const KernelIndex exact = (job.width() + kWidth - 2) / job.width();
  return exact < job.rows ? job.rows - exact : 0;
}

/// The rows of a filter with no columns before it.
inline void negated_own_rows(const FilterRows& job) {
  const KernelIndex split = first_exact_row(job);
  for (KernelIndex t = 0; t < split; ++t) put_own<false>(job, t);
  for (KernelIndex t = split; t < job.rows; ++t) put_own<true>(job, t);
}

/// Rows first .. last-1 of the vectors from column c on; Own: and of the shifted signals behind them. All by value:
/// what the stores cannot reach stays in registers.
template <int Order, int Groups, bool Own, bool Exact>
ColumnFilter<Order, Groups> negated_filter_span(ColumnFilter<Order, Groups> filter, const FilterRows job, KernelIndex c,
                                                KernelIndex first, KernelIndex last) {
  const KernelIndex width = job.width();
  constexpr int kLast = Groups - 1;
  const Vec live = keep_columns(splat(1.0), job.columns - c - kLast * kWidth);
  for (KernelIndex t = first; t < last; ++t) {
    const double* row = job.data + t * job.stride + c;
    double* out = job.target + t * width;
    if constexpr (Own) prefetch_row(out + job.rows * width, width);
    for (int g = 0; g < Groups; ++g) {
      Vec u = load(row + g * kWidth);
      if (Own && g == kLast) u = select_columns(u, live);
      put<Exact>(out + c + g * kWidth, filter.step(u, g), width - c - g * kWidth);
    }
    if constexpr (Own) put_own<Exact>(job, t);
  }
  return filter;
}
/// All rows of `Groups` vectors from column c on. A number that is not finite never leaves a recursion (0 * inf is not
/// a number either), so the state at the end tells whether all were.
template <int Order, int Groups, bool Own>
bool negated_filter_groups(const double* b, const double* a, double* z, KernelIndex state_stride, const FilterRows& job,
                           KernelIndex c) {
  const KernelIndex split = Own ? first_exact_row(job) : job.rows;
  ColumnFilter<Order, Groups> filter(b, a, z + c, state_stride);
  filter.negate();
  filter = negated_filter_span<Order, Groups, Own, false>(filter, job, c, 0, split);
  filter = negated_filter_span<Order, Groups, Own, Own>(filter, job, c, split, job.rows);
  filter.negate();
  filter.save(z + c, state_stride);
  Vec check = {};
  for (int k = 0; k < Order; ++k) {
    for (int g = 0; g < Groups; ++g) check += 0.0 * filter.state[k][g];
  }
  return lane_sum(check) == 0.0;
}

bool all_finite(const double* values, KernelIndex count) {
  Vec check = {};
  KernelIndex k = 0;
  for (; k + kWidth <= count; k += kWidth) check += 0.0 * load(values + k);
  double sum = lane_sum(check);
  for (; k < count; ++k) sum += 0.0 * values[k];
  return sum == 0.0;
}

/// Whether all samples are that the rows read.
inline bool all_finite(const ShiftedSignal& signal, KernelIndex rows) {
  return signal.count == 0 || all_finite(signal.values, rows - 1 + signal.count);
}

template <int Order>
bool negated_filter_rows_fixed(const double* b, const double* a, double* z, KernelIndex state_stride,
                               const FilterRows& job) {
  constexpr int kGroups = 2;
  constexpr KernelIndex kStep = kGroups * kWidth;
  bool finite = all_finite(job.s, job.rows) && all_finite(job.r, job.rows);
  if (job.columns == 0) {
    negated_own_rows(job);
    return finite;
  }
  // The rest first: its whole vectors run over into the next row, whose first columns are written later.
  const KernelIndex rest = (job.columns - 1) / kStep * kStep;
  if (job.columns - rest > kWidth) {
    finite = negated_filter_groups<Order, kGroups, true>(b, a, z, state_stride, job, rest) && finite;
  } else {
    finite = negated_filter_groups<Order, 1, true>(b, a, z, state_stride, job, rest) && finite;
  }
  for (KernelIndex c = 0; c < rest; c += kStep) {
    finite = negated_filter_groups<Order, kGroups, false>(b, a, z, state_stride, job, c) && finite;
  }
  return finite;
}

bool negated_filter_rows(const double* b, const double* a, KernelIndex order, double* z, KernelIndex state_stride,
                         const FilterRows& job) {
  switch (order) {
    case 1:
      return negated_filter_rows_fixed<1>(b, a, z, state_stride, job);
    case 2:
      return negated_filter_rows_fixed<2>(b, a, z, state_stride, job);
    case 3:
      return negated_filter_rows_fixed<3>(b, a, z, state_stride, job);
    case 4:
      return negated_filter_rows_fixed<4>(b, a, z, state_stride, job);
    case 5:
      return negated_filter_rows_fixed<5>(b, a, z, state_stride, job);
    case 6:
      return negated_filter_rows_fixed<6>(b, a, z, state_stride, job);
    case 7:
      return negated_filter_rows_fixed<7>(b, a, z, state_stride, job);
    case 8:
      return negated_filter_rows_fixed<8>(b, a, z, state_stride, job);
    default:
      return false;
  }
}

/// `Outputs` sums of the same rows, over `Groups` vectors of columns: they stay in registers.
template <int Outputs, int Groups>
void mix_group(const double* weights, KernelIndex inputs, const double* data, KernelIndex stride, double* target,
               KernelIndex target_stride) {
  Vec sum[Outputs][Groups] = {};
  for (KernelIndex k = 0; k < inputs; ++k) {
    Vec row[Groups];
    for (int g = 0; g < Groups; ++g) row[g] = load(data + k * stride + g * kWidth);
    for (int r = 0; r < Outputs; ++r) {
      const double weight = weights[k * Outputs + r];
      for (int g = 0; g < Groups; ++g) sum[r][g] += weight * row[g];
    }
  }
  for (int r = 0; r < Outputs; ++r) {
    for (int g = 0; g < Groups; ++g) store(target + r * target_stride + g * kWidth, sum[r][g]);
  }
}

template <int Outputs>
void mix_rows_fixed(const double* weights, KernelIndex inputs, const double* data, KernelIndex stride, double* target,
                    KernelIndex target_stride, KernelIndex columns) {
  constexpr int kGroups = 2;
  constexpr KernelIndex kStep = kGroups * kWidth;
  const KernelIndex padded = (columns + 7) / 8 * 8;
  KernelIndex c = 0;
  for (; c + kStep <= padded; c += kStep) {
    mix_group<Outputs, kGroups>(weights, inputs, data + c, stride, target + c, target_stride);
  }
  if (c < padded) mix_group<Outputs, 1>(weights, inputs, data + c, stride, target + c, target_stride);
}

void mix_rows(const double* weights, KernelIndex inputs, KernelIndex outputs, const double* data, KernelIndex stride,
              double* target, KernelIndex target_stride, KernelIndex columns) {
  switch (outputs) {
    case 1:
      return mix_rows_fixed<1>(weights, inputs, data, stride, target, target_stride, columns);
    case 2:
      return mix_rows_fixed<2>(weights, inputs, data, stride, target, target_stride, columns);
    case 3:
      return mix_rows_fixed<3>(weights, inputs, data, stride, target, target_stride, columns);
    case 4:
      return mix_rows_fixed<4>(weights, inputs, data, stride, target, target_stride, columns);
    case 5:
      return mix_rows_fixed<5>(weights, inputs, data, stride, target, target_stride, columns);
    case 6:
      return mix_rows_fixed<6>(weights, inputs, data, stride, target, target_stride, columns);
    case 7:
      return mix_rows_fixed<7>(weights, inputs, data, stride, target, target_stride, columns);
    case 8:
      return mix_rows_fixed<8>(weights, inputs, data, stride, target, target_stride, columns);
    default:
      return;
  }
}

void residual(const double* y, const double* yhat, double* r, KernelIndex n) {
  KernelIndex t = 0;
  for (; t + kWidth <= n; t += kWidth) store(r + t, load(y + t) - load(yhat + t));
  for (; t < n; ++t) r[t] = y[t] - yhat[t];
}

// ---------------------------------------------------------------------------------------------------------------
// Normal equations

template <int Rows, int Vectors>
void gram_block(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex i, KernelIndex j, double* gram,
                KernelIndex gram_stride) {
  Vec sum[Rows][Vectors] = {};
  for (KernelIndex t = 0; t < rows; ++t) {
    const double* row = data + t * stride;
    Vec right[Vectors];
    for (int v = 0; v < Vectors; ++v) right[v] = load(row + j + v * kWidth);
    for (int k = 0; k < Rows; ++k) {
      const double left = row[i + k];
      for (int v = 0; v < Vectors; ++v) sum[k][v] += left * right[v];
    }
  }
  for (int k = 0; k < Rows; ++k) {
    for (int v = 0; v < Vectors; ++v) {
      double* target = gram + (i + k) * gram_stride + j + v * kWidth;
      store(target, load(target) + sum[k][v]);
    }
  }
}

#if BLOCKID_KERNEL_WIDTH == 8
/// The upper triangle of the block at (i, i), its lower half of rows without the left half of columns: Rows <= 8 of a
/// width of 8.
template <int Rows>
void gram_diagonal(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex i, double* gram,
                   KernelIndex gram_stride) {
  constexpr int kUpper = Rows < 4 ? Rows : 4;
  constexpr int kLower = Rows - kUpper;
  Vec upper[kUpper] = {};
  Half lower[kLower > 0 ? kLower : 1] = {};
  for (KernelIndex t = 0; t < rows; ++t) {
    const double* row = data + t * stride + i;
    const Vec right = load(row);
    for (int k = 0; k < kUpper; ++k) upper[k] += row[k] * right;
    if constexpr (kLower > 0) {
      const Half right_half = load_half(row + 4);
      for (int k = 0; k < kLower; ++k) lower[k] += row[4 + k] * right_half;
    }
  }
  for (int k = 0; k < kUpper; ++k) {
    double* target = gram + (i + k) * gram_stride + i;
    store(target, load(target) + upper[k]);
  }
  for (int k = 0; k < kLower; ++k) {
    double* target = gram + (i + 4 + k) * gram_stride + i + 4;
    store_half(target, load_half(target) + lower[k]);
  }
}

/// Rows i .. i+Rows-1 of the triangle, for the widest set.
template <int Rows>
void gram_rows(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns, KernelIndex i,
               double* gram, KernelIndex gram_stride) {
  gram_diagonal<Rows>(data, rows, stride, i, gram, gram_stride);
  KernelIndex j = i + 8;
  for (; j + 8 < columns; j += 16) gram_block<Rows, 2>(data, rows, stride, i, j, gram, gram_stride);
  if (j < columns) gram_block<Rows, 1>(data, rows, stride, i, j, gram, gram_stride);
}

void add_gram(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns, double* gram,
              KernelIndex gram_stride) {
  KernelIndex i = 0;
  for (; i + 8 <= columns; i += 8) gram_rows<8>(data, rows, stride, columns, i, gram, gram_stride);
  switch (columns - i) {
    case 1:
      return gram_rows<1>(data, rows, stride, columns, i, gram, gram_stride);
    case 2:
      return gram_rows<2>(data, rows, stride, columns, i, gram, gram_stride);
    case 3:
      return gram_rows<3>(data, rows, stride, columns, i, gram, gram_stride);
    case 4:
      return gram_rows<4>(data, rows, stride, columns, i, gram, gram_stride);
    case 5:
      return gram_rows<5>(data, rows, stride, columns, i, gram, gram_stride);
    case 6:
      return gram_rows<6>(data, rows, stride, columns, i, gram, gram_stride);
    case 7:
      return gram_rows<7>(data, rows, stride, columns, i, gram, gram_stride);
    default:
      return;
  }
}
#else
void add_gram(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns, double* gram,
              KernelIndex gram_stride) {
  constexpr int kVectors = 8 / kWidth;
  // As many accumulators as the registers take.
  constexpr int kRows = kWidth == 4 ? 4 : 2;
  for (KernelIndex i = 0; i < columns; i += kRows) {
    for (KernelIndex j = i / 8 * 8; j < columns; j += 8) {
      gram_block<kRows, kVectors>(data, rows, stride, i, j, gram, gram_stride);
    }
  }
}
#endif

// ---------------------------------------------------------------------------------------------------------------
// Chebyshev polynomials

void chebyshev(const double* c, KernelIndex degree, double scale, double shift, const double* u, double* y,
               KernelIndex n) {
  KernelIndex t = 0;
  for (; t + kWidth <= n; t += kWidth) {
    const Vec x = scale * load(u + t) + shift;
    Vec d1 = {};
    Vec d2 = {};
    for (KernelIndex k = degree; k >= 1; --k) {
      const Vec d0 = 2.0 * x * d1 - d2 + c[k];
      d2 = d1;
      d1 = d0;
    }
    store(y + t, x * d1 - d2 + c[0]);
  }
  for (; t < n; ++t) {
    const double x = scale * u[t] + shift;
    double d1 = 0.0;
    double d2 = 0.0;
    for (KernelIndex k = degree; k >= 1; --k) {
      const double d0 = 2.0 * x * d1 - d2 + c[k];
      d2 = d1;
      d1 = d0;
    }
    y[t] = x * d1 - d2 + c[0];
  }
}

/// Samples whose basis values are kept at once.
constexpr KernelIndex kBasisRows = 64;

/// A vector of the first `count` numbers, zeros behind them.
inline Vec load_some(const double* p, KernelIndex count) {
  if (count >= kWidth) return load(p);
  Vec v = {};
  for (int lane = 0; lane < kWidth; ++lane) {
    if (lane < count) v[lane] = p[lane];
  }
  return v;
}

/// T_0 .. T_degree of up to 64 samples, row k of `basis` holding T_k; value and slope (to u) of the series beside them.
inline void chebyshev_basis(const double* c, KernelIndex degree, double scale, double shift, const double* u,
                            KernelIndex n, double* basis, double* value, double* slope) {
  for (KernelIndex t = 0; t < n; t += kWidth) {
    const Vec x = scale * load_some(u + t, n - t) + shift;
    // T_k' = k U_{k-1} with U_k = 2 x U_{k-1} - U_{k-2}.
    Vec first_past = splat(1.0);
    Vec first = x;
    Vec second_past = {};
    Vec second = splat(1.0);
    Vec sum = splat(c[0]);
    Vec rise = {};
    store(basis + t, first_past);
    for (KernelIndex k = 1; k <= degree; ++k) {
      store(basis + k * kBasisRows + t, first);
      sum += c[k] * first;
      rise += (c[k] * static_cast<double>(k)) * second;
      const Vec first_next = 2.0 * x * first - first_past;
      const Vec second_next = 2.0 * x * second - second_past;
      first_past = first;
      first = first_next;
      second_past = second;
      second = second_next;
    }
    store(value + t, sum);
    store(slope + t, scale * rise);
  }
}

/// Row t of the tile becomes [basis_0(t), basis_1(t), ...].
template <int Count>
void transposed_columns_fixed(const double* basis, double* data, KernelIndex rows, KernelIndex stride) {
  for (KernelIndex t = 0; t < rows; ++t) {
    double* row = data + t * stride;
    for (int k = 0; k < Count; ++k) row[k] = basis[k * kBasisRows + t];
  }
}

inline void transposed_columns(const double* basis, double* data, KernelIndex rows, KernelIndex stride,
                               KernelIndex count) {
  for (; count > 8; count -= 8, basis += 8 * kBasisRows, data += 8) {
    transposed_columns_fixed<8>(basis, data, rows, stride);
  }
  switch (count) {
    case 1:
      transposed_columns_fixed<1>(basis, data, rows, stride);
      return;
    case 2:
      transposed_columns_fixed<2>(basis, data, rows, stride);
      return;
    case 3:
      transposed_columns_fixed<3>(basis, data, rows, stride);
      return;
    case 4:
      transposed_columns_fixed<4>(basis, data, rows, stride);
      return;
    case 5:
      transposed_columns_fixed<5>(basis, data, rows, stride);
      return;
    case 6:
      transposed_columns_fixed<6>(basis, data, rows, stride);
      return;
    case 7:
      transposed_columns_fixed<7>(basis, data, rows, stride);
      return;
    case 8:
      transposed_columns_fixed<8>(basis, data, rows, stride);
      return;
    default:
      return;
  }
}

void chebyshev_tangents(const double* c, KernelIndex degree, double scale, double shift, const double* u, double* y,
                        KernelIndex n, double* data, KernelIndex stride, KernelIndex upstream) {
  double basis[64 * kBasisRows];
  double value[kBasisRows];
  double slope[kBasisRows];
  for (KernelIndex start = 0; start < n; start += kBasisRows) {
    const KernelIndex rows = n - start < kBasisRows ? n - start : kBasisRows;
    double* tile = data + start * stride;
    const bool whole = rows == kBasisRows;
    chebyshev_basis(c, degree, scale, shift, u + start, rows, basis, whole ? y + start : value, slope);
    scale_rows(slope, tile, rows, stride, upstream);
    transposed_columns(basis, tile + upstream, rows, stride, degree + 1);
    for (KernelIndex t = 0; !whole && t < rows; ++t) y[start + t] = value[t];
  }
}

// ---------------------------------------------------------------------------------------------------------------
// Long convolutions

void convolve_signal(const double* h, KernelIndex n, const double* u, double* y, KernelIndex rows) {
  constexpr int kVectors = 4;
  KernelIndex t = 0;
  for (; t + kVectors * kWidth <= rows; t += kVectors * kWidth) {
    Vec sum[kVectors] = {};
    for (KernelIndex k = 0; k <= n; ++k) {
      for (int v = 0; v < kVectors; ++v) sum[v] += h[k] * load(u + t + v * kWidth - k);
    }
    for (int v = 0; v < kVectors; ++v) store(y + t + v * kWidth, sum[v]);
  }
  for (; t < rows; ++t) {
    double sum = 0.0;
    for (KernelIndex k = 0; k <= n; ++k) sum += h[k] * u[t - k];
    y[t] = sum;
  }
}

/// Rows outputs of 8 columns: each input row is read once for all of them, its weight 0 where it lies outside.
template <int Rows>
void convolve_block(const double* h, KernelIndex n, const double* input, KernelIndex input_stride, double* output,
                    KernelIndex output_stride) {
  constexpr int kVectors = 8 / kWidth;
  Vec sum[Rows][kVectors] = {};
  for (KernelIndex s = -n; s < Rows; ++s) {
    const double* row = input + s * input_stride;
    Vec values[kVectors];
    for (int v = 0; v < kVectors; ++v) values[v] = load(row + v * kWidth);
    for (int i = 0; i < Rows; ++i) {
      for (int v = 0; v < kVectors; ++v) sum[i][v] += h[i - s] * values[v];
    }
  }
  for (int i = 0; i < Rows; ++i) {
    for (int v = 0; v < kVectors; ++v) store(output + i * output_stride + v * kWidth, sum[i][v]);
  }
}

void convolve_columns(const double* h, KernelIndex n, const double* input, KernelIndex input_stride, double* output,
                      KernelIndex output_stride, KernelIndex rows, KernelIndex columns) {
  constexpr int kRows = kWidth == 8 ? 8 : (kWidth == 4 ? 4 : 2);
  static_assert(kRows <= kConvolutionGuard + 1);
  for (KernelIndex c = 0; c < columns; c += 8) {
    KernelIndex t = 0;
    for (; t + kRows <= rows; t += kRows) {
      convolve_block<kRows>(h, n, input + t * input_stride + c, input_stride, output + t * output_stride + c,
                            output_stride);
    }
    for (; t < rows; ++t) {
      convolve_block<1>(h, n, input + t * input_stride + c, input_stride, output + t * output_stride + c,
                        output_stride);
    }
  }
}

extern const Kernels kTable;
const Kernels kTable = {BLOCKID_KERNEL_NAME,
                        filter_signal,
                        filter_columns,
                        filter_tangents,
                        shifted_columns,
                        add_gram,
                        chebyshev,
                        chebyshev_tangents,
                        scale_rows,
                        negated_rows,
                        convolve_signal,
                        convolve_columns,
                        mix_rows,
                        negated_filter_rows,
                        all_finite,
                        residual};

}  // namespace blockid::detail::BLOCKID_KERNEL_SET
