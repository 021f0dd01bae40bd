#include <blockid/blocks/detail/kernels.hpp>

#include <initializer_list>

namespace blockid::detail {

namespace baseline {
extern const Kernels kTable;
}

#ifdef BLOCKID_X86_KERNELS
namespace avx2 {
extern const Kernels kTable;
}
namespace avx512 {
extern const Kernels kTable;
}
#endif

const Kernels* kernels_for(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline:
      return &baseline::kTable;
#ifdef BLOCKID_X86_KERNELS
    case InstructionSet::avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? &avx2::kTable : nullptr;
    case InstructionSet::avx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") ? &avx512::kTable : nullptr;
#else
    default:
      return nullptr;
#endif
  }
  return nullptr;
}

const Kernels& kernels() {
  static const Kernels& chosen = []() -> const Kernels& {
    for (const InstructionSet set : {InstructionSet::avx512, InstructionSet::avx2}) {
      if (const Kernels* found = kernels_for(set)) return *found;
    }
    return *kernels_for(InstructionSet::baseline);
  }();
  return chosen;
}

}  // namespace blockid::detail
