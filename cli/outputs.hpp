// Result files: checked before the work, written whole or not at all.
#pragma once

#include <blockid/data/error.hpp>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace blockid::cli {

/// A result file cannot be written.
class OutputError : public Error {
 public:
  using Error::Error;
};

/// Throws OutputError when one of the files surely cannot be written (its folder is missing or closed, it is a folder),
/// Error when two are the same. Empty names are skipped.
void check_outputs(const std::vector<std::string>& files);

/// Makes the folder where it is missing; throws OutputError.
void make_folder(const std::filesystem::path& folder);

/// Replaces the file atomically; throws OutputError.
void write_output(const std::string& file, std::string_view content);

/// The JSON text with a line break at the end; numbers that are not finite become null.
std::string json_text(const nlohmann::ordered_json& value);

}  // namespace blockid::cli
