#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace blockid {

/// Replaces the file at path by content so that a reader sees the old content or the new, never a
/// part.
///
/// The content goes to a temporary name in the same folder, is flushed to the disk and renamed. An
/// existing file keeps its permissions; a symbolic link keeps pointing where it did. A device or
/// pipe cannot be renamed over and is written directly.
/// @throws Error naming the path and the system's reason; the old file is then untouched and the
/// temporary one removed.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// The whole file as bytes.
/// @throws Error naming the path when it is missing, a folder or unreadable.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

}  // namespace blockid
