#define BLOCKID_KERNEL_SET avx2
#define BLOCKID_KERNEL_NAME "avx2"
#define BLOCKID_KERNEL_WIDTH 4
#include <blockid/blocks/detail/kernels.inl>
