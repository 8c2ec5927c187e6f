#include "gravity_planes.hpp"

#include <cmath>

namespace unimapper::onboard {
namespace {

// A plane whose normal rises more than this is no wall, however the sensor is mounted.
constexpr float kMaxWallRise = 0.7F;
// Variance of a normal's direction per ratio of the plane's smallest and middle eigenvalue: as if
// some thirty cells lay on it.
constexpr float kVariancePerFlatness = 0.03F;
// Voxels along the edge of a patch: 8 m.
constexpr std::int32_t kPatchVoxels = 4;

void mark_moving(const CellTable& cells, CoarseVoxels& voxels) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    const std::uint64_t dynamic = cells.marks(b).dynamic;
    if (dynamic == 0) continue;
    std::uint64_t left = blocks[b].occupied;
    for (std::uint32_t row = blocks[b].first; left != 0; ++row, left &= left - 1) {
      if ((dynamic & lowest_bit(left)) == 0) continue;
      const std::uint32_t entry = voxels.of_row(row);
      if (entry != CoarseVoxels::kNone) voxels.map()[entry].moving = true;
    }
  }
}

bool is_wall(const CoarseVoxel& voxel) noexcept {
  return voxel.plane && !voxel.moving && std::abs(voxel.normal.z()) < kMaxWallRise;
}

/// One number for all voxels of a square of `kPatchVoxels`, whatever their height.
std::uint32_t patch_of(const VoxelIndex& voxel) noexcept {
  const auto x = static_cast<std::uint32_t>(floor_divide(voxel.x, kPatchVoxels));
  const auto y = static_cast<std::uint32_t>(floor_divide(voxel.y, kPatchVoxels));
  return (x & 15U) << 4U | (y & 15U);
}

}  // namespace

void GravityPlanes::allocate(Arena& arena) noexcept { walls_.allocate(arena, kMaxWalls); }

GravityScene GravityPlanes::collect(const CellTable& cells, CoarseVoxels& voxels) noexcept {
  mark_moving(cells, voxels);
  walls_.clear();
  GravityScene scene;
  std::uint32_t count = 0;
  for (const CoarseVoxel& voxel : voxels.map().values()) {
    count += is_wall(voxel) ? 1 : 0;
    if (voxel.ground && !voxel.moving) scene.ground += voxel.normal.cast<double>();
  }
  // Grows by the capacity with every wall; a wall enters when it passes the number of walls.
  std::uint32_t share = 0;
  for (std::uint32_t i = 0; i < voxels.map().size(); ++i) {
    const CoarseVoxel& voxel = voxels.map()[i];
    if (!is_wall(voxel)) continue;
    share += kMaxWalls;
    if (share < count) continue;
    share = count > kMaxWalls ? share - count : 0;
    walls_.push_back({voxel.normal, kVariancePerFlatness * voxel.flatness,
                      patch_of(unpack(voxels.map().key(i)))});
  }
  scene.walls = walls_.view();
  return scene;
}

}  // namespace unimapper::onboard
