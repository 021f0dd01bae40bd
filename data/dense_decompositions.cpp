#define BLOCKID_DECOMPOSITION template
#include <blockid/data/dense_decompositions.hpp>
