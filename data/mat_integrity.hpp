#pragma once

// Internal to mat.cpp. matio 1.5.23 reads a cut or corrupted v5/v7 variable without a complaint and returns what its
// buffer happened to hold, so the file is verified before anything is believed. HDF5 (v7.3) verifies itself.

#include <filesystem>

namespace blockid::mat {

/// Verifies that every variable of a v4, v5 or v7 file ends within the file; reads only the headers of the variables.
/// @throws Error with the byte offset of the variable that does not.
void check_not_truncated(const std::filesystem::path& path);

/// Verifies the checksum of every compressed variable of a v7 file.
/// @throws Error with the byte offset of the variable whose checksum is wrong.
void check_compressed_data(const std::filesystem::path& path);

}  // namespace blockid::mat
