// Unified voxel map of several sessions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "unimapper/merge/merger.hpp"
#include "voxel_table.hpp"

namespace unimapper::merge {

/// One session's static points, one mean per voxel of the map frame's grid.
struct SessionVoxels {
  struct Voxel {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();  ///< of positions relative to the voxel's corner
    std::uint32_t cells = 0;
    std::uint32_t ground = 0;
  };
  VoxelTable table;
  std::vector<Voxel> voxels;
  float size_m = 0.0F;

  [[nodiscard]] Eigen::Vector3f position(std::uint32_t number) const;
};

/// Label of a cell after refinement.
enum class CellKind : std::uint8_t { kStatic, kDynamic };

/// Voxels of one session at its optimised poses.
SessionVoxels voxelise(const SessionData& session, const MergedSession& merged, float size_m,
                       CellKind kind);

/// Unites sessions. `sessions[i]` null: not part of the map. Points come in the order in which
/// their voxels were first seen: by session, then by keyframe.
std::vector<MapPoint> unite(const std::vector<const SessionVoxels*>& sessions);

}  // namespace unimapper::merge
