#include <blockid/validation/isolated_call.hpp>

#include <blockid/data/error.hpp>

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

namespace blockid {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPipe = 3;  // after the standard streams

/// A folder of its own that goes when this goes.
class ScratchFolder {
 public:
  ScratchFolder() : path_((std::filesystem::temp_directory_path() / "blockid_XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) fail("isolated call: no scratch folder ", path_, ": ", std::strerror(errno));
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Runs first among the exit handlers that the child inherits, and lets none of the others.
void leave() { _exit(EXIT_FAILURE); }

void write_all(int file, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(file, at, size);
    if (written <= 0) _exit(EXIT_FAILURE);
    at += written;
    size -= static_cast<std::size_t>(written);
  }
}

[[noreturn]] void be_the_child(const std::function<std::vector<double>()>& call, const std::string& folder,
                               int answer) {
  if (std::atexit(leave) != 0 || chdir(folder.c_str()) != 0) _exit(EXIT_FAILURE);
  const rlimit none{0, 0};
  const int null = open("/dev/null", O_RDWR);
  if (null < 0 || setrlimit(RLIMIT_CORE, &none) != 0) _exit(EXIT_FAILURE);
  // The pipe may sit where another stream has to go: it moves above all of them first.
  const int moved = fcntl(answer, F_DUPFD, kPipe + 1);
  for (int stream = 0; stream < kPipe; ++stream) dup2(null, stream);
  if (moved < 0 || dup2(moved, kPipe) < 0 || close_range(kPipe + 1, ~0U, 0) != 0) _exit(EXIT_FAILURE);
  try {
    const std::vector<double> numbers = call();
    write_all(kPipe, numbers.data(), numbers.size() * sizeof(double));
  } catch (...) {  // nothing may unwind into what the parent was about to do
    _exit(EXIT_FAILURE);
  }
  _exit(EXIT_SUCCESS);
}

/// Reads to the end of the pipe. False when the time is over before.
bool read_until(int file, Clock::time_point end, std::string& bytes) {
  std::array<char, 4096> buffer{};
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return false;
    pollfd ready{file, POLLIN, 0};
    // At most a minute at once: poll takes an int.
    const int count = poll(&ready, 1, static_cast<int>(std::min<long>(left, 60'000)));
    if (count < 0 && errno != EINTR) return true;
    if (count <= 0) continue;
    const ssize_t got = read(file, buffer.data(), buffer.size());
    if (got <= 0) return true;
    bytes.append(buffer.data(), static_cast<std::size_t>(got));
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

std::vector<double> call_isolated(const std::function<std::vector<double>()>& call, double time_limit_s) {
  if (!(time_limit_s > 0.0)) fail("isolated call: expected a time limit above 0 s, got ", time_limit_s);
  const ScratchFolder folder;
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) fail("isolated call: no pipe: ", std::strerror(errno));
  const pid_t child = fork();
  if (child == 0) be_the_child(call, folder.path(), ends[1]);
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    fail("isolated call: no process: ", std::strerror(errno));
  }
  std::string bytes;
  // A century at most: the clock counts in 64 bits.
  const std::chrono::duration<double> limit(std::min(time_limit_s, 3e9));
  const bool in_time = read_until(ends[0], Clock::now() + std::chrono::duration_cast<Clock::duration>(limit), bytes);
  close(ends[0]);
  if (!in_time) kill(child, SIGKILL);
  const int status = wait_for(child);
  if (!in_time) fail("isolated call: no answer within ", time_limit_s, " s");
  if (WIFSIGNALED(status)) fail("isolated call: the child was ended by signal ", WTERMSIG(status));
  if (WEXITSTATUS(status) != EXIT_SUCCESS) fail("isolated call: the child ended without an answer");
  std::vector<double> numbers(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
  return numbers;
}

}  // namespace blockid
