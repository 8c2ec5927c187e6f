// Base on a network that works or does not.
#pragma once

#include <mutex>
#include <string_view>
#include <vector>

#include "ports/lcm/publisher.hpp"
#include "ports/lcm/received_log.hpp"
#include "tests/wire/stream.hpp"

namespace unimapper::delivery::delivery_test {

/// Receives in memory. Thread safe.
class Base {
 public:
  /// The robot's end of the network; the base outlives it.
  lcm_port::Link link() {
    return {[this](std::string_view channel, wire::Bytes message) {
              const std::lock_guard lock(mutex_);
              if (reached_) lcm_port::receive(receiver_, channel, message);
              return true;
            },
            [this] {
              const std::lock_guard lock(mutex_);
              return reached_ ? receiver_.take_stored() : std::vector<wire::StoredMessage>();
            }};
  }
  /// From now on the network works.
  void reach() {
    const std::lock_guard lock(mutex_);
    reached_ = true;
  }
  std::vector<SessionData> sessions() {
    const std::lock_guard lock(mutex_);
    return receiver_.take_sessions();
  }

 private:
  std::mutex mutex_;
  wire::Receiver receiver_;
  bool reached_ = false;
};

}  // namespace unimapper::delivery::delivery_test
