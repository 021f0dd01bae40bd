#include <blockid/validation/detail/dense_kernels.hpp>

#include <initializer_list>

namespace blockid::detail {

namespace baseline {
extern const DenseKernels kDenseTable;
}

#ifdef BLOCKID_X86_KERNELS
namespace avx2 {
extern const DenseKernels kDenseTable;
}
namespace avx512 {
extern const DenseKernels kDenseTable;
}
#endif

const DenseKernels* dense_kernels_for(InstructionSet set) {
  if (kernels_for(set) == nullptr) return nullptr;
  switch (set) {
    case InstructionSet::baseline:
      return &baseline::kDenseTable;
#ifdef BLOCKID_X86_KERNELS
    case InstructionSet::avx2:
      return &avx2::kDenseTable;
    case InstructionSet::avx512:
      return &avx512::kDenseTable;
#else
    default:
      return nullptr;
#endif
  }
  return nullptr;
}

const DenseKernels& dense_kernels() {
  static const DenseKernels& chosen = []() -> const DenseKernels& {
    for (const InstructionSet set : {InstructionSet::avx512, InstructionSet::avx2}) {
      if (const DenseKernels* found = dense_kernels_for(set)) return *found;
    }
    return *dense_kernels_for(InstructionSet::baseline);
  }();
  return chosen;
}

}  // namespace blockid::detail
