// Change detection between sessions
#pragma once

#include <vector>

#include "unified_map.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// Compares every point with the latest earlier session and the next later one that observed its
/// position. A point has appeared if the earlier session observed free space there, and is gone if
/// the later one did. Free space is what the keyframes' images saw through; for keyframes without
/// images one is painted from their cells. Ground is left out, and so are specks. `voxels[i]` null:
/// not compared. Deterministic for any number of threads.
std::vector<ChangedPoint> find_changes(const std::vector<SessionData>& sessions,
                                       const std::vector<MergedSession>& merged,
                                       const std::vector<const SessionVoxels*>& voxels,
                                       const MergeConfig& config);

}  // namespace unimapper::merge
