#define BLOCKID_KERNEL_SET avx2
#define BLOCKID_KERNEL_NAME "avx2"
#define BLOCKID_KERNEL_WIDTH 4
#define BLOCKID_TILE_VECTORS 3
#define BLOCKID_TILE_COLUMNS 4
#include <blockid/validation/detail/dense_kernels.inl>
