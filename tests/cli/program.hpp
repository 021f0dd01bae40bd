// Runs the built program and looks at what it leaves.
#pragma once

#include <nlohmann/json.hpp>

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace blockid::testing {

/// What a run of the program left behind.
struct ProgramRun {
  /// Exit code; 128 + the signal when one ended it.
  int code = -1;
  std::string out;
  std::string err;
};

/// The program with these arguments, started in `folder`. environment: "NAME=value", replacing what is inherited.
class RunningProgram {
 public:
  RunningProgram(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                 const std::vector<std::string>& environment = {});
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;
  ~RunningProgram();

  /// Waits until it has written to stderr; false when it ends before or `seconds` pass.
  bool wait_for_message(double seconds) const;
  void send(int signal) const;
  ProgramRun wait();

 private:
  std::filesystem::path out_;
  std::filesystem::path err_;
  pid_t child_ = 0;
};

ProgramRun run_program(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                       const std::vector<std::string>& environment = {});

/// The JSON file.
nlohmann::json json_file(const std::filesystem::path& path);

/// A record of the synthetic Wiener-Hammerstein problem as CSV with the columns "u" and "y", 1 kHz. Returns the
/// standard deviation of its noise.
double write_synthetic_csv(const std::filesystem::path& path, long samples);

/// The chain of that problem.
inline constexpr const char* kSyntheticChain =
    "G1=rational(nb=3,na=3) | f=polynomial(degree=5) | G2=rational(nb=3,na=3)";

/// How often `part` occurs in `text`.
int occurrences(const std::string& text, const std::string& part);

}  // namespace blockid::testing
