// Recognition and opening of every form of recording, for the list of readers.
#pragma once

#include <filesystem>
#include <memory>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// KITTI odometry, SemanticKITTI, HeLiMOS and the simulator's output: `scans/` or `velodyne/`
/// with *.bin, `poses.txt`; optional `times.txt`, `calib.txt`, `labels/`, `gt_poses.txt`.
bool recognises_kitti(const std::filesystem::path& directory);
std::unique_ptr<Dataset> open_kitti(const std::filesystem::path& directory,
                                    const OpenOptions& options);

/// PCD scans in the sensor frame (`Scans/`, `pcd/`, ...) with a TUM or KITTI pose file, as
/// OpenLMM lays them out; optional `times.txt`.
bool recognises_pcd(const std::filesystem::path& directory);
std::unique_ptr<Dataset> open_pcd(const std::filesystem::path& directory,
                                  const OpenOptions& options);

/// DynamicMap_Benchmark: `pcd/` with clouds in the world frame, sensor pose in VIEWPOINT,
/// ground truth in the intensity (1 moving, 0 static).
bool recognises_dynamic_map(const std::filesystem::path& directory);
std::unique_ptr<Dataset> open_dynamic_map(const std::filesystem::path& directory,
                                          const OpenOptions& options);

/// HeLiPR: `LiDAR/<sensor>/<ns>.bin` with `LiDAR_GT/<sensor>_gt.txt`. `options.sensor`
/// may be empty where only one of the four is there.
bool recognises_helipr(const std::filesystem::path& directory);
std::unique_ptr<Dataset> open_helipr(const std::filesystem::path& directory,
                                     const OpenOptions& options);

/// KITTI raw: a drive with `velodyne_points/` and `oxts/`, or a folder of drives of which
/// `options.sequence` names one.
bool recognises_kitti_raw(const std::filesystem::path& directory);
std::unique_ptr<Dataset> open_kitti_raw(const std::filesystem::path& directory,
                                        const OpenOptions& options);

/// nuScenes: `v1.0-*/` with tables, `samples/`, `sweeps/`; `options.sequence` names the scene.
bool recognises_nuscenes(const std::filesystem::path& directory);
std::unique_ptr<Dataset> open_nuscenes(const std::filesystem::path& directory,
                                       const OpenOptions& options);

/// Scans of any common file format in a folder or a folder in it, and a pose file.
bool recognises_folder(const std::filesystem::path& directory);
std::unique_ptr<Dataset> open_folder(const std::filesystem::path& directory,
                                     const OpenOptions& options);

/// A bag of ROS 1 or ROS 2, or an MCAP file: one file, or a folder with the files of one
/// recording. Its scans lie on one topic, their poses on another one or in the transforms.
bool recognises_bag(const std::filesystem::path& path);
std::unique_ptr<Dataset> open_bag(const std::filesystem::path& path, const OpenOptions& options);

}  // namespace unimapper::datasets
