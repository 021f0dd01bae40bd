#define BLOCKID_KERNEL_SET baseline
#define BLOCKID_KERNEL_NAME "baseline"
#define BLOCKID_KERNEL_WIDTH 2
#include <blockid/blocks/detail/kernels.inl>
