// Session identifier.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

namespace unimapper {

/// Number of one start of a robot, 128 bits. Drawn at random at a live start
/// (`linux_port::random_boot`), no other start of any robot has it: with the keyframe's `sequence`
/// it names a keyframe for ever.
struct BootId {
  std::uint64_t high = 0;  ///< upper half; 0 in recordings of senders that knew 64 bits
  std::uint64_t low = 0;   ///< lower half

  constexpr BootId() noexcept = default;
  /// From both halves.
  constexpr BootId(std::uint64_t upper, std::uint64_t lower) noexcept : high(upper), low(lower) {}
  /// From a number of 64 bits, as older senders chose it.
  constexpr BootId(std::uint64_t number) noexcept : low(number) {}

  friend constexpr auto operator<=>(const BootId&, const BootId&) = default;
};

/// Identity of one start of a robot, as on the wire: the same numbers travel in every message.
/// Within a program `KeyframeId` names sessions by their index.
struct SessionId {
  std::uint32_t robot = 0;  ///< number of the robot
  BootId boot;              ///< differs for every start of a robot
  friend auto operator<=>(const SessionId&, const SessionId&) = default;
};

/// Sent once (and repeated) per session.
struct SessionInfo {
  SessionId id;        ///< identity of the session
  std::string name;    ///< file-name safe; names the trajectory
  std::string sensor;  ///< canonical sensor name, see `find_sensor`
};

}  // namespace unimapper
