#include <blockid/cli/outputs.hpp>

#include <blockid/data/atomic_file.hpp>

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <set>
#include <system_error>

namespace blockid::cli {
namespace {

namespace fs = std::filesystem;

void check_output(const fs::path& path) {
  std::error_code code;
  const fs::path given = path.parent_path();
  const fs::path folder = given.empty() ? fs::path(".") : given;
  if (!fs::is_directory(folder, code)) {
    throw OutputError(compose(path.string(), ": cannot write: there is no folder ", folder.string()));
  }
  if (fs::is_directory(path, code)) throw OutputError(compose(path.string(), ": cannot write: is a folder"));
  const bool special = fs::exists(path, code) && !fs::is_regular_file(path, code);
  if (::access(special ? path.c_str() : folder.c_str(), W_OK) != 0) {
    throw OutputError(compose(path.string(), ": cannot write: ", std::generic_category().message(errno)));
  }
}

}  // namespace

void check_outputs(const std::vector<std::string>& files) {
  std::set<fs::path> seen;
  for (const std::string& file : files) {
    if (file.empty()) continue;
    check_output(file);
    const bool is_new = seen.insert(fs::weakly_canonical(fs::absolute(file))).second;
    if (!is_new && file.rfind("/dev/", 0) != 0) fail(file, ": two results cannot go to the same file");
  }
}

void make_folder(const fs::path& folder) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) throw OutputError(compose(folder.string(), ": cannot make the folder: ", code.message()));
}

void write_output(const std::string& file, std::string_view content) {
  try {
    write_file_atomically(file, content);
  } catch (const Error& error) {
    throw OutputError(error.what());
  }
}

std::string json_text(const nlohmann::ordered_json& value) {
  return value.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace blockid::cli
