#pragma once

#include <filesystem>

namespace blockid::testing {

// Root of the sources that the tests were built from: reference values and documents are read there.
std::filesystem::path source_dir();

}  // namespace blockid::testing
