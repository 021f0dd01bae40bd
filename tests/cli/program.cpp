#include "cli/program.hpp"

#include <blockid/data/atomic_file.hpp>
#include <blockid/data/csv.hpp>
#include <blockid/problems/synthetic_wh.hpp>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <stdexcept>
#include <thread>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace blockid::testing {
namespace {

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (std::string& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

std::vector<std::string> merged_environment(const std::vector<std::string>& changes) {
  std::vector<std::string> result = changes;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string inherited = *entry;
    const std::string name = inherited.substr(0, inherited.find('=') + 1);
    const bool replaced = std::any_of(changes.begin(), changes.end(),
                                      [&](const std::string& change) { return change.rfind(name, 0) == 0; });
    if (!replaced) result.push_back(inherited);
  }
  return result;
}

}  // namespace

RunningProgram::RunningProgram(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                               const std::vector<std::string>& environment)
    : out_(folder / ".stdout"), err_(folder / ".stderr") {
  std::vector<std::string> command = {BLOCKID_PROGRAM};
  command.insert(command.end(), arguments.begin(), arguments.end());
  std::vector<std::string> variables = merged_environment(environment);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC;
  constexpr mode_t kMode = 0600;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out_.c_str(), kFlags, kMode);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err_.c_str(), kFlags, kMode);
  // A test in the background may have inherited an ignored SIGINT.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t defaults;
  sigemptyset(&defaults);
  sigaddset(&defaults, SIGINT);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  const int failed = ::posix_spawn(&child_, BLOCKID_PROGRAM, &actions, &attributes, pointers(command).data(),
                                   pointers(variables).data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (failed != 0) throw std::runtime_error("cannot start " BLOCKID_PROGRAM);
}

RunningProgram::~RunningProgram() {
  if (child_ == 0) return;
  ::kill(child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
}

bool RunningProgram::wait_for_message(double seconds) const {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    std::error_code ignored;
    if (std::filesystem::file_size(err_, ignored) > 0 && !ignored) return true;
    siginfo_t info = {};
    if (::waitid(P_PID, static_cast<id_t>(child_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

void RunningProgram::send(int signal) const { ::kill(child_, signal); }

ProgramRun RunningProgram::wait() {
  int status = 0;
  ::waitpid(child_, &status, 0);
  child_ = 0;
  constexpr int kSignalled = 128;
  ProgramRun run;
  run.code = WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
  run.out = read_file(out_);
  run.err = read_file(err_);
  return run;
}

ProgramRun run_program(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                       const std::vector<std::string>& environment) {
  return RunningProgram(arguments, folder, environment).wait();
}

nlohmann::json json_file(const std::filesystem::path& path) { return nlohmann::json::parse(read_file(path)); }

double write_synthetic_csv(const std::filesystem::path& path, long samples) {
  const problems::Problem problem =
      problems::synthetic_wiener_hammerstein({.train_samples = samples, .test_samples = 1});
  const Record& record = problem.train.records.front();
  Table table;
  table.has_header = true;
  table.names = {"u", "y"};
  table.values.resize(record.u.size(), 2);
  table.values << record.u, record.y;
  write_csv(path, table);
  return problem.noise_std;
}

int occurrences(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

}  // namespace blockid::testing
