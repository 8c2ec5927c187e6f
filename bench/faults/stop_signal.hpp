// Request to stop by SIGTERM, without a handler.
#pragma once

#include <csignal>

namespace unimapper::bench {

/// Keeps SIGTERM waiting, in this thread and those it starts: a handler would interrupt LCM's
/// waiting, which passes for an error.
inline void hold_stop_signal() {
  sigset_t term;
  sigemptyset(&term);
  sigaddset(&term, SIGTERM);
  sigprocmask(SIG_BLOCK, &term, nullptr);
}

/// Whether SIGTERM has come since.
inline bool stop_requested() {
  sigset_t pending;
  sigemptyset(&pending);
  sigpending(&pending);
  return sigismember(&pending, SIGTERM) == 1;
}

}  // namespace unimapper::bench
