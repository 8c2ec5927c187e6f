// Cache of the voxels visited last, for loops over neighbouring points.
#pragma once

#include <cstdint>

#include "voxel_key.hpp"

namespace unimapper {

/// Caches the table entries of the eight voxels visited last, one for each combination of odd and
/// even indices: the voxels around a corner never push each other out. Spares the table most
/// look-ups when neighbouring points follow each other.
class RecentVoxels {
 public:
  /// The entry of a voxel; calls `look_up(key)` if it is not cached.
  /// Valid as long as the table only grows.
  template <typename LookUp>
  std::uint32_t entry(const VoxelIndex& index, const LookUp& look_up) noexcept {
    const auto corner =
        static_cast<std::uint32_t>((index.x & 1) | ((index.y & 1) << 1) | ((index.z & 1) << 2));
    Voxel& voxel = voxels_[corner];
    if (!voxel.known || !(voxel.index == index)) voxel = {index, look_up(pack(index)), true};
    return voxel.entry;
  }

 private:
  struct Voxel {
    VoxelIndex index;
    std::uint32_t entry = 0;
    bool known = false;
  };
  Voxel voxels_[8] = {};
};

}  // namespace unimapper
