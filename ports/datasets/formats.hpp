// Dataset openers, one per format.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// KITTI odometry, SemanticKITTI, HeLiMOS and the simulator's output: `scans/` or `velodyne/`
/// with *.bin, `poses.txt`; optional `times.txt`, `calib.txt`, `labels/`, `gt_poses.txt`.
std::unique_ptr<Dataset> open_kitti(const std::filesystem::path& directory);

/// PCD scans in the sensor frame (`Scans/`, `pcd/`, ...) with a TUM or KITTI pose file, as
/// OpenLMM lays them out; optional `times.txt`.
std::unique_ptr<Dataset> open_pcd(const std::filesystem::path& directory);

/// DynamicMap_Benchmark: `pcd/` with clouds in the world frame, sensor pose in VIEWPOINT,
/// ground truth in the intensity (1 moving, 0 static).
std::unique_ptr<Dataset> open_dynamic_map(const std::filesystem::path& directory);

/// HeLiPR: `LiDAR/<sensor>/<ns>.bin` with `LiDAR_GT/<sensor>_gt.txt`. `sensor` may be empty
/// where only one of the four is there.
std::unique_ptr<Dataset> open_helipr(const std::filesystem::path& directory,
                                     const std::string& sensor);

}  // namespace unimapper::datasets
