// Ctrl-C asks for the best result so far.
#pragma once

#include <csignal>

namespace blockid::cli {

/// While it lives, the first SIGINT only makes interrupted() true; the second one ends the program as usual. A SIGINT
/// that was ignored before (a job in the background) stays ignored.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  struct sigaction before_ = {};
};

/// Whether SIGINT has come since the InterruptGuard was made.
bool interrupted();

}  // namespace blockid::cli
