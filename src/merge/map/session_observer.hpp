// Presence of structure at points as one session observed it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "near_points.hpp"
#include "session_voxels.hpp"
#include "src/merge/sessions/keyframe_free_space.hpp"
#include "unimapper/merge/merger.hpp"
#include "voxel_trees.hpp"

namespace unimapper::merge {

/// What a session knows of a point.
enum class Presence : std::uint8_t { kUnknown, kOccupied, kFree };

/// Keyframes that observed a point as free, and as occupied.
struct Votes {
  std::uint32_t free = 0;
  std::uint32_t occupied = 0;
};

/// Positions of those voxels of a session in some tiles that are not ground, for
/// `SessionObserver::observe`.
[[nodiscard]] VoxelTrees structure_trees(const SessionVoxels& voxels, const TileBox& tiles);

/// One session as an observer of points of the map: its own static points, and its keyframes' free
/// space, which is what their images saw through; for keyframes without images one is painted from
/// their cells. Deterministic for any number of threads.
class SessionObserver {
 public:
  /// All of them must outlive it.
  SessionObserver(const SessionData& session, const MergedSession& merged,
                  const MergeConfig& config);

  /// Whether the session had something at each point, map frame: occupied where it has a point that
  /// is not ground within `map.change_distance_m`, else free where at least two
  /// keyframes, and more than twice as many as observed a surface, saw through it. `structure`: its
  /// `structure_trees`. O(points x images within reach).
  [[nodiscard]] std::vector<Presence> observe(const std::vector<Eigen::Vector3f>& points,
                                              const VoxelTrees& structure) const;

  /// What the session's keyframes within `reach_m` observed of each point, map frame. O(points x
  /// images within reach).
  [[nodiscard]] std::vector<Votes> vote(const std::vector<Eigen::Vector3f>& points,
                                        float reach_m) const;

 private:
  /// What one keyframe observed of some points.
  struct Observation {
    std::vector<std::uint32_t> numbers;
    PointEvidence evidence;
  };
  [[nodiscard]] Observation observation(std::size_t keyframe,
                                        const std::vector<Eigen::Vector3f>& points,
                                        const NearPoints& near, float reach_m) const;

  const SessionData& session_;
  const MergedSession& merged_;
  const MergeConfig& config_;
  VisibilityTest visibility_;
  EvidenceWeights weights_;
};

}  // namespace unimapper::merge
