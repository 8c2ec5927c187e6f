// Identity of a keyframe.
#pragma once

#include <cassert>
#include <compare>
#include <concepts>
#include <cstdint>
#include <utility>

namespace unimapper {

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
