// Default edge lengths of the fine and the coarse grid.
#pragma once

namespace unimapper {

/// L_f, edge of a fine cell, metres. Where a robot's `VoxelConfig::fine_size_m` is
/// another one, the base needs it as `merge::RefinementConfig::cell_size_m`.
inline constexpr float kFineCellSizeM = 0.2F;

/// L_c, edge of a coarse voxel, metres; planes are fitted in it on the robot and at the base.
inline constexpr float kCoarseVoxelSizeM = 2.0F;

}  // namespace unimapper
