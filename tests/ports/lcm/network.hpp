// Network within the process between publishers and a base.
#pragma once

#include <condition_variable>

#include "ports/lcm/publisher.hpp"
#include "ports/lcm/received_log.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"

namespace unimapper::lcm_port::lcm_test {

inline const SessionInfo kMonday{{1, {3, 11}}, "monday", "os2-128"};
inline const SessionInfo kTuesday{{1, {3, 12}}, "tuesday", "os2-128"};

inline EncodedKeyframe keyframe(const SessionInfo& info, std::uint32_t sequence,
                                std::uint32_t cells = 300) {
  return wire::wire_test::encode_for_sending(
      wire::wire_test::keyframe_of(info.id, sequence, cells));
}

/// Hands `count` keyframes of a session to a `Publisher` or what else publishes.
template <typename Publishing>
void publish(Publishing& publisher, const SessionInfo& info, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) publisher.publish(keyframe(info, i));
}

/// What a network does to datagrams.
struct NetworkState {
  bool reached = true;             ///< whether the base is on the network
  std::uint32_t loss_percent = 0;  ///< in both directions
  int ends_lost = 0;               ///< of the announcements of an end, the first so many
  bool held = false;               ///< keyframes are, before they are taken
};

/// A network and the base behind it. It outlives its links. While a publisher is alive, `mutex`
/// guards all members.
struct Network : NetworkState {
  explicit Network(const NetworkState& state = {}) : NetworkState(state) {}

  std::uint64_t datagrams = 0;  ///< taken
  std::uint64_t pieces = 0;     ///< of keyframes, taken
  int ends = 0;                 ///< announced
  std::size_t largest = 0;      ///< bytes of the largest datagram, with LCM's header
  Receiver receiver;
  std::vector<ReceivedMapPose> map_poses;  ///< that the base says next
  wire::wire_test::Random random{5};
  std::mutex mutex;
  std::condition_variable released;

  Link link() {
    Link link;
    link.send = [this](std::string_view channel, Bytes message) {
      std::unique_lock lock(mutex);
      released.wait(lock, [&] { return !held || channel != kKeyframeChannel; });
      ++datagrams;
      pieces += channel == kKeyframeChannel ? 1 : 0;
      // LCM's header: magic, sequence number, channel and a zero.
      largest = std::max(largest, 8 + channel.size() + 1 + message.size());
      const bool is_end = channel == kSessionChannel &&
                          decode_session(message).value().state == SessionState::kEnded;
      if (is_end && ++ends <= ends_lost) return true;
      if (reached && !is_lost()) receive(receiver, channel, message);
      return true;
    };
    link.receive = [this] {
      const std::lock_guard lock(mutex);
      auto messages = reached ? receiver.take_stored() : std::vector<StoredMessage>();
      std::erase_if(messages, [this](const auto&) { return is_lost(); });
      return messages;
    };
    link.map_poses = [this] {
      const std::lock_guard lock(mutex);
      return std::exchange(map_poses, {});
    };
    return link;
  }
  void reach() {
    const std::lock_guard lock(mutex);
    reached = true;
  }
  void release() {
    const std::lock_guard lock(mutex);
    held = false;
    released.notify_all();
  }
  /// Tells of a place in the map, or something malformed.
  void say(const ReceivedMapPose& message) {
    const std::lock_guard lock(mutex);
    map_poses.push_back(message);
  }
  std::vector<SessionData> sessions() {
    const std::lock_guard lock(mutex);
    return receiver.take_sessions();
  }

 private:
  bool is_lost() { return loss_percent > 0 && random.below(100) < loss_percent; }
};

}  // namespace unimapper::lcm_port::lcm_test
