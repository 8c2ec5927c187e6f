// Changes of sessions between two looks at them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// What became of one session.
struct SessionChange {
  std::size_t session = 0;           ///< its index
  std::size_t first = 0;             ///< keyframes before this one are as they were
  std::vector<std::size_t> fresh;    ///< that are new or changed, ascending
  std::vector<std::uint32_t> stale;  ///< sequences of those that were otherwise, or are gone
};

/// Remembers what sessions looked like, by pose, level and completeness of their keyframes.
class SessionGrowth {
 public:
  /// What has changed since the look before, by session; sessions come last when they come.
  /// O(keyframes).
  std::vector<SessionChange> look(const std::vector<SessionData>& sessions);

 private:
  struct Seen {
    std::uint32_t sequence = 0;
    bool is_summary = false;
    Pose T_odometry_keyframe;
  };
  std::vector<std::vector<Seen>> seen_;  ///< by session, by keyframe
};

}  // namespace unimapper::merge
