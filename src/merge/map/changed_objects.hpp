// Changed objects from changed voxels
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "session_observer.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// A voxel of one session, and what another session knows of its position.
struct ComparedVoxel {
  Eigen::Vector3f position;                ///< map frame, metres
  Presence presence = Presence::kUnknown;  ///< in the other session; free: the voxel has changed
  std::uint32_t other = 0;                 ///< index of that session, where presence is known
  Votes own{};                             ///< of the session it is of, where presence is free
};

/// A changed object and its voxels, as indices.
struct ObjectVoxels {
  ChangedObject object;
  std::vector<std::uint32_t> members;
};

/// Makes free voxels unknown of which fewer than `map.min_cluster` lie near each other. O(voxels).
void forget_small_groups(std::vector<ComparedVoxel>& voxels, const MapConfig& config);

/// Groups free voxels that lie near each other, and adds the unknown ones beside them: low parts
/// that hid behind kerbs and far sides. A group is an object if it has `map.min_cluster` free
/// voxels, and half of its voxels about which anything is known are free. Objects
/// come in the order of their first voxel. O(voxels).
std::vector<ObjectVoxels> group_changes(const std::vector<ComparedVoxel>& voxels,
                                        const MapConfig& config);

/// The upright box of least area seen from above that holds all points.
UprightBox box_around(const std::vector<Eigen::Vector3f>& points);

/// Pairs what is gone with what appeared beside it in the session that saw it gone, if both have
/// the same size: one moved object. The points of both become its own.
void pair_moved(std::vector<ChangedObject>& objects, std::vector<ChangedPoint>& points);

}  // namespace unimapper::merge
