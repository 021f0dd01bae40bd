#define BLOCKID_KERNEL_SET avx512
#define BLOCKID_KERNEL_NAME "avx512"
#define BLOCKID_KERNEL_WIDTH 8
#define BLOCKID_TILE_VECTORS 3
#define BLOCKID_TILE_COLUMNS 8
#include <blockid/validation/detail/dense_kernels.inl>
