// Child process without privileges or limits, so that refusals can be seen even where tests run as
// root.
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include "ports/linux/realtime.hpp"

namespace unimapper::test {

inline constexpr int kRefusedWell = 10;

/// Runs `check` in a child; `before` runs there with the rights of the tests. Returns the child's
/// exit code.
template <typename Check, typename Before>
int in_poor_child(Check check, Before before) {
  const pid_t child = fork();
  if (child == 0) {
    before();
    const rlimit none{0, 0};
    setrlimit(RLIMIT_MEMLOCK, &none);
    setrlimit(RLIMIT_RTPRIO, &none);
    constexpr uid_t kNobody = 65534;
    if (geteuid() == 0 && setuid(kNobody) != 0) _exit(1);
    _exit(check());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

template <typename Check>
int in_poor_child(Check check) {
  return in_poor_child(check, [] {});
}

inline int says(const linux_port::Outcome& outcome, const char* words) {
  const bool well = !outcome.ok && outcome.error_number != 0 &&
                    std::string(outcome.message).find(words) != std::string::npos;
  return well ? kRefusedWell : 0;
}

}  // namespace unimapper::test
