// Change detection between sessions
#pragma once

#include <vector>

#include "unified_map.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// What differs between sessions.
struct Changes {
  std::vector<ChangedPoint> points;    ///< by region of the map, session, appeared before gone
  std::vector<ChangedObject> objects;  ///< in the order of their first point, or before
};

/// Voxels of all sessions that are compared at a time. An object that reaches
/// more than a tile beyond where the map is divided for it may be found as two.
inline constexpr std::size_t kMostComparedVoxels = 6'000'000;

/// Compares every point with the latest earlier session and the next later one that observed its
/// position. A point has appeared if the earlier session observed free space there, and is gone if
/// the later one did; what a session saw through itself, such as leaves, proves nothing. Points
/// that changed together are an object; others are left out, and so is ground. `voxels[i]` null:
/// not compared. Deterministic for any number of threads.
Changes find_changes(const std::vector<SessionData>& sessions,
                     const std::vector<MergedSession>& merged,
                     const std::vector<const SessionVoxels*>& voxels, const MergeConfig& config,
                     std::size_t most_voxels = kMostComparedVoxels);

}  // namespace unimapper::merge
