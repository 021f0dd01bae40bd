// The inner loops of dense matrix products, compiled once for each instruction set and chosen at run time.
// Raw pointers only: nothing from a header may be instantiated with wider instructions than its callers expect.
#pragma once

#include <blockid/blocks/detail/kernels.hpp>

namespace blockid::detail {

/// Rows and columns of the packed pieces: a piece of A stays in the second-level cache, one of B in the third.
inline constexpr KernelIndex kPackedRows = 192;
inline constexpr KernelIndex kPackedInner = 256;
inline constexpr KernelIndex kPackedColumns = 1024;
/// Numbers that add_product wants as workspace: a packed piece of A, one of B.
inline constexpr KernelIndex kProductWorkspace = kPackedInner * (kPackedRows + kPackedColumns);

/// A (rows, inner) or B (inner, columns): entry (i, j) at data[i row_step + j column_step].
struct MatrixView {
  const double* data;
  KernelIndex row_step;
  KernelIndex column_step;
};

/// The loops for one instruction set.
struct DenseKernels {
  const char* name;

  /// C += factor A B; C is (rows, columns), its columns c_step apart, and does not overlap A or B. With `lower`, only
  /// the entries on and below the diagonal are right afterwards. workspace: (kProductWorkspace,).
  void (*add_product)(KernelIndex rows, KernelIndex columns, KernelIndex inner, double factor, MatrixView a,
                      MatrixView b, double* c, KernelIndex c_step, bool lower, double* workspace);
};

/// The loops of one set, or nullptr when this machine or this build lacks them.
const DenseKernels* dense_kernels_for(InstructionSet set);

/// The best set of this machine, chosen once.
const DenseKernels& dense_kernels();

}  // namespace blockid::detail
