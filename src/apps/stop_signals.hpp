// Signals that end a long-running command.
#pragma once

#include <signal.h>  // NOLINT: sigtimedwait is POSIX

namespace unimapper::apps {

/// SIGINT and SIGTERM, asked for instead of handled: a handler would interrupt what waits.
class StopSignals {
 public:
  /// Before other threads exist, which block them too.
  StopSignals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals_, signal);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }
  /// Whether one has arrived.
  [[nodiscard]] bool arrived() {
    const timespec at_once{};
    arrived_ = arrived_ || sigtimedwait(&signals_, nullptr, &at_once) > 0;
    return arrived_;
  }
  /// Waits for one.
  void wait() {
    int signal = 0;
    if (!arrived_) sigwait(&signals_, &signal);
    arrived_ = true;
  }

 private:
  sigset_t signals_{};
  bool arrived_ = false;
};

}  // namespace unimapper::apps
