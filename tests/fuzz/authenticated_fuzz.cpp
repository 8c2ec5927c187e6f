// Fuzz target of authenticated datagrams: whatever a forger makes of those that it overheard, a
// base takes nothing but the datagrams of the robot, each once, and a victim's keyframe arrives.
//
// The input is a list of changes: which overheard datagram to start from, where to write, what, how
// much to cut, and on which channel to send it.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "ports/keys/guards.hpp"
#include "ports/lcm/messages.hpp"
#include "ports/lcm/received_log.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace unimapper;
using fuzz::require;
using Data = std::vector<std::uint8_t>;

constexpr std::size_t kDatagrams = 4;
/// More in one input find nothing that fewer do not, only slower.
constexpr int kMostForged = 32;
constexpr std::array<std::string_view, 7> kChannels = {
    lcm_port::kSessionChannel, lcm_port::kKeyframeChannel, lcm_port::kHealthChannel,
    lcm_port::kStoredChannel,  lcm_port::kProbeChannel,    lcm_port::kReceiptChannel,
    lcm_port::kMapPoseChannel};

const keys::RobotKey& robot_key() {
  static const keys::RobotKey key = keys::new_robot_key("robot");
  return key;
}

/// What a forger overheard: sessions' messages of the robot, under their numbers.
Data message(std::uint64_t keyframes) {
  const SessionInfo info{{robot_key().robot, {1, 2}}, "robot", "vlp-16"};
  return lcm_port::encode(wire::SessionMessage{info, wire::SessionState::kRunning, keyframes, 0});
}

/// One datagram made of the overheard ones as the input says; moves on in the input.
Data forge(const std::vector<Data>& overheard, const std::uint8_t* data, std::size_t size,
           std::size_t& at) {
  Data forged = overheard[data[at] % overheard.size()];
  const std::size_t cut = data[at + 1];
  const std::size_t where = data[at + 2] % forged.size();
  const std::size_t length = std::min<std::size_t>(data[at + 3] % 64, size - at - 5);
  for (std::size_t i = 0; i < length && where + i < forged.size(); ++i) {
    forged[where + i] = data[at + 5 + i];
  }
  if (cut < 32) forged.resize(forged.size() - std::min(cut, forged.size()));
  at += 5 + length;
  return forged;
}

/// The robot's first datagrams.
std::vector<Data> seal_messages() {
  keys::RobotGuard robot(robot_key(), {1, 2});
  std::vector<Data> sealed;
  for (std::uint64_t i = 0; i < kDatagrams; ++i) {
    sealed.push_back(robot.seal(lcm_port::kSessionChannel, message(i)).value());
  }
  return sealed;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const keys::BaseKey base_key = keys::base_key_of(robot_key());
  static const std::vector<Data> overheard = seal_messages();
  keys::BaseGuard base(std::vector{base_key}, {3, 4});
  // Takes nothing, so that it stays as it is.
  static keys::RobotGuard listener(robot_key(), {5, 6});
  std::array<int, kDatagrams> taken = {};
  std::size_t at = 0;
  for (int i = 0; i < kMostForged && at + 5 <= size; ++i) {
    const std::string_view channel = kChannels[data[at + 4] % kChannels.size()];
    const Data forged = forge(overheard, data, size, at);
    require(!listener.open(channel, forged));
    if (!base.open(channel, forged)) continue;
    // Only an unchanged datagram on its own channel is let in.
    const auto real = std::find(overheard.begin(), overheard.end(), forged);
    require(real != overheard.end() && channel == lcm_port::kSessionChannel);
    require(++taken[static_cast<std::size_t>(real - overheard.begin())] == 1);
  }
  // What was not let in yet still is.
  for (std::size_t i = 0; i < kDatagrams; ++i) {
    require(base.open(lcm_port::kSessionChannel, overheard[i]).has_value() == (taken[i] == 0));
  }
  return 0;
}
