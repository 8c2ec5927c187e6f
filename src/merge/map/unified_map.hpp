// Unified voxel map of several sessions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "session_voxels.hpp"
#include "unimapper/merge/external_vector.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// Voxels of one session by the refined labels of its cells.
struct LabelledVoxels {
  SessionVoxels fixed;    ///< of static cells
  SessionVoxels dynamic;  ///< of what moved
};

/// Voxels of one session at its optimised poses, in `file` if there is one. Reads a few keyframes
/// at a time, on `threads` threads. O(cells).
LabelledVoxels voxelise(const SessionData& session, const MergedSession& merged, float size_m,
                        unsigned threads = 1, const std::shared_ptr<ScratchFile>& file = nullptr);

/// Unites sessions. `sessions[i]` null: not part of the map. Points come by tile, in a tile in the
/// order in which their voxels were first seen: by session, then by keyframe. In memory is one
/// tile, and the map if there is no file. Intensities are multiplied by their session's factor, if
/// there are any.
ExternalVector<MapPoint> unite(const std::vector<const SessionVoxels*>& sessions,
                               const std::shared_ptr<ScratchFile>& file = nullptr,
                               const std::vector<float>& intensity_factors = {});

}  // namespace unimapper::merge
