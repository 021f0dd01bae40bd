#define BLOCKID_KERNEL_SET baseline
#define BLOCKID_KERNEL_NAME "baseline"
#define BLOCKID_KERNEL_WIDTH 2
#define BLOCKID_TILE_VECTORS 2
#define BLOCKID_TILE_COLUMNS 4
#include <blockid/validation/detail/dense_kernels.inl>
