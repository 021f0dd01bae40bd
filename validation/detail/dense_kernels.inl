// Body of the dense kernels; included once by each translation unit that defines BLOCKID_KERNEL_SET (a namespace name),
// BLOCKID_KERNEL_WIDTH (doubles in a vector register), BLOCKID_TILE_VECTORS and BLOCKID_TILE_COLUMNS (the tile of C that
// the registers hold).
#include <blockid/validation/detail/dense_kernels.hpp>

namespace blockid::detail::BLOCKID_KERNEL_SET {

constexpr KernelIndex kWidth = BLOCKID_KERNEL_WIDTH;
constexpr int kVectors = BLOCKID_TILE_VECTORS;
constexpr KernelIndex kTileRows = kVectors * kWidth;
constexpr KernelIndex kTileColumns = BLOCKID_TILE_COLUMNS;
typedef double Vec __attribute__((vector_size(8 * BLOCKID_KERNEL_WIDTH)));

static_assert(kPackedRows % kTileRows == 0 && kPackedColumns % kTileColumns == 0);

inline Vec load(const double* p) {
  Vec v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}

inline void store(double* p, Vec v) { __builtin_memcpy(p, &v, sizeof v); }

inline KernelIndex smaller(KernelIndex a, KernelIndex b) { return a < b ? a : b; }

/// Panels of `tile` rows, column after column, zeros beyond the last row.
inline void pack(const double* data, KernelIndex row_step, KernelIndex column_step, KernelIndex rows,
                 KernelIndex columns, KernelIndex tile, double* __restrict packed) {
  for (KernelIndex first = 0; first < rows; first += tile) {
    const KernelIndex count = smaller(tile, rows - first);
    for (KernelIndex k = 0; k < columns; ++k, packed += tile) {
      const double* source = data + first * row_step + k * column_step;
      if (row_step == 1) {
        for (KernelIndex i = 0; i < count; ++i) packed[i] = source[i];
      } else {
        for (KernelIndex i = 0; i < count; ++i) packed[i] = source[i * row_step];
      }
      for (KernelIndex i = count; i < tile; ++i) packed[i] = 0.0;
    }
  }
}

/// C += factor A B on one tile of packed panels.
inline void add_tile(KernelIndex inner, double factor, const double* __restrict a, const double* __restrict b,
                     double* __restrict c, KernelIndex c_step) {
  Vec sum[kTileColumns][kVectors] = {};
  for (KernelIndex k = 0; k < inner; ++k, a += kTileRows, b += kTileColumns) {
    Vec column[kVectors];
    for (int i = 0; i < kVectors; ++i) column[i] = load(a + i * kWidth);
    for (int j = 0; j < kTileColumns; ++j) {
      for (int i = 0; i < kVectors; ++i) sum[j][i] += column[i] * b[j];
    }
  }
  for (int j = 0; j < kTileColumns; ++j) {
    for (int i = 0; i < kVectors; ++i) {
      double* target = c + j * c_step + i * kWidth;
      store(target, load(target) + factor * sum[j][i]);
    }
  }
}

/// The tile at the edge of C, of which rows x columns are there.
inline void add_part_of_tile(KernelIndex inner, double factor, const double* a, const double* b, double* c,
                             KernelIndex c_step, KernelIndex rows, KernelIndex columns) {
  double tile[kTileRows * kTileColumns] = {};
  add_tile(inner, factor, a, b, tile, kTileRows);
  for (KernelIndex j = 0; j < columns; ++j) {
    for (KernelIndex i = 0; i < rows; ++i) c[i + j * c_step] += tile[i + j * kTileRows];
  }
}

/// C += factor A B of packed pieces; the first row of the piece is row `row` of the whole, its first column `column`.
inline void add_piece(KernelIndex rows, KernelIndex columns, KernelIndex inner, double factor, const double* a,
                      const double* b, double* c, KernelIndex c_step, bool lower, KernelIndex row, KernelIndex column) {
  for (KernelIndex j = 0; j < columns; j += kTileColumns) {
    for (KernelIndex i = 0; i < rows; i += kTileRows) {
      if (lower && row + i + kTileRows <= column + j) continue;
      const double* panel_a = a + i * inner;
      const double* panel_b = b + j * inner;
      double* tile = c + i + j * c_step;
      if (i + kTileRows <= rows && j + kTileColumns <= columns) {
        add_tile(inner, factor, panel_a, panel_b, tile, c_step);
      } else {
        add_part_of_tile(inner, factor, panel_a, panel_b, tile, c_step, smaller(kTileRows, rows - i),
                         smaller(kTileColumns, columns - j));
      }
    }
  }
}

static void add_product(KernelIndex rows, KernelIndex columns, KernelIndex inner, double factor, MatrixView a,
                        MatrixView b, double* c, KernelIndex c_step, bool lower, double* workspace) {
  double* const packed_a = workspace;
  double* const packed_b = workspace + kPackedInner * kPackedRows;
  for (KernelIndex j = 0; j < columns; j += kPackedColumns) {
    const KernelIndex width = smaller(kPackedColumns, columns - j);
    for (KernelIndex k = 0; k < inner; k += kPackedInner) {
      const KernelIndex depth = smaller(kPackedInner, inner - k);
      pack(b.data + k * b.row_step + j * b.column_step, b.column_step, b.row_step, width, depth, kTileColumns,
           packed_b);
      for (KernelIndex i = 0; i < rows; i += kPackedRows) {
        const KernelIndex height = smaller(kPackedRows, rows - i);
        if (lower && i + height <= j) continue;
        pack(a.data + i * a.row_step + k * a.column_step, a.row_step, a.column_step, height, depth, kTileRows,
             packed_a);
        add_piece(height, width, depth, factor, packed_a, packed_b, c + i + j * c_step, c_step, lower, i, j);
      }
    }
  }
}

extern const DenseKernels kDenseTable;
const DenseKernels kDenseTable = {BLOCKID_KERNEL_NAME, add_product};

}  // namespace blockid::detail::BLOCKID_KERNEL_SET
