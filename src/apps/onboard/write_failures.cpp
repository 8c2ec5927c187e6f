#include "src/apps/onboard/write_failures.hpp"

#include <cstdio>
#include <stdexcept>

#include "src/apps/print.hpp"

namespace unimapper::apps {

bool WriteFailures::attempt(const std::function<void()>& write) {
  try {
    write();
  } catch (const std::runtime_error& error) {
    const std::lock_guard lock(mutex_);
    ++count_;
    if (!failing_) {
      print_to(stderr, "onboard: warning: {}; mapping and delivery go on\n", error.what());
    }
    failing_ = true;
    return false;
  }
  const std::lock_guard lock(mutex_);
  if (failing_) print_to(stderr, "onboard: the run folder can be written again\n");
  failing_ = false;
  return true;
}

std::uint64_t WriteFailures::count() const {
  const std::lock_guard lock(mutex_);
  return count_;
}

}  // namespace unimapper::apps
