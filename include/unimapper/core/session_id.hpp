// Session identifier.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

namespace unimapper {

/// Identity of one start of a robot, as on the wire: the same two numbers travel in every message.
/// Within a program `KeyframeId` names sessions by their index.
struct SessionId {
  std::uint32_t robot = 0;    ///< number of the robot
  std::uint64_t session = 0;  ///< differs for every start of a robot
  friend auto operator<=>(const SessionId&, const SessionId&) = default;
};

/// Sent once (and repeated) per session.
struct SessionInfo {
  SessionId id;        ///< identity of the session
  std::string name;    ///< file-name safe; names the trajectory
  std::string sensor;  ///< canonical sensor name, see `find_sensor`
};

}  // namespace unimapper
