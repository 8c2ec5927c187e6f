// Base on a network that works or does not.
#pragma once

#include <mutex>
#include <string_view>
#include <utility>
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
    lcm_port::Link link{[this](std::string_view channel, wire::Bytes message) {
                          const std::lock_guard lock(mutex_);
                          if (reached_) lcm_port::receive(receiver_, channel, message);
                          return true;
                        },
                        [this] {
                          const std::lock_guard lock(mutex_);
                          return reached_ ? receiver_.take_stored()
                                          : std::vector<wire::StoredMessage>();
                        }};
    link.map_poses = [this] {
      const std::lock_guard lock(mutex_);
      return std::exchange(map_poses_, {});
    };
    return link;
  }
  /// From now on the network works.
  void reach() {
    const std::lock_guard lock(mutex_);
    reached_ = true;
  }
  /// Says where a robot is in its map.
  void say(const wire::MapPoseMessage& message) {
    const std::lock_guard lock(mutex_);
    map_poses_.emplace_back(message);
  }
  std::vector<SessionData> sessions() {
    const std::lock_guard lock(mutex_);
    return receiver_.take_sessions();
  }

 private:
  std::mutex mutex_;
  wire::Receiver receiver_;
  std::vector<lcm_port::ReceivedMapPose> map_poses_;
  bool reached_ = false;
};

}  // namespace unimapper::delivery::delivery_test
