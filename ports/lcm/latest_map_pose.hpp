// Latest word of a base on a robot's place in its map.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::lcm_port {

/// What arrived on the channel of map poses: a message, or nothing where it was none.
using ReceivedMapPose = std::optional<wire::MapPoseMessage>;

/// A base's word, and when it came.
struct HeardMapPose {
  wire::MapPoseMessage message;                   ///< what it says
  std::chrono::steady_clock::time_point arrival;  ///< when it was last said
};

/// What became of the messages on the channel of map poses.
struct MapPoseCounters {
  std::uint64_t taken = 0;      ///< of this session, and no older than the one before
  std::uint64_t of_others = 0;  ///< of other sessions: all robots of a network hear all of them
  std::uint64_t outdated = 0;   ///< of an earlier epoch, or of an earlier keyframe of the same
  std::uint64_t malformed = 0;  ///< not decodable, or with impossible values
};

/// Keeps the newest of the messages that are about one session, in whatever order they arrive. Not
/// thread safe.
class LatestMapPose {
 public:
  explicit LatestMapPose(const SessionId& session) : session_(session) {}

  /// Takes what arrived at that time; a repetition renews the time. O(1).
  void take(const ReceivedMapPose& received, std::chrono::steady_clock::time_point arrival);

  /// The newest, if there is one.
  [[nodiscard]] const std::optional<HeardMapPose>& latest() const { return latest_; }
  /// Totals so far.
  [[nodiscard]] const MapPoseCounters& counters() const { return counters_; }

 private:
  SessionId session_;
  std::optional<HeardMapPose> latest_;
  MapPoseCounters counters_;
};

}  // namespace unimapper::lcm_port
