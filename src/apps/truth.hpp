// Ground-truth trajectory of a recording.
#pragma once

#include <filesystem>
#include <vector>

#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::apps {

/// The ground truth of the dataset at `path`, one pose per scan, with the dataset's stamps:
/// gt_poses.txt of a folder of scans, else the dataset's poses. Throws DatasetError.
[[nodiscard]] std::vector<evaluate::StampedPose> read_truth(const std::filesystem::path& path);

}  // namespace unimapper::apps
