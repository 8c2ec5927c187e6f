// Partition of a map into regions of limited size.
#pragma once

#include <cstddef>
#include <vector>

#include "map_tile.hpp"
#include "session_voxels.hpp"

namespace unimapper::merge {

/// Boxes of tiles that do not overlap and together are the whole plane; in each are at most `most`
/// voxels of all sessions, unless it is a single tile with voxels. One box where that is enough.
/// `sessions[i]` null: left out.
[[nodiscard]] std::vector<TileBox> map_regions(const std::vector<const SessionVoxels*>& sessions,
                                               std::size_t most);

}  // namespace unimapper::merge
