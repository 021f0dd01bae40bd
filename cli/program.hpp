// The program `blockid`: command line in, exit code out.
#pragma once

namespace blockid::cli {

/// Reads the command line, runs the command, turns exceptions into messages on stderr and exit codes (exit_codes.hpp).
int run_program(int argc, const char* const* argv);

}  // namespace blockid::cli
