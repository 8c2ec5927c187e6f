// Walls and ground of a keyframe, for the gravity estimator
#pragma once

#include "gravity.hpp"
#include "src/core/fixed_vector.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/keyframe/coarse_voxels.hpp"
#include "unimapper/core/arena.hpp"

namespace unimapper::onboard {

/// Picks what is upright, and the ground, from the planar coarse voxels. Voxels that hold a dynamic
/// cell are left out: the sides of vehicles are not plumb.
class GravityPlanes {
 public:
  /// Walls handed over at most; of more, an even sample.
  static constexpr std::uint32_t kMaxWalls = 1024;

  void allocate(Arena& arena) noexcept;

  /// Cells are labelled. The view stays valid until the next call. O(voxels + cells of blocks with
  /// dynamic ones).
  [[nodiscard]] GravityScene collect(const CellTable& cells, CoarseVoxels& voxels) noexcept;

 private:
  FixedVector<WallPlane> walls_;
};

}  // namespace unimapper::onboard
