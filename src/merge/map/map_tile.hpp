// Tiles of a voxel map.
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>

#include "src/core/voxel_key.hpp"

namespace unimapper::merge {

/// Edge of a tile in voxels: 51 m where voxels have 0.2 m.
inline constexpr std::int32_t kTileVoxels = 256;

/// A square of the map's horizontal plane with everything above and below it.
struct MapTile {
  std::int32_t y = 0;
  std::int32_t x = 0;
  friend auto operator<=>(const MapTile&, const MapTile&) = default;
};

/// The tile of a voxel.
[[nodiscard]] inline MapTile tile_of(const VoxelIndex& voxel) {
  static_assert(kTileVoxels == 1 << 8, "shifts divide, rounding down");
  return {voxel.y >> 8, voxel.x >> 8};
}

/// A rectangle of tiles, both corners included.
struct TileBox {
  static constexpr std::int32_t kFar = std::int32_t{1} << 24U;  ///< beyond all voxels
  MapTile low{-kFar, -kFar};
  MapTile high{kFar, kFar};

  [[nodiscard]] bool contains(const MapTile& tile) const {
    return low.x <= tile.x && tile.x <= high.x && low.y <= tile.y && tile.y <= high.y;
  }
  /// The box with the tiles around it.
  [[nodiscard]] TileBox grown() const { return {{low.y - 1, low.x - 1}, {high.y + 1, high.x + 1}}; }
};

}  // namespace unimapper::merge
