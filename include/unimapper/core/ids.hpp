// Identities of sessions and keyframes.
#pragma once

#include <cassert>
#include <compare>
#include <concepts>
#include <cstdint>
#include <string>
#include <utility>

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

/// One keyframe among those of several sessions. `session` is the session's index in the list the
/// caller gave (the merger: its vector of sessions), or any number by which the caller tells the
/// sessions of a `PlaceDatabase` apart. `keyframe` counts within the session: on the robot and in
/// loops.csv it is `KeyframeRecord::sequence`, in the merger the index in `SessionData::keyframes`,
/// which differs from it where keyframes were lost. (A `SessionId` identifies a session on the wire
/// and for good; this is its short form within one program.)
struct KeyframeId {
  std::uint32_t session = 0;   ///< index of the session
  std::uint32_t keyframe = 0;  ///< number within the session

  constexpr KeyframeId() noexcept = default;
  /// From indices of any width; they must fit into 32 bits.
  template <std::integral Session, std::integral Keyframe>
  constexpr KeyframeId(Session session_index, Keyframe keyframe_index) noexcept
      : session(static_cast<std::uint32_t>(session_index)),
        keyframe(static_cast<std::uint32_t>(keyframe_index)) {
    assert(std::in_range<std::uint32_t>(session_index));
    assert(std::in_range<std::uint32_t>(keyframe_index));
  }

  friend constexpr auto operator<=>(const KeyframeId&, const KeyframeId&) = default;
};

}  // namespace unimapper
