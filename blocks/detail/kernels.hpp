// Inner loops that are compiled several times, once for each instruction set, and chosen at run time.
// Raw pointers only: nothing from a header may be instantiated with wider instructions than its callers expect.
#pragma once

#include <cstddef>

namespace blockid::detail {

using KernelIndex = std::ptrdiff_t;

/// Highest filter order that the unrolled kernels know; above it a loop over the order runs.
inline constexpr int kMaxUnrolledOrder = 8;

/// Zeros that convolve_columns wants on both sides of an impulse response.
inline constexpr int kConvolutionGuard = 7;

/// Numbers behind the last one read from a ShiftedSignal that a kernel may load and throw away.
inline constexpr int kShiftedSignalGuard = 7;

/// A signal stored newest first, sample t of `rows` at values[rows-1-t], and how many samples back from each are
/// wanted.
struct ShiftedSignal {
  const double* values;
  KernelIndex count;
};

/// Rows of a chain that ends in a filter: what comes in, what the filter adds, and where they go.
struct FilterRows {
  const double* data;  ///< rows x stride, `columns` of them live
  KernelIndex rows;
  KernelIndex stride;
  KernelIndex columns;
  ShiftedSignal s;
  ShiftedSignal r;
  double* target;  ///< rows x width(), packed

  KernelIndex width() const { return columns + s.count + r.count; }
};

/// The set of inner loops for one instruction set.
struct Kernels {
  const char* name;

  /// y_t = sum_{k=0..order} b_k u_{t-k} - sum_{k=1..order} a_k y_{t-k} + z_t, state z (order,) in transposed direct
  /// form II: z_t is what the past adds to output t. b, a: (order+1,), a_0 = 1 is not read. u, y: (n,), distinct.
  void (*filter_signal)(const double* b, const double* a, KernelIndex order, double* z, const double* u, double* y,
                        KernelIndex n);

  /// The same filter over every column of a row-major tile, in place: rows x stride, the first `columns` columns.
  /// z: order x state_stride. What lies between them and the next multiple
  /// of 8 may be overwritten with zeros.
  void (*filter_columns)(const double* b, const double* a, KernelIndex order, double* z, KernelIndex state_stride,
                         double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns);

  /// filter_signal together with s = u/A and r = -y/A, which its tangents are read from. s, r: (n + order,), newest
  /// first: on entry the last `order` entries hold the past, on exit entry n-1-t holds sample t.
  void (*filter_tangents)(const double* b, const double* a, KernelIndex order, double* z, const double* u, double* y,
                          double* s, double* r, KernelIndex n);

  /// Row t of the tile becomes [signal_t, signal_{t-1}, ..., signal_{t-count+1}] for a signal stored newest first, as
  /// filter_tangents leaves it: signal_t at entry rows-1-t. data: rows x stride; `room` >= count columns of it may be
  /// overwritten, with kShiftedSignalGuard numbers behind the signal if there are more than `count`.
  void (*shifted_columns)(const double* signal, double* data, KernelIndex rows, KernelIndex stride, KernelIndex count,
                          KernelIndex room);

  /// G += D'D on the upper triangle: G is row-major, columns x columns with stride `gram_stride`; D is rows x stride
  /// row-major. strides are multiples of 8. Rows and columns of G up to the next multiple of 8 may be written, below
  /// the diagonal only those of its blocks of 8.
  void (*add_gram)(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns, double* gram,
                   KernelIndex gram_stride);

  /// y_t = sum_k c_k T_k(scale u_t + shift), Chebyshev polynomials, k = 0..degree, by Clenshaw. u, y: (n,).
  void (*chebyshev)(const double* c, KernelIndex degree, double scale, double shift, const double* u, double* y,
                    KernelIndex n);

  /// As chebyshev, and the tangents of a static block: row t becomes slope_t * row t in its first `upstream` columns,
  /// followed by T_0 .. T_degree. data: n x stride.
  void (*chebyshev_tangents)(const double* c, KernelIndex degree, double scale, double shift, const double* u,
                             double* y, KernelIndex n, double* data, KernelIndex stride, KernelIndex upstream);

  /// row_t *= slope_t over the first `columns` columns of a row-major tile; columns up to the next multiple of 8 are
  /// scaled too.
  void (*scale_rows)(const double* slope, double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns);

  /// target_t = -weight_t row_t, the first `columns` columns packed without padding; weight may be null: ones. False
  /// when a value is not finite.
  bool (*negated_rows)(const double* data, KernelIndex rows, KernelIndex stride, KernelIndex columns,
                       const double* weight, double* target);

  /// y_t = sum_{k=0..n} h_k u_{t-k}. u points at sample 0, n past samples lie before it. h: (n+1,); u, y: (rows,).
  void (*convolve_signal)(const double* h, KernelIndex n, const double* u, double* y, KernelIndex rows);

  /// The same for every column: `input` points at row 0, n rows of the past lie before it. h: (n+1,) with
  /// kConvolutionGuard zeros before and behind it. columns and strides are multiples of 8; input and output do not
  /// overlap.
  void (*convolve_columns)(const double* h, KernelIndex n, const double* input, KernelIndex input_stride,
                           double* output, KernelIndex output_stride, KernelIndex rows, KernelIndex columns);

  /// target_r = sum_k weights[k outputs + r] row_k, r < outputs <= 8, k < inputs, over the first `columns` columns of
  /// row-major tiles; columns up to the next multiple of 8 are written too.
  void (*mix_rows)(const double* weights, KernelIndex inputs, KernelIndex outputs, const double* data,
                   KernelIndex stride, double* target, KernelIndex target_stride, KernelIndex columns);

  /// target_t = -[(B/A data)_t, s_t, s_{t-1}, ..., r_t, r_{t-1}, ...]: what filter_columns, shifted_columns and
  /// negated_rows would leave, written once. job.width() >= 1; 1 <= order <= kMaxUnrolledOrder; b, a, z as in
  /// filter_columns. data is not written, nor anything behind the last row of the target. False when a value is not
  /// finite.
  bool (*negated_filter_rows)(const double* b, const double* a, KernelIndex order, double* z, KernelIndex state_stride,
                              const FilterRows& job);

  /// Whether all `count` values are.
  bool (*all_finite)(const double* values, KernelIndex count);

  /// r_t = y_t - yhat_t, t < n.
  void (*residual)(const double* y, const double* yhat, double* r, KernelIndex n);
};

/// Instruction sets in the order of preference.
enum class InstructionSet { baseline, avx2, avx512 };

/// The kernels of one set, or nullptr when this machine or this build lacks them.
const Kernels* kernels_for(InstructionSet set);

/// The best set of this machine, chosen once.
const Kernels& kernels();

}  // namespace blockid::detail
