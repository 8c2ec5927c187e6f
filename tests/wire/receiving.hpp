// Two sessions and what is said of them, for tests of receivers.
#pragma once

#include <type_traits>

#include "tests/test.hpp"
#include "tests/wire/stream.hpp"

namespace unimapper::wire::wire_test {

inline const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
inline const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};

/// The usual limits but for one.
template <typename T>
ReceiverLimits limited(T ReceiverLimits::*limit, std::type_identity_t<T> value) {
  ReceiverLimits limits;
  limits.*limit = value;
  return limits;
}

/// Pieces of a keyframe without its last one.
inline std::vector<Message> all_but_last_piece(const KeyframeRecord& record) {
  std::vector<Message> most = pieces(record);
  most.pop_back();
  return most;
}

/// Feeds what the robot of `kAlpha` says of its session.
inline void say(Receiver& receiver, SessionState state, std::uint64_t keyframes,
                std::uint64_t dropped = 0) {
  feed(receiver, session_message(kAlpha, state, keyframes, dropped));
}

/// The only session.
inline SessionData take_session(Receiver& receiver) {
  std::vector<SessionData> sessions = receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  return std::move(sessions.front());
}

}  // namespace unimapper::wire::wire_test
