// Measured records that are too large to be kept in the repository.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "support/source_dir.hpp"

namespace blockid::testing {

// Folder of the measured records: $BLOCKID_DATA_DIR, otherwise `../shared/data` beside the source
// tree. It need not exist.
inline std::filesystem::path data_dir() {
  if (const char* dir = std::getenv("BLOCKID_DATA_DIR"); dir != nullptr && *dir != '\0') {
    return dir;
  }
  return (source_dir() / ".." / "shared" / "data").lexically_normal();
}

// The file `relative` ("wh2009/WienerHammerBenchMark.mat") of the data folder; nothing if it is not
// there.
inline std::optional<std::filesystem::path> data_file(std::string_view relative) {
  std::filesystem::path path = data_dir() / relative;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    return std::nullopt;
  }
  return path;
}

}  // namespace blockid::testing

// Skips the running test, naming what is missing, unless the data file is there; otherwise declares
// `const std::filesystem::path variable`. A macro because GTEST_SKIP has to return from the test
// itself.
#define BLOCKID_DATA_FILE_OR_SKIP(variable, relative)                                              \
  std::optional<std::filesystem::path> variable##_found = ::blockid::testing::data_file(relative); \
  if (!variable##_found) {                                                                         \
    GTEST_SKIP() << "data file " << (::blockid::testing::data_dir() / (relative)).string()         \
                 << " is not here; BLOCKID_DATA_DIR names the folder";                             \
  }                                                                                                \
  const std::filesystem::path variable = *std::move(variable##_found)
