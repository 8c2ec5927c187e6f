// What differs between sessions that saw the same place.
#pragma once

#include <vector>

#include "unified_map.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// Compares every session with the latest earlier one and the next later one that can judge a
/// place. A point has appeared if the earlier session saw free space there, and is gone if the
/// later one did; a session that did not look there says nothing. Ground is left out, and so are
/// specks. `voxels[i]` null: not compared. Deterministic for any number of threads.
std::vector<ChangedPoint> find_changes(const std::vector<SessionData>& sessions,
                                       const std::vector<MergedSession>& merged,
                                       const std::vector<const SessionVoxels*>& voxels,
                                       const MapConfig& config, unsigned threads);

}  // namespace unimapper::merge
