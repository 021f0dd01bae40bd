#include "support/source_dir.hpp"

namespace blockid::testing {

// The only file compiled with the path, so that all other objects are the same in every clone.
std::filesystem::path source_dir() { return BLOCKID_SOURCE_DIR; }

}  // namespace blockid::testing
