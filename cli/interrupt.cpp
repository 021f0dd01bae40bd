#include <blockid/cli/interrupt.hpp>

namespace blockid::cli {
namespace {

// A signal handler can reach nothing but a global.
volatile std::sig_atomic_t signalled = 0;

void on_interrupt(int) { signalled = 1; }

}  // namespace

InterruptGuard::InterruptGuard() {
  signalled = 0;
  struct sigaction action = {};
  action.sa_handler = on_interrupt;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, nullptr, &before_);
  if (before_.sa_handler != SIG_IGN) sigaction(SIGINT, &action, nullptr);
}

InterruptGuard::~InterruptGuard() { sigaction(SIGINT, &before_, nullptr); }

bool interrupted() { return signalled != 0; }

}  // namespace blockid::cli
