#define BLOCKID_KERNEL_SET avx512
#define BLOCKID_KERNEL_NAME "avx512"
#define BLOCKID_KERNEL_WIDTH 8
#include <blockid/blocks/detail/kernels.inl>
