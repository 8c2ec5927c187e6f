// Datasets whose poses are of the robot's base, and robots with several LiDARs.
#pragma once

#include <memory>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// The dataset with its poses, true ones included, taken for those of the robot's base, on which
/// the LiDAR is mounted at `T_base_lidar`.
[[nodiscard]] std::unique_ptr<Dataset> mounted(std::unique_ptr<Dataset> dataset,
                                               const Pose& T_base_lidar);

/// The dataset with `offset_s` added to the stamps of its poses, true ones excepted: a scan has the
/// pose of `offset_s` before. Beyond the ends the last motion goes on.
[[nodiscard]] std::unique_ptr<Dataset> retimed(std::unique_ptr<Dataset> dataset, double offset_s);

/// The dataset of a LiDAR that hangs upside down and whose poses do so too: the frame of the poses
/// is turned by 180 degrees about x. Points and true poses stay as they are.
[[nodiscard]] std::unique_ptr<Dataset> turned_over(std::unique_ptr<Dataset> dataset);

/// LiDARs of one robot as one: every scan of the first with the nearest in time of each other, no
/// farther than 0.55 of the time between two scans, their points in the first LiDAR's frame at its
/// stamp. Poses must be of the LiDARs themselves and in one frame. Points have no ring; the names
/// and truth are those of the first.
///
/// A range image has one viewpoint: free space is claimed along rays from the first LiDAR, also to
/// points that another one saw past an obstacle. That is harmless while the LiDARs are near to each
/// other against their distance from what they see; a note says how far apart they are. Robots
/// with LiDARs at opposite ends do better with a session each, merged.
[[nodiscard]] std::unique_ptr<Dataset> several_lidars(
    std::vector<std::unique_ptr<Dataset>> datasets);

}  // namespace unimapper::datasets
