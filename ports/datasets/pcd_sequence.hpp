// Directory layout of PCD sequences.
#pragma once

#include <filesystem>
#include <string>

namespace unimapper::datasets {

/// The sub-directory that holds the clouds (`Scans`, `pcd`, `clouds`, ...); empty if none.
std::filesystem::path find_cloud_directory(const std::filesystem::path& directory);

/// The pose file (`optimized_poses.txt`, `poses.txt`, ..., or the only `*.tum`, `*_poses_tum.txt`
/// or
/// `*_poses_kitti.txt`); empty if none.
std::filesystem::path find_poses_file(const std::filesystem::path& directory);

/// What to do about scans without poses, for messages.
[[nodiscard]] std::string remedy_for_missing_poses();

}  // namespace unimapper::datasets
