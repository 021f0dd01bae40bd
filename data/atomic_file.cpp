#include "blockid/data/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "blockid/data/error.hpp"

namespace blockid {
namespace {

namespace fs = std::filesystem;

std::string reason(int code) { return std::generic_category().message(code); }

[[noreturn]] void fail_write(const fs::path& path, std::string_view step) {
  fail(path.string(), ": cannot write: ", step, ": ", reason(errno));
}

/// Closes the descriptor and removes the temporary file unless they were handed over.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& target) : target_(target) {
    static std::atomic<unsigned> serial{0};
    constexpr mode_t kBeforeUmask = 0666;
    for (int attempt = 0; attempt < 1000 && descriptor_ < 0; ++attempt) {
      path_ = target.parent_path() / compose(".", target.filename().string(), ".", ::getpid(), "-", serial++, ".tmp");
      descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kBeforeUmask);
      if (descriptor_ < 0 && errno != EEXIST) break;
    }
    if (descriptor_ < 0) fail_write(target_, "opening a temporary file beside it");
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!path_.empty()) ::unlink(path_.c_str());
  }

  [[nodiscard]] int descriptor() const { return descriptor_; }

  void close() {
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (::close(descriptor) != 0) fail_write(target_, "closing");
  }

  void rename_to_target() {
    if (::rename(path_.c_str(), target_.c_str()) != 0) fail_write(target_, "renaming the temporary file");
    path_.clear();
  }

 private:
  fs::path target_;
  fs::path path_;
  int descriptor_ = -1;
};

void write_all(int descriptor, std::string_view content, const fs::path& path) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail_write(path, "writing");
    content.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// The rename itself survives a power cut only when the folder is flushed; some file systems
/// refuse, which is no failure.
void flush_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

void write_directly(const fs::path& path, std::string_view content) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) fail_write(path, "opening");
  try {
    write_all(descriptor, content, path);
  } catch (...) {
    ::close(descriptor);
    throw;
  }
  if (::close(descriptor) != 0) fail_write(path, "closing");
}

/// Renaming over a symbolic link would replace the link instead of the file it names.
fs::path follow_links(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_symlink(path, ignored)) return path;
  std::error_code dangling;
  const fs::path target = fs::canonical(path, dangling);
  return dangling ? path : target;
}

}  // namespace

void write_file_atomically(const fs::path& path, std::string_view content) {
  const fs::path target = follow_links(path);
  struct stat status {};
  const bool exists = ::stat(target.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) fail(path.string(), ": cannot write: is a folder");
  if (exists && !S_ISREG(status.st_mode)) return write_directly(target, content);

  TemporaryFile temporary(target);
  if (exists && ::fchmod(temporary.descriptor(), status.st_mode & 07777) != 0) fail_write(path, "keeping permissions");
  write_all(temporary.descriptor(), content, path);
  if (::fsync(temporary.descriptor()) != 0) fail_write(path, "flushing");
  temporary.close();
  temporary.rename_to_target();
  flush_folder(target.parent_path());
}

std::string read_file(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) fail(path.string(), ": cannot read: no such file");
  if (fs::is_directory(status)) fail(path.string(), ": cannot read: is a folder");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(path.string(), ": cannot read: ", reason(errno));
  std::string content;
  if (fs::is_regular_file(status)) content.reserve(fs::file_size(path, code));
  constexpr std::size_t kChunk = 1 << 16;
  std::string chunk(kChunk, '\0');
  while (stream.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || stream.gcount() > 0) {
    content.append(chunk, 0, static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) fail(path.string(), ": cannot read: ", reason(errno));
  return content;
}

}  // namespace blockid
